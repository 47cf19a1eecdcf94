"""Requests to the operating system: scheduling, memory, privileges, the console."""
