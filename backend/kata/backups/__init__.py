"""Encrypted backups: create one every day, verify it by a trial restore, and restore the clinic from a backup."""
