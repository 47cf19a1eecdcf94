"""Benchmarks: the timing goals, measured on whatever computer this is. They run the real processes and print figures."""
