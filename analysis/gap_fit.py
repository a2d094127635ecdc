"""The gap, from where collisions begin: there the relative motion of the linear specimen fills it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from sim.modes import base_transmissibility
from sim.specimen import Specimen

from .arrays import Complexes, Reals
from .collision_region import Edge
from .confidence import DEFAULT_CONFIDENCE
from .errors import NotEnoughData
from .measurement_analysis import SweepAnalysis
from .specimen_fit import FittedValue, Parameter, SpecimenFit, parameter_value, with_values

_RELATIVE = 3
"""Column of p in `base_transmissibility`."""
_STEP_HZ = 0.02
"""For the curvature of the transmissibility: a hundredth of the narrowest resonance, far above rounding."""
_STEP = 1e-4
"""Of a logarithm, for how the relative motion depends on the linear parameters."""
_EDGE_POINTS = 41


@dataclass(frozen=True)
class Onset:
    """Where collisions began in a sweep, and the gap that follows."""

    recording: str
    frequency_hz: float
    gap_m: float
    low_m: float
    high_m: float
    """Bounds: those of the edge, widened by the uncertainties of drive and linear specimen."""


def fit_gap(
    sweeps: Sequence[SweepAnalysis],
    linear: Specimen,
    fit: SpecimenFit | None = None,
    confidence: float = DEFAULT_CONFIDENCE,
) -> FittedValue:
    """Give the gap that explains the sharpest onset of collisions.

    Parameters
    ----------
    sweeps
        Measured sweeps; only a region that a sweep enters is an onset, for motion that collides goes on
        colliding beyond where it would begin.
    linear
        Specimen whose linear motion is taken; its own gap plays no part but to be named as nominal.
    fit
        Where the linear specimen comes from, for its covariance.
    confidence
        Of drive and linear specimen within the bounds.

    Raises
    ------
    NotEnoughData
        When no sweep enters a colliding region.

    """
    found = [each for sweep in sweeps for each in onsets(sweep, linear, fit, confidence)]
    if not found:
        raise NotEnoughData(
            "no sweep enters a region in which the masses collide, so the gap cannot be told; sweep with "
            "more drive, or begin outside of the region"
        )
    best = min(found, key=lambda each: each.high_m / each.low_m)
    return FittedValue(
        parameter=Parameter.GAP,
        value=best.gap_m,
        low=best.low_m,
        high=best.high_m,
        sd=float("nan"),
        nominal=linear.gap_m,
    )


def onsets(
    sweep: SweepAnalysis,
    linear: Specimen,
    fit: SpecimenFit | None = None,
    confidence: float = DEFAULT_CONFIDENCE,
) -> Iterator[Onset]:
    """Give every onset of a sweep with the gap that it implies."""
    reach = float(norm.ppf(0.5 + 0.5 * confidence))
    for region in sweep.collisions.regions:
        if region.reaches_start:
            continue
        edge = region.start
        near = np.linspace(edge.lower_hz, edge.upper_hz, _EDGE_POINTS)
        filled = _relative_amplitude(sweep, linear, near)
        at_edge = np.array([edge.frequency_hz])
        spread = reach * np.hypot(_drive_spread(sweep, edge), _linear_spread(sweep, linear, fit, at_edge))
        yield Onset(
            recording=sweep.facts.name,
            frequency_hz=edge.frequency_hz,
            gap_m=float(_relative_amplitude(sweep, linear, at_edge)[0]),
            low_m=float(np.min(filled) * np.exp(-spread)),
            high_m=float(np.max(filled) * np.exp(spread)),
        )


def _relative_amplitude(sweep: SweepAnalysis, linear: Specimen, frequency_hz: Reals) -> Reals:
    """Amplitude of p without contact at frequencies of a sweep [m]."""
    measured = sweep.response
    rising = np.argsort(measured.frequency_hz)
    amplitude_m = np.interp(frequency_hz, measured.frequency_hz[rising], measured.drive_amplitude_m[rising])
    return np.asarray(
        amplitude_m * np.abs(swept_relative(linear, frequency_hz, measured.sweep_rate_hz_per_s))
    )


def swept_relative(specimen: Specimen, frequency_hz: Reals, rate_hz_per_s: float) -> Complexes:
    """Phasor of p over the base's under a linear sweep, without contact, shape of ``frequency_hz``.

    H - (i / 4 pi) (df/dt) d2H/df2: the steady answer and its lag, to the first order in the rate. (The
    answer to exp(i phi(t)) is H at the rate of phi plus a series in its derivatives.)
    """

    def at(shift_hz: float) -> Complexes:
        return np.asarray(base_transmissibility(specimen, frequency_hz + shift_hz)[:, _RELATIVE])

    curvature = (at(_STEP_HZ) - 2.0 * at(0.0) + at(-_STEP_HZ)) / _STEP_HZ**2
    return np.asarray(at(0.0) - 1j / (4.0 * np.pi) * rate_hz_per_s * curvature)


def _drive_spread(sweep: SweepAnalysis, edge: Edge) -> float:
    """Relative standard deviation of A0 at an edge."""
    place = int(np.argmin(np.abs(sweep.response.frequency_hz - edge.frequency_hz)))
    return float(sweep.response.sd_drive_amplitude_m[place] / sweep.response.drive_amplitude_m[place])


def _linear_spread(sweep: SweepAnalysis, linear: Specimen, fit: SpecimenFit | None, at_hz: Reals) -> float:
    """Relative standard deviation of the relative amplitude that the linear fit's covariance leaves."""
    if fit is None:
        return 0.0
    slopes = []
    for each in fit.values:
        value = parameter_value(linear, each.parameter)
        shifted = [
            _relative_amplitude(sweep, with_values(linear, {each.parameter: value * np.exp(step)}), at_hz)[0]
            for step in (_STEP, -_STEP)
        ]
        slopes.append(np.log(shifted[0] / shifted[1]) / (2.0 * _STEP))
    gradient = np.array(slopes)
    return float(np.sqrt(gradient @ fit.covariance @ gradient))
