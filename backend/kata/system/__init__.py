"""Uses the operating system: scheduling, memory, privileges, files, systemd, the console."""
