"""The fast loop: a real-time controller that holds branches of periodic motion, stable or unstable.

An extension of vibench that is found by the entry points in its ``pyproject.toml``. It adds the drive, the
simulated instrument, and a kind of excitation with its controller, analysis, figure and form.

A controller samples base and m0, and sets the amplifier voltage after a latency. `law` models one control
step of table, specimen and delayed voltages, designs a linear law that damps the specimen (a Kalman filter
and feedback of its estimate), and computes whether a periodic motion is stable under this law.
`open_loop_multiplier` estimates stability without feedback from a perturbed motion. If the drive makes the
base move as a sine, the held motion is a motion of the specimen under this sine, for any law. SI units.
"""
