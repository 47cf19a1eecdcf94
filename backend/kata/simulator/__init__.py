"""Stands in for the apparatus: servos, mechanics, patient, therapist's hand, pedal and emergency stop.

It speaks the servos' protocol on a pseudo-terminal and shares no code with the device process, so that it cannot
inherit our mistakes.
"""
