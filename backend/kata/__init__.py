"""Kata: the software of a shoulder-rehabilitation apparatus. A motion is taught once and repeated exactly."""

__version__ = "1.0.0"
