"""Encrypted backups: create one every night, verify it by a trial restore, and restore the clinic from a backup."""
