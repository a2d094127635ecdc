"""Response curves from a study, and their peaks."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from vibench.sim import Specimen, base_transmissibility, bound_matrices
from vibench.sim.study import StudyResults

Reals = NDArray[np.float64]
Flags = NDArray[np.bool_]

LEAST_PROMINENCE = 2.0
"""Smallest ratio of a peak to the minimum beside it; chaos scatters Response I by some per cent."""
_FINE_POINTS = 60_000
"""Number of frequencies, 0.01 Hz apart, at which peaks without contact are sought."""


def response_peaks(frequency_hz: Reals, response: Reals, least_prominence: float = LEAST_PROMINENCE) -> Reals:
    """Return the frequencies of the peaks of a curve, ascending, shape (peaks,)."""
    known = np.isfinite(response)
    found, _ = find_peaks(np.log(response[known]), prominence=np.log(least_prominence))
    return np.asarray(frequency_hz[known][found])


def linear_peaks(specimen: Specimen, low_hz: float, high_hz: float) -> Reals:
    """Return the peak frequencies of m0 over the base without contact, to 0.01 Hz, shape (peaks,)."""
    fine = np.linspace(low_hz, high_hz, _FINE_POINTS)
    return response_peaks(fine, linear_transmissibility(specimen, fine))


def bound_peaks(specimen: Specimen, low_hz: float, high_hz: float) -> Reals:
    """Return the peak frequencies of m0 over the base with m1 fixed to m2, to 0.01 Hz, shape (peaks,)."""
    mass, damping, stiffness = bound_matrices(specimen)
    fine = np.linspace(low_hz, high_hz, _FINE_POINTS)
    omega = 2.0 * np.pi * fine[:, None, None]
    force = np.zeros((fine.size, 2, 1), dtype=np.complex128)
    force[:, 0, 0] = specimen.stiffnesses[0] + 1j * omega[:, 0, 0] * specimen.dampings[0]
    moved = np.linalg.solve(stiffness - omega**2 * mass + 1j * omega * damping, force)
    return response_peaks(fine, np.abs(moved[:, 0, 0]))


def two_highest(frequency_hz: Reals, response: Reals) -> tuple[float, float, float]:
    """Return the two highest peaks in ascending order [Hz], and the ratio of peak heights third / second."""
    found = np.flatnonzero(np.isin(frequency_hz, response_peaks(frequency_hz, response)))
    if found.size < 2:
        return np.nan, np.nan, np.nan
    ranked = found[np.argsort(-response[found])]
    first, second = np.sort(frequency_hz[ranked[:2]])
    following = response[ranked[2]] / response[ranked[1]] if found.size > 2 else 0.0
    return float(first), float(second), float(following)


def nearest(found: Reals, wanted_hz: tuple[float, ...]) -> tuple[float, ...]:
    """Return the peak nearest to each frequency; NaN if there is no peak."""
    if found.size == 0:
        return tuple(np.nan for _ in wanted_hz)
    return tuple(float(found[np.argmin(np.abs(found - wanted))]) for wanted in wanted_hz)


@dataclass(frozen=True, eq=False)
class Responses:
    """Curve of one model at one amplitude; arrays of shape (points,)."""

    frequency_hz: Reals
    response_i: Reals
    response_ii: Reals
    relative_i: Reals
    exponent_per_s: Reals
    """Largest Lyapunov exponent [1/s]; NaN if not computed."""
    collides: Flags
    """Whether m1 and m2 collided within the window."""

    def collides_within(self, low_hz: float, high_hz: float) -> Flags:
        """Return whether m1 and m2 collided, for frequencies between two limits; shape (points,)."""
        return np.asarray(self.collides & (self.frequency_hz > low_hz) & (self.frequency_hz < high_hz))

    def columns(self, *names: str) -> dict[str, Reals]:
        """Return columns of a table: the frequencies and these quantities; flags become 0 and 1."""
        return {name: getattr(self, name) + 0 for name in ("frequency_hz", *names)}


def responses(results: StudyResults, **fixed: float | str) -> Responses:
    """Return one curve of a study; each axis except frequency must be given or have only one value."""
    only = {axis.name: axis.values[0] for axis in results.axes if len(axis.values) == 1}
    at = {name: value for name, value in {**only, **fixed}.items() if name != "frequency"}
    return Responses(
        frequency_hz=np.asarray(results.study.frequencies_hz),
        response_i=results.values("response_i", **at),
        response_ii=results.values("response_ii", **at),
        relative_i=results.values("relative_i", **at),
        exponent_per_s=results.values("lyapunov", **at),
        collides=np.asarray(np.nan_to_num(results.values("impacts", **at)) > 0),
    )


def linear_transmissibility(specimen: Specimen, frequency_hz: Reals) -> Reals:
    """Return |x / U| of the specimen without contact, shape (frequencies,)."""
    return np.abs(base_transmissibility(specimen, frequency_hz)[:, 0])
