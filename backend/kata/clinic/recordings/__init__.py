"""Recordings: motions that were taught (one per take) and motions derived from them. Their samples never change."""
