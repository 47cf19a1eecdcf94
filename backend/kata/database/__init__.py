"""Where the clinic's records are kept: SQLite by default, PostgreSQL by one setting."""
