"""Contains benchmarks that need a checkout, because they need much data, a PostgreSQL server or a long time."""
