"""Contraindications and precautions of a patient, and what each does."""
