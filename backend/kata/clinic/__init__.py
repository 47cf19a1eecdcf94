"""What the clinic keeps. A folder a subject, in each the same rooms: tables, schemas, service, router."""
