"""Amplifier, coil and table under a voltage, simulated in steps with the specimen's force on the table.

The specimen exerts a force on the table, so table and specimen are simulated together. A `LoadedShaker` is
built from an `Amplifier`, a `Shaker` and a specimen. Its input is the mean voltage in each time step, and its
outputs are means over the same steps (docs/decisions/0006-virtual-rig.md). The default amplifier does not
change the voltage; use this amplifier for voltages recorded at the coil. `linear_motion` returns the motion
under sine voltages in closed form, with impacts to first order. SI units.

>>> import numpy as np
>>> from vibench.sim import gong2025
>>> from vibench.sim.shaker.loaded_shaker import Amplifier, Shaker
>>> from vibench.sim.shaker.loaded_shaker import LoadedShaker
>>> table = Shaker(
...     moving_mass_kg=0.127, suspension_stiffness_n_per_m=9932.0, suspension_damping_ns_per_m=21.51,
...     force_constant_n_per_a=6.78, coil_resistance_ohm=2.6, coil_inductance_h=1e-4,
... )
>>> step_s = 1e-5
>>> shaken = LoadedShaker(Amplifier(), table, gong2025(), step_s)
>>> drive_v = 0.1 * np.sin(2 * np.pi * 260.0 * step_s * np.arange(100_000))
>>> motion = shaken.move(drive_v)
>>> shaken.impacts, round(float(np.std(motion.base_acceleration[50_000:])), 1)  # m/s2
(0, 0.8)
"""
