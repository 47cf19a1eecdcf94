"""What goes out to others and comes in from them: FHIR, CSV, Parquet, the whole of a patient, and its erasure."""
