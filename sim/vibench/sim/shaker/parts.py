"""Amplifier and shaker as numbers: everything of them that moves the table. SI units."""

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

STOP_STIFFNESS_N_PER_M = 2e5
"""Of the rubber stops that end the stroke; assumed: 45 N press 0.2 mm into them."""
STOP_DAMPING_NS_PER_M = 50.0
"""Of the same; assumed: the table comes back with about half its energy."""


@dataclass(frozen=True)
class Amplifier:
    """A gain between two first-order band edges, a largest voltage and a largest current.

    As it stands it passes every voltage on: so a table is driven by the voltage recorded at its coil.
    ValueError when a number is not allowed.
    """

    gain: float = 1.0
    """Output volts per input volt, not zero; negative where the amplifier inverts."""
    low_cut_hz: float = 0.0
    """Lower -3 dB frequency [Hz]; 0 where direct voltage passes."""
    high_cut_hz: float = math.inf
    """Upper -3 dB frequency [Hz]."""
    clip_v: float = math.inf
    """Largest output voltage, peak [V]."""
    current_limit_a: float = math.inf
    """Largest current, peak [A]; beyond it the voltage gives way."""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.gain) and self.gain):
            msg = f"A gain of {self.gain} is not allowed: it must be finite and not zero."
            raise ValueError(msg)
        if not 0.0 <= self.low_cut_hz < self.high_cut_hz:
            msg = (
                f"A band from {self.low_cut_hz} to {self.high_cut_hz} Hz is not allowed: it must begin at "
                "0 Hz or above, and end above its beginning."
            )
            raise ValueError(msg)
        for name in ("clip_v", "current_limit_a"):
            if not getattr(self, name) > 0.0:
                msg = f"{name} = {getattr(self, name)} is not allowed: it must be positive, or infinite."
                raise ValueError(msg)


@dataclass(frozen=True)
class StateSpace:
    """A linear system s' = A s + B u; of a shaker s = (displacement, velocity, current) in SI units."""

    A: FloatArray
    """Shape (3, 3)."""
    B: FloatArray
    """Shape (3, 2): columns for the voltage at the coil [V] and an outside force on the table [N]."""


@dataclass(frozen=True)
class Shaker:
    """An electrodynamic shaker: a coil and a suspended table, which rubber stops hold within its stroke.

    ValueError when a number is not allowed.
    """

    moving_mass_kg: float
    """Everything rigid that the coil moves, fixture included, without the specimen [kg]."""
    suspension_stiffness_n_per_m: float
    suspension_damping_ns_per_m: float
    force_constant_n_per_a: float
    """Force per ampere, and voltage per table velocity [V s/m] (Beranek, Acoustics, ch. 3)."""
    coil_resistance_ohm: float
    """Coil and cable [ohm]."""
    coil_inductance_h: float
    stroke_m: float = math.inf
    """Displacement from rest at which the table meets its rubber stops [m]."""
    stop_stiffness_n_per_m: float = STOP_STIFFNESS_N_PER_M
    stop_damping_ns_per_m: float = STOP_DAMPING_NS_PER_M

    def __post_init__(self) -> None:
        for each in fields(self):
            value = getattr(self, each.name)
            if not 0.0 < value <= (math.inf if each.name == "stroke_m" else 1e300):
                msg = f"{each.name} = {value} is not allowed: it must be positive."
                raise ValueError(msg)

    def equations(self) -> StateSpace:
        """Give coil and table as first-order equations, driven by the coil's voltage and a force.

        With m the moving mass, G the force constant and F a force on the table::

            m x'' + d x' + k x = G i + F          L i' + R i + G x' = u
        """
        mass, force_constant, inductance = (
            self.moving_mass_kg,
            self.force_constant_n_per_a,
            self.coil_inductance_h,
        )
        table = np.array(
            [-self.suspension_stiffness_n_per_m, -self.suspension_damping_ns_per_m, force_constant]
        )
        coil = np.array([0.0, -force_constant, -self.coil_resistance_ohm])
        return StateSpace(
            A=np.array([[0.0, 1.0, 0.0], table / mass, coil / inductance]),
            B=np.array([[0.0, 0.0], [0.0, 1 / mass], [1 / inductance, 0.0]]),
        )
