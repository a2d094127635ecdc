"""Amplifier, coil, table and specimen under sine voltages: exact without contact, else to first order.

While collisions limit abs(p) to the gap, the fundamental of the stop force equals the force of a spring
between m1 and m2 that reduces abs(p) to the gap. This is a first-order harmonic balance (as in Gong et al.
2025, eq. 5) with loss-free rigid stops. The stop force acts along p only, so the motion has a closed form:
motion without stops plus the response to this force.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from ..specimen.specimen import Complex, Floats, Specimen
from .loaded_shaker import Amplifier, Shaker

SINE_COLUMNS = ("voltage", "current", "base", "m0", "p")
"""Voltage and current at the coil [V, A], displacements [m] (absolute, except p): phasors for exp(+i w t)."""
_VOLTAGE, _CURRENT, _BASE, _M0, _P = range(len(SINE_COLUMNS))


@dataclass(frozen=True, eq=False)
class LinearMotion:
    """Responses to a voltage and to a stop force at n frequencies, with the columns of `SINE_COLUMNS`."""

    per_volt: Complex
    """Motion without contact, per volt at the amplifier's input, shape (n, 5)."""
    per_newton: Complex
    """Motion per newton of stop force, which acts on m1 and in the opposite direction on m2, shape (n, 5)."""

    @cached_property
    def lever(self) -> Complex:
        """Motion per metre of p, if the stops impose p, shape (n, 5)."""
        return self.per_newton / self.per_newton[:, [_P]]

    @cached_property
    def stuck_motion(self) -> Complex:
        """Motion per volt while m1 sticks to m2, shape (n, 5)."""
        return self.per_volt - self.lever * self.per_volt[:, [_P]]

    def response(self, volts: ArrayLike, gap_m: float) -> Complex:
        """Return the motion under sine voltages of given amplitudes, shape (n, 5).

        Parameters
        ----------
        volts
            Amplitude at the amplifier's input [V], one for each frequency, shape (n,), or one for all.
        gap_m
            Gap, the largest abs(p) that the stops allow [m]; infinite without stops.
        """
        free = self.per_volt * np.broadcast_to(volts, len(self.per_volt))[:, None]
        push = _push(free[:, _P], self.per_newton[:, _P], gap_m)
        return np.asarray(free + self.per_newton * push[:, None])

    def volts_for(self, base_m: ArrayLike, gap_m: float) -> Floats:
        """Return the amplitudes at the amplifier's input that give base amplitudes ``base_m``, (n,) [V]."""
        free, by_push = self.per_volt, self.per_newton
        per_base = free[:, _P] / free[:, _BASE]
        # The response of p to the stop force if the voltage keeps the base motion unchanged.
        on_held_base = by_push[:, _P] - per_base * by_push[:, _BASE]
        held_m = np.asarray(base_m, dtype=np.float64)
        push = _push(per_base * held_m, on_held_base, gap_m)
        return np.asarray(np.abs((held_m - by_push[:, _BASE] * push) / free[:, _BASE]))


def linear_motion(
    amplifier: Amplifier, shaker: Shaker, specimen: Specimen | None, frequency_hz: ArrayLike
) -> LinearMotion:
    """Return the response of the equations in `LoadedShaker` to sine voltages, without impacts and limits.

    With the coil impedance Z and the force constant G, the equation of coil and table is (m s^2 + d s + k +
    s G^2/Z) x = (G/Z) u + k0 (x0 - x) + c0 s (x0 - x) (Beranek, Acoustics, ch. 3; Gong et al. 2025, eq. 1).

    Parameters
    ----------
    amplifier, shaker
        Amplifier and shaker; limits of voltage, current and stroke are ignored.
    specimen
        Specimen on the table; None for a bare table, for which m0 and p are zero.
    frequency_hz
        Frequencies, zero or positive, shape (n,) [Hz].
    """
    s = np.asarray(2j * np.pi * np.atleast_1d(frequency_hz), dtype=np.complex128)
    impedance: Complex = shaker.coil_resistance_ohm + s * shaker.coil_inductance_h
    per_volt_n = shaker.force_constant_n_per_a / impedance
    table: Complex = (
        shaker.moving_mass_kg * s**2
        + (shaker.suspension_damping_ns_per_m + shaker.force_constant_n_per_a * per_volt_n) * s
        + shaker.suspension_stiffness_n_per_m
    )
    # Ratio of the amplifier's output voltage to its input voltage, in the shape of ``s``.
    low_cut = 2 * np.pi * amplifier.low_cut_hz
    below = s / (s + low_cut) if low_cut > 0 else np.ones_like(s)
    voltage = np.asarray(amplifier.gain * below / (1.0 + s / (2 * np.pi * amplifier.high_cut_hz)))
    forces: Complex = np.zeros((s.size, 4, 2), dtype=np.complex128)
    forces[:, 0, 0], forces[:, 2, 1], forces[:, 3, 1] = per_volt_n * voltage, 1.0, -1.0
    if specimen is None:
        moved = np.zeros_like(forces)
        moved[:, 0, 0] = forces[:, 0, 0] / table
    else:
        solved = np.linalg.solve(_dynamic_stiffness(table, specimen, s), forces)
        moved = np.asarray(solved, dtype=np.complex128)

    def columns(displacement: Complex, volts: Complex) -> Complex:
        base, m0, m1, m2 = displacement.T
        current = (volts - s * shaker.force_constant_n_per_a * base) / impedance
        return np.stack([volts, current, base, m0, m1 - m2], axis=1)

    return LinearMotion(columns(moved[:, :, 0], voltage), columns(moved[:, :, 1], np.zeros_like(voltage)))


def _dynamic_stiffness(table: Complex, specimen: Specimen, s: Complex) -> Complex:
    """Return the dynamic stiffness matrix of table, m0, m1 and m2, shape (n, 4, 4) [N/m]."""
    s_of = s[:, None, None]
    stiffness = np.zeros((s.size, 4, 4), dtype=np.complex128)
    stiffness[:, 1:, 1:] = (
        specimen.stiffness_matrix + s_of * specimen.damping_matrix + s_of**2 * specimen.mass_matrix
    )
    coupling = specimen.stiffnesses[0] + s * specimen.dampings[0]
    stiffness[:, 0, 0] = table + coupling
    stiffness[:, 0, 1] = stiffness[:, 1, 0] = -coupling
    return stiffness


def _push(p: Complex, receptance: Complex, gap_m: float) -> Complex:
    """Return the force of a spring between m1 and m2 that reduces abs(p) to the gap, shape (n,) [N].

    The stiffness K is the positive root of the quadratic equation abs(p / (1 + K H)) = gap.
    """
    excess = np.maximum((np.abs(p) / gap_m) ** 2 - 1.0, 0.0)
    size = np.maximum(np.abs(receptance) ** 2, np.finfo(np.float64).tiny)
    root = (np.sqrt(receptance.real**2 + size * excess) - receptance.real) / size
    spring = np.where(excess > 0.0, root, 0.0)
    return np.asarray(-spring * p / (1.0 + spring * receptance))
