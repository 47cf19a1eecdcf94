"""``kata evaluate``: the paper's experiment (Section 4). It teaches, plays back and compares fourteen cases by every method.

On virtual time the control loop, its supervisor and the driver are the real ones. The simulator provides drives and mechanics, and
the clock is stepped.
"""
