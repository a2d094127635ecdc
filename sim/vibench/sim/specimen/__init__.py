"""Definition of a simulation: specimen, contact law, drive, accuracy, and the specimen without contact.

`Specimen` and the contact laws are frozen and validated; a law also has a name in one word, `power:3+5` or
`hertz`. `Harmonic`, sweeps and `Sampled` say how the base moves, `Accuracy` how exactly to integrate,
`Outcome` how a run ended. The linear specimen is solved exactly: state matrix, modes, transmissibility, the
answer to the base with m1 free (`_modes`, `_against_stops`) or held by a rigid stop (`_bound_modes`). State
order: x, y, z, vx, vy, vz [m, m/s], absolute. Nothing here integrates.
"""
