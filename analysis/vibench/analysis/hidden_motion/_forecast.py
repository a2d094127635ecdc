"""Forecast of m1's motion for 40 ms under a steady sine, with the error of earlier forecasts."""

from collections import deque
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ..signals.arrays import Reals
from ..tables import Tabular
from ._filtering import FilterState, MotionModel, run_filter
from ._prepared_motion import PreparedMotion
from ._tracking_model import STATES, VX, W, X, Y, Z, equations, exact_flow

AHEAD_S = 0.04
LEARNT_S = 0.15
"""Length of motion to which the model of the base is fitted [s]."""
_HARMONICS = 3
_YIELDING = (X, VX, W)
"""States that act on the base: the specimen pushes the table through k0 and c0."""
_BIN_S = 1e-3
_WITHIN = 0.68
_FEWEST, _MOST = 5, 40
"""Smallest and largest number of recent forecasts from which the forecast error is found."""
_NOT_MEASURED = 1e30
"""Variance assigned to a missing sample."""


@dataclass(frozen=True, eq=False)
class Forecast(Tabular):
    """Forecast of p, one value per sample."""

    OWN_UNITS: ClassVar = {"p": "m", "error": "m"}

    first: int
    """Index of the first forecast sample, counted from the start of the recording."""
    p: Reals
    """Relative displacement p = y - z [m]."""
    error: Reals
    """Error that 68 % of recent forecasts did not exceed at this horizon [m]; NaN with too few forecasts."""


class Forecaster:
    """Forecasts of p, and their observed errors."""

    def __init__(self, sample_rate_hz: float) -> None:
        self._bin = max(1, round(_BIN_S * sample_rate_hz))
        self._count = self._bin * round(AHEAD_S / _BIN_S)
        self._errors: deque[Reals] = deque(maxlen=_MOST)
        self._pending: deque[tuple[int, Reals]] = deque(maxlen=8)

    def forecast(
        self,
        model: MotionModel,
        motion: PreparedMotion,
        at: FilterState,
        states: Reals,
        frequency_hz: float,
    ) -> Forecast | None:
        """Return the forecast of p after ``at``; ``states`` are the states at the newest samples.

        None if the filter cannot follow the forecast base motion to the end.
        """
        rate = motion.sample_rate_hz
        numbers = motion.first_sample + at.sample - np.arange(states.shape[0] - 1, -1, -1)
        turned = 2 * np.pi * frequency_hz / rate
        matrix = np.column_stack([*_tones(turned * numbers), states[:, _YIELDING]])
        scale = np.sqrt(np.mean(matrix**2, axis=0)) + np.finfo(float).tiny
        stop = at.sample + 1
        accelerations = motion.accelerations(stop - len(matrix), stop)
        weights = np.linalg.lstsq(matrix / scale, accelerations, rcond=1e-9)[0] / scale
        ahead = numbers[-1] + np.arange(self._count + 1)
        tone = _tones(turned * ahead).T @ weights[: 2 * _HARMONICS]
        yielding = _on_a_table(model, motion, weights[2 * _HARMONICS :])
        coming = replace(motion, acceleration=tone, velocity=np.zeros(tone.size))
        start = FilterState(0, at.state[:STATES].copy(), at.covariance[:STATES, :STATES].copy())
        run = run_filter(yielding, coming, start, self._count)
        if run.states.shape[0] < self._count:
            return None
        p = run.states[:, Y] - run.states[:, Z]
        self._pending.append((int(numbers[-1]) + 1, p))
        return Forecast(int(numbers[-1]) + 1, p, self._usual_error())

    def _usual_error(self) -> Reals:
        if len(self._errors) < _FEWEST:
            return np.full(self._count, np.nan)
        usual = np.quantile(np.array(self._errors), _WITHIN, axis=0)
        return np.asarray(np.repeat(np.maximum.accumulate(usual), self._bin))

    def compare(self, first: int, p: Reals) -> None:
        """Compare forecasts with the tracked ``p`` from sample ``first`` on; ``p`` is NaN without a track."""
        while self._pending and self._pending[0][0] + self._count <= first + p.size:
            begin, forecast = self._pending.popleft()
            if begin < first:
                continue
            error = (forecast - p[begin - first : begin - first + self._count]) ** 2
            if not np.isnan(error).any():
                self._errors.append(np.sqrt(error.reshape(-1, self._bin).mean(axis=1)))


def _tones(turns: Reals) -> Reals:
    """Return sine and cosine of the drive and its harmonics, shape (2 harmonics, samples)."""
    return np.concatenate([(np.sin(n * turns), np.cos(n * turns)) for n in range(1, _HARMONICS + 1)])


def _on_a_table(model: MotionModel, motion: PreparedMotion, weights: Reals) -> MotionModel:
    """Return the model with the fitted reaction of the specimen on the base."""
    a, base, _ = equations(model.specimen, motion.coupling_rad_per_s)
    a[:, _YIELDING] += np.outer(base, weights)
    tables = model.tables
    flow, small_flow = (exact_flow(a, base, tables.step_s / parts) for parts in (1, tables.small_steps))
    return replace(
        model,
        tables=replace(tables, flow=flow, small_flow=small_flow),
        velocity_variance=_NOT_MEASURED,
    )
