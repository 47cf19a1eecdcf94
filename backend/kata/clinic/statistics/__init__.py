"""Figures of the clinic: patients who are due, use of the stations, outcomes of the treatment, stops, tracking errors."""
