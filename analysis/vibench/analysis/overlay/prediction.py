"""Predicted Responses I and II to sines, and linear transmission, over frequency."""

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from vibench.acquisition.plan import Approach
from vibench.sim import (
    Accuracy,
    Harmonic,
    Outcome,
    Response,
    Specimen,
    base_transmissibility,
    steady_response,
)

from ..signals.arrays import Flags, Integers, Reals
from ..tables import Tabular

PAPER_AMPLITUDES_M = {0.05: 1e-6, 1.5: 5e-6, 10.0: 50e-6}
"""Base amplitude A0 that the paper simulates for each of its voltages V0 (Gong et al. 2025, Fig. 13)."""
PAPER_RESONANCES_HZ = (95.0, 266.0, 500.0)
"""Resonances of m0 without contact [Hz] (Gong et al. 2025, section 5)."""
PAPER_TERMINAL_RESONANCES_HZ = (201.0, 435.0)
"""Resonances of m0 with m1 bound to m2 [Hz] (Gong et al. 2025, section 5)."""
PREDICTION_S = 8.0
WINDOW_S = 5.0
"""Total and observed time [s]: 3 s settling (slowest transient falls to 3e-5), 5 s as in the paper."""


@dataclass(frozen=True, eq=False)
class ResponsePrediction(Tabular):
    """Responses of m0 to sines; arrays of shape (points,)."""

    specimen: Specimen
    frequency_hz: Reals
    amplitude_m: Reals
    """Base amplitude A0 at each frequency."""
    response_i: Reals
    """Response I; like Response II, NaN if the simulation did not finish."""
    response_ii: Reals
    linear: Reals
    """|x / U| of the linear model, without contact."""
    impacts: Integers
    """Number of impacts within the observed time."""
    accuracy: Accuracy
    duration_s: float
    window_s: float

    @property
    def is_colliding(self) -> Flags:
        """Flags of points with collisions within the observed time."""
        return np.asarray(self.impacts > 0)


def predict(
    specimen: Specimen,
    frequency_hz: Reals,
    amplitude_m: Reals | float,
    accuracy: Accuracy = Accuracy.QUICK,
    *,
    duration_s: float = PREDICTION_S,
    approach: Approach = Approach.REST,
) -> ResponsePrediction:
    """Simulate a sine at each frequency: in parallel from rest, or in sequence like a sweep.

    Parameters
    ----------
    frequency_hz
        Frequencies of the sines [Hz], ascending, shape (points,).
    amplitude_m
        Base amplitude A0, one value for all points or one per point [m].
    accuracy
        Quick by default, because free flight is exact at every level and, in chaos, the scatter of Response I
        exceeds the error of every level.
    """
    amplitudes = np.broadcast_to(np.asarray(amplitude_m, dtype=np.float64), frequency_hz.shape)
    drives = [Harmonic(float(f), float(a)) for f, a in zip(frequency_hz, amplitudes, strict=True)]
    # If points follow one another, half of the time is allowed for settling after the frequency step.
    window_s = min(WINDOW_S, duration_s if approach is Approach.REST else duration_s / 2)

    def point(drive: Harmonic, state: Reals | None = None, for_s: float = duration_s) -> Response:
        return steady_response(specimen, drive, accuracy, for_s, window_s, state)

    match approach:
        case Approach.REST:
            with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
                points = list(pool.map(point, drives))
        case Approach.UP:
            points = list(_follow_points(point, drives, duration_s))
        case Approach.DOWN:
            points = list(_follow_points(point, drives[::-1], duration_s))[::-1]
    ended = np.array([each.outcome is Outcome.REACHED_END for each in points])
    return ResponsePrediction(
        specimen=specimen,
        frequency_hz=np.asarray(frequency_hz, dtype=np.float64),
        amplitude_m=amplitudes.copy(),
        response_i=np.where(ended, [each.response_i for each in points], np.nan),
        response_ii=np.where(ended, [each.response_ii for each in points], np.nan),
        linear=np.abs(base_transmissibility(specimen, frequency_hz)[:, 0]),
        impacts=np.array([each.impacts for each in points], dtype=np.int64),
        accuracy=accuracy,
        duration_s=duration_s,
        window_s=window_s,
    )


def _follow_points(
    point: Callable[[Harmonic, Reals | None, float], Response],
    drives: Sequence[Harmonic],
    duration_s: float,
) -> Iterator[Response]:
    """Simulate each point from the final state of the previous one, with continuous drive phase.

    The first point starts from rest and has time to settle.
    """
    state, turns = None, 0.0
    for drive in drives:
        for_s = duration_s if state is not None else max(duration_s, PREDICTION_S)
        found = point(replace(drive, phase_rad=2 * np.pi * turns), state, for_s)
        yield found
        turns = (turns + drive.frequency_hz * for_s) % 1.0
        state = found.final_state if found.outcome is Outcome.REACHED_END else None


def paper_amplitude_m(amplitude_vpp: float) -> float | None:
    """Return the A0 of the paper for one of its three voltages; None for other voltages."""
    for voltage, amplitude in PAPER_AMPLITUDES_M.items():
        if np.isclose(voltage, amplitude_vpp, rtol=1e-3):
            return amplitude
    return None
