"""Motions: axes, the scapula's linkage, taught motions, trajectories, approach and tracking.

Pure numpy and scipy. It imports nothing else of ours, so that device, simulator and clinic share one model of motions
without depending on each other.
"""
