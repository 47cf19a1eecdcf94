"""The clinic's stations."""
