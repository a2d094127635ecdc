"""Backbone of a mode: its phase resonance, stable or not, as a function of the drive level. SI units.

At a phase resonance, the fundamental of m0 lags the base by a given angle, usually a quarter of a period
(Peter and Leine, Mech. Syst. Signal Process. 98 (2018) 572). A base motion u exerts the inertia force m w^2 u
on the motion relative to the base. This force is in phase with u, so the relative motion lags u by a quarter
of a period. Shooting finds the phase resonance, with the phase as a seventh equation and the frequency as a
seventh unknown. Pseudo-arclength continuation follows the phase resonance along the drive level.
"""

import math
from dataclasses import dataclass

import numpy as np
import scipy

from ..specimen.drive import Harmonic
from ..specimen.modes import base_transmissibility
from ..specimen.specimen import Floats, Specimen
from ..specimen.stops import member
from .branch import Branch, OrbitShape
from .branch_following import AmplitudePath, DrivePath, follow
from .continuation import ArcSteps, correct
from .orbit_branch import ExactFamily
from .shooting import PeriodMap, PhaseReference, PhaseReferenceWord

QUARTER_BEHIND = -0.5 * math.pi
STEPS = ArcSteps(first=0.05, longest=0.3, shortest=1e-6, tolerance=1e-9, most_points=600)
"""Step lengths along the branch; a decade of level has the length `LENGTH_PER_DECADE`."""
LENGTH_PER_DECADE = 2.0
FREQUENCY_SHARE = 0.1
"""Relative change of the frequency that counts as one unit of arc length."""
FARTHEST = 20.0
"""Largest change of frequency or level that Newton's iteration may try, in units of arc length."""
STRAYED = 1e3
"""Largest state [gaps] that Newton's iteration may try; with a hard spring, larger states take minutes."""
DIFFERENCE = 1e-6
"""Step of the finite differences for derivatives of the phase, relative to the scale of each unknown."""
SCAN_POINTS = 400


@dataclass(frozen=True, eq=False)
class PhaseResonanceFamily(ExactFamily):
    """Motions with a given phase of m0; the last two unknowns are scaled logarithms of frequency and level.

    Frequency and level are relative to the reference drive.
    """

    phase_rad: float
    of: PhaseReference

    @property
    def path(self) -> DrivePath:
        """Path along drive amplitude only, because the phase determines the frequency."""
        return AmplitudePath(self.reference.frequency_hz)

    def amplitude_m(self, point: Floats) -> float:
        """Return the drive amplitude at a point of the branch [m]."""
        return self.reference.amplitude_m * float(10.0 ** (point[7] / LENGTH_PER_DECADE))

    def drive_at(self, point: Floats) -> Harmonic:
        """Return the drive at a point of the branch."""
        frequency_hz = self.reference.frequency_hz * math.exp(FREQUENCY_SHARE * float(point[6]))
        return Harmonic(frequency_hz, self.amplitude_m(point))

    def linearise(self, point: Floats) -> tuple[Floats, Floats]:
        """Return closure error and phase error, shape (7,), and their Jacobian, shape (7, 8)."""
        if not bool(np.all(np.abs(point[6:]) < FARTHEST) and np.all(np.abs(point[:6]) < STRAYED)):
            return np.full(7, math.nan), np.full((7, 8), math.nan)
        drive, state = self.drive_at(point), self.state_at(point)
        gone, by_state, ratio = self.closure(state, drive)
        if not bool(np.all(np.isfinite(gone))):
            return np.full(7, math.nan), np.full((7, 8), math.nan)
        by_frequency = FREQUENCY_SHARE * ratio * self.mapping.frequency_slope(state, drive)
        by_level = math.log(10.0) / LENGTH_PER_DECADE * ratio * self.mapping.amplitude_slope(state, drive)
        off, slopes = self._error(point), np.empty(8)
        for k, nudge in enumerate(DIFFERENCE * np.eye(8)):
            slopes[k] = (self._error(point + nudge) - self._error(point - nudge)) / (2.0 * DIFFERENCE)
        return np.append(gone, off), np.vstack([np.column_stack([by_state, by_frequency, by_level]), slopes])

    def _error(self, point: Floats) -> float:
        """Return the sine of the phase error of m0 relative to the base."""
        # The base A0 sin(w t) has the phasor -i A0.
        phasor = 1j * self.mapping.response(self.state_at(point), self.drive_at(point)).line_x_m
        turned = self.of.motion(phasor / self.amplitude_m(point)) * np.exp(-1j * self.phase_rad)
        return float(turned.imag / abs(turned))


def phase_resonance_branch(
    specimen: Specimen,
    band_hz: tuple[float, float],
    levels_m: tuple[float, float],
    of: PhaseReference | PhaseReferenceWord = PhaseReference.RELATIVE,
    phase_rad: float = QUARTER_BEHIND,
    steps: ArcSteps = STEPS,
) -> Branch:
    """Follow the phase resonance of a mode along the drive level, from a level without contact.

    Return the branch along the amplitude (the branch may turn back), with frequency and multipliers of each
    motion. Raises ValueError when the specimen has no damping, no motion is found at the lower level, m1
    reaches its stops at this level, the linear motion does not have this phase exactly once in the band, or
    `of` is not a value of `PhaseReference`.

    Parameters
    ----------
    specimen
        Specimen with any contact law, and two equal stops or none.
    band_hz
        Frequencies around one mode [Hz]. Motion without contact must have the phase exactly once there.
    levels_m
        Drive amplitudes, ascending [m]; at the lower level m1 must not reach its stops.
    of, phase_rad
        Motion of m0 (absolute or relative to the base), and its phase against the base displacement [rad].
    steps
        Step lengths along the branch; 0.5 is a quarter of a decade of level, or 5 % of frequency.
    """
    (low_m, high_m), of = levels_m, member(PhaseReference, of)
    if not any(specimen.dampings):
        raise ValueError(
            "A specimen without damping has no phase resonance: at a resonance, the motion without contacts "
            "grows without bound. Give a damping time above 0."
        )
    frequency_hz = linear_phase_resonance_hz(specimen, band_hz, of, phase_rad)
    drive = Harmonic(frequency_hz, low_m)
    answer = base_transmissibility(specimen, frequency_hz)[0]
    if not 0.0 < low_m < high_m or low_m * abs(answer[3]) >= min(specimen.gaps_m):
        raise ValueError(
            f"Levels {low_m:g} to {high_m:g} m are not allowed: give ascending levels, the lower one below "
            f"{min(specimen.gaps_m) / abs(answer[3]):.3g} m, where m1 reaches its stops."
        )
    phasors = -1j * low_m * answer[:3]
    state = np.concatenate([phasors.real, (2j * math.pi * frequency_hz * phasors).real])
    family = PhaseResonanceFamily(PeriodMap(specimen, OrbitShape.MIRRORED), drive, phase_rad, of)
    guess = np.concatenate([state / family.scales, [0.0, 0.0]])
    start, iterations = correct(family, guess, np.eye(8)[7], steps.tolerance)
    if iterations == 0 or not band_hz[0] <= family.drive_at(start).frequency_hz <= band_hz[1]:
        # A power law acts at every p, so even at the lower level the motion may not be close to linear.
        raise ValueError(
            f"From the linear motion at {low_m:g} m, no motion with this phase is found between "
            f"{band_hz[0]:g} and {band_hz[1]:g} Hz: give a lower first level, or a wider band."
        )
    far = LENGTH_PER_DECADE * math.log10(high_m / low_m)
    return follow(family, start, 1.0, (-1e-9, far), steps)


def linear_phase_resonance_hz(
    specimen: Specimen, band_hz: tuple[float, float], of: PhaseReference, phase_rad: float
) -> float:
    """Return the frequency [Hz] in a band at which m0 has a given phase to the base, without contact."""

    def off(frequency_hz: float) -> float:
        seen = complex(base_transmissibility(specimen, frequency_hz)[0, 0])
        turned = of.motion(seen) * np.exp(-1j * phase_rad)
        return float(turned.imag / abs(turned))

    grid = np.linspace(*band_hz, SCAN_POINTS)
    values = [off(float(each)) for each in grid]
    # Use only zeros at which the function falls, because the lag increases through a mode.
    found_hz = [
        float(scipy.optimize.brentq(off, grid[k], grid[k + 1], xtol=1e-12))
        for k in range(len(grid) - 1)
        if values[k] > 0.0 >= values[k + 1]
    ]
    if len(found_hz) == 1:
        return found_hz[0]
    where = f"at {', '.join(f'{each:.4g}' for each in found_hz)} Hz" if found_hz else "nowhere"
    raise ValueError(
        f"Between {band_hz[0]:g} and {band_hz[1]:g} Hz, the phase of m0 against the base is "
        f"{math.degrees(phase_rad):.3g} degrees {where}: give a band around one mode."
    )
