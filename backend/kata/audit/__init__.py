"""The audit trail: a chain of hashes over every access and change."""
