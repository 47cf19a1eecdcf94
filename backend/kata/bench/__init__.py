"""Implements ``kata bench``: measures the timing goals on this computer with the real processes and prints figures."""
