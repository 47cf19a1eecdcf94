"""Questionnaires: definitions as files, and the licensed texts that a clinic imports."""
