"""The motion that a specimen has while no stop is touched: a steady part, and modes that die away. SI units.

Every displacement is Re(S exp(i omega t)) + Re sum m_j exp(l_j t) with Re l_j <= 0, so that its magnitude is
at most abs(S) + sum abs(m_j) for ever: a bound on p below the gap proves that no stop is ever touched.
"""

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from ..model.drive import Harmonic
from ..model.modes import harmonic_motion, modal_form
from ..model.no_contact import NoContact
from ..model.power_law import PowerLaw
from ..model.specimen import Specimen
from ..model.state import Complex, Floats, X, Y, Z


@dataclass(frozen=True, eq=False)
class LinearMotion:
    """A motion without contact, from time zero on."""

    drive: Harmonic
    rates: Complex
    """Of the modes, shape (n,) [1/s]."""
    modes: Complex
    """What each mode adds to x, y, z, vx, vy, vz at time zero, shape (n, 6)."""
    steady: Complex
    """Phasors of the steady part, shape (6,), for exp(i (omega t + phase))."""

    @property
    def steady_p(self) -> complex:
        """Phasor of p = y - z [m]."""
        return complex(self.steady[Y] - self.steady[Z])

    @property
    def steady_x(self) -> complex:
        """Phasor of x [m]."""
        return complex(self.steady[X])

    @property
    def largest_p_m(self) -> float:
        """No abs(p) is ever larger."""
        return abs(self.steady_p) + float(np.abs(self.modes[:, Y] - self.modes[:, Z]).sum())

    @property
    def slowest_rate(self) -> float:
        """Largest real part of a mode's rate [1/s]: how slowly the start is forgotten; zero is never."""
        return float(self.rates.real.max())

    def state(self, time_s: float) -> Floats:
        """X, y, z, vx, vy, vz at an instant, shape (6,)."""
        # Whole turns are dropped exactly: at late times their rounding would be a phase.
        part = float(Fraction(time_s) * Fraction(self.drive.frequency_hz) % 1)
        turn = 2.0 * math.pi * part + self.drive.phase_rad
        free = (self.modes * np.exp(self.rates * time_s)[:, None]).sum(axis=0)
        return np.asarray((self.steady * complex(math.cos(turn), math.sin(turn)) + free).real)

    def share_left(self, time_s: float) -> float:
        """How large the modes can still be, over the steady part, in x or in p, whichever is worse."""
        fading = np.exp(self.rates.real * time_s)
        return max(
            float(np.abs(part) @ fading) / abs(whole) if np.any(part) else 0.0 for part, whole in self._parts
        )

    def died_away_s(self, share: float) -> float:
        """When the modes are below this share of the steady part, in x and in p; infinite if never."""
        latest = 0.0
        for part, whole in self._parts:
            size = np.abs(part) * len(part) / (share * abs(whole))
            for one, rate in zip(size, self.rates.real, strict=True):
                if one > 1.0:
                    latest = max(latest, math.log(one) / -rate if rate < 0.0 else math.inf)
        return latest

    @property
    def _parts(self) -> tuple[tuple[Complex, complex], tuple[Complex, complex]]:
        across, along = self.modes[:, X], self.modes[:, Y] - self.modes[:, Z]
        return (across, self.steady_x), (along, self.steady_p)


def linear_motion(specimen: Specimen, drive: Harmonic, start: ArrayLike) -> LinearMotion:
    """Find the motion that begins in a state, shape (6,), as long as nothing is touched.

    Raises ValueError when two modes coincide (critical damping), or numbers grow beyond all bounds.
    """
    with np.errstate(all="ignore"):
        form = modal_form(specimen)
        steady, _ = harmonic_motion(specimen, 2.0 * math.pi * drive.frequency_hz, drive.amplitude_m)
        turn = complex(math.cos(drive.phase_rad), math.sin(drive.phase_rad))
        free = np.asarray(start, dtype=np.float64) - (steady * turn).real
        modes = (form.rows @ free)[:, None] * form.shapes
    if not (np.all(np.isfinite(modes)) and np.all(np.isfinite(steady))):
        msg = (
            f"The motion of this specimen under {drive.amplitude_m:g} m at {drive.frequency_hz:g} Hz cannot "
            "be computed: its numbers are too far apart. Correct masses, springs, dampings, drive or start."
        )
        raise ValueError(msg)
    return LinearMotion(drive, form.rates, modes, steady)


def never_touches(specimen: Specimen, motion: LinearMotion) -> bool:
    """Whether it is proved that no force of a stop ever acts."""
    match specimen.contact:
        case NoContact():
            return True
        case PowerLaw():
            return False
        case _:
            return motion.largest_p_m < min(specimen.gaps_m)
