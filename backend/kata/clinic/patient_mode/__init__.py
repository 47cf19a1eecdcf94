"""The patient's mode: a patient fills in a questionnaire on a locked browser."""
