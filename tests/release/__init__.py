"""Wheel, sdist and packages: contents, reproducibility, installation."""
