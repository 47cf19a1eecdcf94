"""The clinic's records. Each subject has one folder with its tables, schemas, service and router."""
