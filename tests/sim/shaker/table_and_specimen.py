"""The shaker of the tests, and the closed form of its table with a specimen."""

import numpy as np

from vibench.sim import base_transmissibility
from vibench.sim.shaker.loaded_shaker import Shaker

SHAKER = Shaker(
    moving_mass_kg=0.127,
    suspension_stiffness_n_per_m=9932.0,
    suspension_damping_ns_per_m=21.51,
    force_constant_n_per_a=6.78,
    coil_resistance_ohm=2.6,
    coil_inductance_h=1e-4,
)


def base_per_coil_volt(frequency_hz, specimen=None):
    """Return displacement of the table per volt at the coil [m/V] (Beranek's equations)."""
    s = 2j * np.pi * frequency_hz
    carried_kg = SHAKER.moving_mass_kg
    if specimen is not None:
        carried_kg = carried_kg + base_transmissibility(specimen, frequency_hz)[:, :3] @ specimen.masses
    dynamic = SHAKER.suspension_stiffness_n_per_m + SHAKER.suspension_damping_ns_per_m * s + carried_kg * s**2
    impedance = SHAKER.coil_resistance_ohm + SHAKER.coil_inductance_h * s
    return SHAKER.force_constant_n_per_a / (impedance * dynamic + s * SHAKER.force_constant_n_per_a**2)
