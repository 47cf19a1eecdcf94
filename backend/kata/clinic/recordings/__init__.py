"""Recordings: motions that were taught, one a take, immutable."""
