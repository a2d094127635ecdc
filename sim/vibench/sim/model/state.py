"""What the kernels need to know of a specimen: plain numbers, ready to multiply. SI units.

Also the layout of the one state vector that every kernel advances in place.
"""

X, Y, Z, VX, VY, VZ = range(6)
"""Absolute displacements and velocities: always valid, in flight and in contact."""
