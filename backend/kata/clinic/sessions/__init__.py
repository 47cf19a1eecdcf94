"""Sessions and their runs."""
