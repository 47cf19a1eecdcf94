"""What the operating system is asked for: scheduling, memory, privileges, the console."""
