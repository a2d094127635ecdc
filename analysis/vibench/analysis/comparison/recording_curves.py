"""The curves of one recording, and of what the model says of it, as a comparison shows them."""

from collections.abc import Iterator

import numpy as np

from ..frequency_response.noise_response import NoiseResponse
from ..model.prediction import ResponsePrediction
from ..signals.arrays import Reals
from ..sine.dwell import DwellResponse
from ..sine.stepped_response import SteppedResponse
from ..sine.sweep import SweepResponse
from .curve import Curve, CurveKind, CurveOrigin

SAME_HZ = 0.01
"""Frequencies that lie within this are one [Hz]."""


def predicted_curves(name: str, found: ResponsePrediction) -> Iterator[Curve]:
    """Give Responses I and II under sines."""
    low, high = 1e6 * float(found.amplitude_m.min()), 1e6 * float(found.amplitude_m.max())
    level = f"{low:.3g} µm" if low == high else f"{low:.3g} to {high:.3g} µm"
    note = f"sines of A0 = {level}, {found.accuracy.value}"
    unknown = np.full(found.frequency_hz.shape, np.nan)
    values = (found.response_i, found.response_ii, unknown)
    yield from _responses(name, CurveOrigin.PREDICTED, found.frequency_hz, values, note)


def noise_traces(name: str, origin: CurveOrigin, response: NoiseResponse) -> Iterator[Curve]:
    """Make a curve of an estimated transmission, with its bounds."""
    found = response.frequency_response
    how = found.settings
    note = f"{how.estimator.value}, {found.n_eff:.3g} averages, lines {found.resolution_hz:.3g} Hz wide"
    yield Curve(
        name,
        origin,
        CurveKind.TRANSMISSIBILITY,
        found.frequency_hz,
        found.magnitude,
        found.relative_sd_magnitude,
        note,
    )


def sweep_traces(name: str, origin: CurveOrigin, found: SweepResponse) -> Iterator[Curve]:
    """Make a curve of each response that a sweep measured."""
    note = f"{found.sweep_rate_hz_per_s:+.3g} Hz/s"
    yield from _responses(
        name, origin, found.frequency_hz, (found.response_i, found.response_ii, found.sd_response_ii), note
    )


def stepped_traces(name: str, origin: CurveOrigin, found: SteppedResponse) -> Iterator[Curve]:
    """Make a curve of each response of the steps up, and of those down: between jumps they differ."""
    if found.frequency_hz.size > 1 and np.ptp(found.frequency_hz) < SAME_HZ:
        return  # levels at one frequency are no curve over it
    directions = np.array(found.direction)
    for direction in dict.fromkeys(found.direction):
        at = directions == direction
        values = (found.response_i[at], found.response_ii[at], found.sd_response_ii[at])
        yield from _responses(
            f"{name} {direction}", origin, found.frequency_hz[at], values, f"steps {direction}"
        )


def dwell_traces(name: str, origin: CurveOrigin, found: DwellResponse) -> Iterator[Curve]:
    """Make a point of each response that a dwell measured."""
    values = (
        np.array([found.response_i]),
        np.array([found.response_ii]),
        np.array([found.sd_response_ii]),
    )
    note = f"window of {found.window_s:.3g} s, A0 = {1e6 * found.drive.amplitude_m:.3g} µm"
    yield from _responses(name, origin, np.array([found.drive.frequency_hz]), values, note)


def _responses(
    name: str, origin: CurveOrigin, frequency_hz: Reals, values: tuple[Reals, Reals, Reals], note: str
) -> Iterator[Curve]:
    first, second, sd_second = values
    unknown = np.full(frequency_hz.shape, np.nan)
    yield Curve(name, origin, CurveKind.RESPONSE_I, frequency_hz, first, unknown, note)
    yield Curve(name, origin, CurveKind.RESPONSE_II, frequency_hz, second, sd_second / second, note)
