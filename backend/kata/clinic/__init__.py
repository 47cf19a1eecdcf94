"""The clinic's records. Each subject has a folder with its tables, schemas, service and router."""
