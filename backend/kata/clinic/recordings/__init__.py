"""Recordings: motions that were taught, one a take, and what was made of them; immutable."""
