"""The operating system: memory and privileges."""
