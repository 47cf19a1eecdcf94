"""The session and the episode on paper: one HTML page each, to be printed by a browser or as PDF."""
