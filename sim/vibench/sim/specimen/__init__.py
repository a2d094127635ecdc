"""Definition of a simulation: specimen, contact law, drive, accuracy, and the specimen without contact.

`Specimen` and the contact laws are frozen and validated; a law also has a short name, such as `power:3+5` or
`hertz`. `Harmonic`, sweeps and `Sampled` describe the base motion, `Accuracy` the error of integration, and
`Outcome` the end of a run. `modes` solves the linear specimen exactly: state matrix, modes, transmissibility,
and the response to the base with m1 free or held by a rigid stop. State order: x, y, z, vx, vy, vz [m, m/s],
absolute. This package does not integrate.
"""
