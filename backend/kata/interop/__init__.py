"""Import and export: FHIR, CSV, Parquet, a patient's complete record, and its erasure."""
