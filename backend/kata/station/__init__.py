"""Represents one device in the service: its process, its commands and its telemetry. The package uses no database."""
