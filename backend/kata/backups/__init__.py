"""Backups: made each night, encrypted, tried; and how the clinic comes back from one."""
