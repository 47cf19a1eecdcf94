"""Calculates motions: axes, the scapula's linkage, taught motions, trajectories, approach and tracking.

The package uses only numpy and scipy and imports no other package of Kata. Device, simulator and clinic therefore share one
model of motions without depending on each other.
"""
