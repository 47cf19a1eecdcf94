"""One device, seen from the service: its process, the door for commands, the stream of telemetry. No database."""
