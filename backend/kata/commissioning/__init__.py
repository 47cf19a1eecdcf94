"""Commissions a station: the steps from new drives to a station with a checked configuration and a record."""
