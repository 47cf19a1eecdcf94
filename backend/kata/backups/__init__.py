"""Encrypted backups: create them every night, verify them by a trial restore, and restore the clinic from one."""
