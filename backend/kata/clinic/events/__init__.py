"""Alarms and events of the apparatus."""
