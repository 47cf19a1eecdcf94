"""Records that only a care team sees, and how others get in when it has to be."""
