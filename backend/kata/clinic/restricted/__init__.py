"""Restricted records: care teams and break-glass access."""
