"""The fast loop: a real-time controller that holds branches of periodic motions, stable or not.

An extension of vibench, found by the entry points of its ``pyproject.toml``. It adds a kind of excitation
with its controller, analysis, figure and form, the drive that plays it, and the simulated instrument.

A controller samples base and m0, and sets the amplifier voltage after a latency. `plant` models one control
step of table, specimen and delayed voltages. `law` designs the linear law (a Kalman filter and feedback of
its estimate) that damps the specimen, and computes whether a periodic motion is stable under it.
`open_loop_multiplier` estimates stability without feedback from samples of a perturbed motion. If the
harmonics of the drive make the base move as a sine, the held motion is one of the specimen alone, whatever
the law. SI units.
"""
