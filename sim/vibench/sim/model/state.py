"""The order of a state vector. SI units."""

X, Y, Z, VX, VY, VZ = range(6)
"""Absolute displacements and velocities: always valid, in flight and in contact."""
