"""Simulates the apparatus: servos, mechanics, patient, therapist's hand, pedal and emergency stop.

It uses the servos' protocol on a pseudo-terminal. It shares no code with the device process, so that the two cannot contain the same
mistake.
"""
