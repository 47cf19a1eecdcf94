"""Accounts, roles, passwords, second factors and login sessions."""
