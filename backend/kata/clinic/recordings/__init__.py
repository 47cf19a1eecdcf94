"""Recordings: taught motions, one per take, and motions derived from them. Immutable."""
