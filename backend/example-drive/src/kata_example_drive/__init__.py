"""A driver package for Kata."""
