"""The fast loop: branches of periodic motions, stable or not, that a real-time controller holds.

An extension of vibench, found by the entry points of its ``pyproject.toml``: a kind of excitation with its
controller, analysis, figure and form, the drive that plays it, and the simulated instrument behind it.

A controller samples base and m0, and sets the voltage at the amplifier some latency later. `plant` says what
a step of it makes of table, specimen and volts on their way; `law` gives the linear law (a Kalman filter and
the feedback of its estimate) that damps the specimen, and says whether a periodic motion is stable under it;
`open_loop_multiplier` tells from samples of a perturbed motion whether it would be stable without. The
harmonic content of the drive is no part of the law: where the base moves as a sine, the motion held is one of
the specimen alone, whatever the law is. SI units.
"""
