"""Programmes: what is prescribed, recordings in order with how each is played; every change is a new version."""
