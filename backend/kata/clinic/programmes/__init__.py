"""Programmes: recordings that are prescribed in an order and with settings. Every change makes a new version."""
