"""Figures of the clinic: who is due, use of the stations, outcomes of the treatment, stops, tracking errors."""
