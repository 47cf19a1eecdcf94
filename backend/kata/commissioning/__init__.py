"""Commissioning: the steps that turn a box of drives into a station with a checked configuration and a record."""
