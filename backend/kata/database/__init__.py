"""The database of the clinic's records: SQLite by default, PostgreSQL by one setting."""
