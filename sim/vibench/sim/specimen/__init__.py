"""Definition of a simulation: specimen, contact law, drive, accuracy, and the specimen without contact.

`Specimen` and the contact laws are immutable and validated; a law also has a short name, such as `power:3+5`.
`Harmonic`, the sweeps and `Sampled` describe the base motion, `Accuracy` the integration error, and `Outcome`
the end of a run. `modes` solves the linear specimen exactly: state matrix, modes, transmissibility, and the
response to the base with m1 free or held by a rigid stop. States are x, y, z, vx, vy, vz in the inertial
frame [m, m/s]. This package does not integrate motions in time.
"""
