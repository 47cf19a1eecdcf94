"""Benchmarks that need a checkout: their data, PostgreSQL server or running time is too large for an installed Kata."""
