"""Implements ``kata evaluate``, the paper's experiment (Section 4): teach, play back and compare fourteen cases by every method.

In virtual time the control loop, its supervisor and the driver are the real ones. The simulator provides drives and mechanics, and
the clock is stepped.
"""
