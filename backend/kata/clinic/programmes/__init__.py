"""Programmes: prescribed recordings in their order, with their settings. Every change is a new version."""
