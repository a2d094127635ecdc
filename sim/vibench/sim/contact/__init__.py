"""Contact with a stop that yields: Hertz, Hunt and Crossley, linear spring; from touch to separation.

With |p| = gap + w^2 and dt = w ds every rate is a polynomial, so that Dormand and Prince's order 8(5,3)
keeps its order at onset and exit (docs/decisions/0004-contact-integration.md, 0008-speed-of-contacts.md).
Unknowns: w [m^0.5], r = d|p|/dt [m/s], x, z, vx, vz, t. Rigid stops and power laws are not here.
"""
