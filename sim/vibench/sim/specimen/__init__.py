"""Definition of a simulation (specimen, contact law, drive), and solution without contact.

`Specimen` and the contact laws are immutable and validated. A law also has a short name, such as `power:3+5`.
`Harmonic`, the sweeps and `Sampled` are base motions. `modes` solves the linear specimen exactly: state
matrix, modes, transmissibility, and response to the base with m1 free or stuck to a rigid stop. States are
x, y, z, vx, vy, vz in the inertial frame [m, m/s]. This package does not integrate motions in time.
"""
