"""What a motion is: axes, the scapula's linkage, taught motions, trajectories, approach and tracking.

Pure numpy and scipy; imports nothing of ours, so that the device, the simulator and the clinic can all
speak of motions in the same words without depending on each other.
"""
