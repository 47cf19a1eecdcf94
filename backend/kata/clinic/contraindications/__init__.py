"""Contraindications and precautions of a patient, and the effect of each."""
