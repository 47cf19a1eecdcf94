"""Reports of sessions and episodes: one HTML page each, printed by a browser or as PDF."""
