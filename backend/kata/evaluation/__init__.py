"""The paper's experiment (Section 4) as one command: teach, play back and compare, fourteen cases, by every method.

On virtual time the control loop, its supervisor and the driver are the real ones, drives and mechanics the simulator's;
only the clock is stepped.
"""
