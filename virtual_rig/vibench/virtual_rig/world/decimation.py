"""The converter's anti-alias filter: from the world's grid of means to samples at any lower rate.

The world hands over means over its steps. A windowed sinc (Kaiser window) of linear phase, corrected
for the droop of those means, limits the band and is evaluated where the samples lie: at whole
divisors of the grid's rate that is one fixed set of weights, at any other rate a row of a table,
interpolated. A sensor's delay moves the place of evaluation and so is exact between grid points.
"""

from dataclasses import dataclass
from functools import cached_property
from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from vibench.sim.engine.run import native_engine
from vibench.sim.engine.structures import Structure

FloatArray = NDArray[np.float64]

GROUP_DELAY_SAMPLES = 40
"""Delay of every channel alike, in samples of the rate converted to: typical of a delta-sigma converter."""

_HALF_WIDTH_SAMPLES = 32
"""With the Kaiser window below: pass band to 0.45, stop band from 0.55 of the sample rate, 100 dB down."""
_STOP_BAND_DB = 100.0
_KAISER_BETA = 0.1102 * (_STOP_BAND_DB - 8.7)
"""Kaiser 1974, as in Oppenheim and Schafer, Discrete-Time Signal Processing, eq. 7.75."""

_DROOP_REACH = 3
"""Grid points to each side that the droop correction takes in."""
_DROOP_BAND = 0.23
"""The correction is fitted from zero to here, in cycles per step."""
_DROOP_FIT_POINTS = 200

_PHASES_PER_SAMPLE = 512
"""Rows of the table per output sample: linear interpolation between them is 110 dB below the signal."""
_LANES = 8
"""The native engine takes weights in so many at a time."""

EARLIEST_STEPS = -4.0
"""A channel may be this much early without the filter needing the future."""


@dataclass(frozen=True)
class Decimator:
    """Samples of one channel out of its means over the steps of the world."""

    ratio: float
    """Steps per sample; whole numbers are the fast case."""
    start_step: int
    """The first step after the conversion began."""
    delay_steps: float
    """Delay of the channel's sensor beyond what is in the means already."""
    table: FloatArray
    """Shape (rows, weights): one row for a whole ratio, else one for each fraction of a step and one more."""

    @property
    def reach(self) -> int:
        """Weights of one sample."""
        return int(self.table.shape[1])

    def centre(self, sample: int) -> float:
        """Where a sample lies, in steps from the first one of the conversion, counted in means' middles."""
        group_delay = GROUP_DELAY_SAMPLES * max(self.ratio, 1.0)
        return (sample + 1) * self.ratio - group_delay - self.delay_steps - 0.5

    def first_step(self, sample: int) -> int:
        """Return the oldest step that a sample needs."""
        return self.start_step + floor(self.centre(sample)) + self._newest_offset - self.reach + 1

    @property
    def _newest_offset(self) -> int:
        return _half_width_steps(self.ratio) + 1

    def convert(self, means: FloatArray, means_first_step: int, sample: int, count: int) -> FloatArray:
        """Return ``count`` samples from number ``sample`` on, shape (count,); the means begin at a step."""
        engine, samples = native_engine(), np.empty(count)
        origin = self.start_step - means_first_step + self._newest_offset - self.reach + 1
        engine.fill(self._work, means=means, origin=origin, first=sample, samples=samples)
        engine.call("decimate", self._work)
        return samples

    @cached_property
    def _work(self) -> Structure:
        """What is the same for every block."""
        return native_engine().new(
            "Decimation", table=self.table, reach=self.reach, ratio=self.ratio, begin=self.centre(-1)
        )


def decimator(ratio: float, start_step: int, delay_steps: float) -> Decimator:
    """Design the filter of one channel for ``ratio`` steps per sample."""
    delay = max(delay_steps, EARLIEST_STEPS)
    centre = Decimator(ratio, start_step, delay, np.zeros((1, 1))).centre(0)
    if ratio == round(ratio):
        fractions = np.array([centre - floor(centre)])
    else:
        rows = ceil(_PHASES_PER_SAMPLE / max(ratio, 1.0))
        fractions = np.arange(rows + 1) / rows
    table = np.array([_weights(ratio, float(fraction)) for fraction in fractions])
    return Decimator(ratio, start_step, delay, table)


def history_steps(ratio: float, delay_steps: float) -> int:
    """Count the steps before the beginning of a conversion that its first sample looks back on."""
    filter_span = GROUP_DELAY_SAMPLES * max(ratio, 1.0) + _half_width_steps(ratio)
    return ceil(filter_span + max(delay_steps, 0.0)) + 2 * _LANES


def _half_width_steps(ratio: float) -> int:
    return ceil(_HALF_WIDTH_SAMPLES * max(ratio, 1.0)) + _DROOP_REACH


def _weights(ratio: float, fraction: float) -> FloatArray:
    """Weights, oldest first, of a sample that lies ``fraction`` of a step behind a grid point."""
    newest = _half_width_steps(ratio) + 1
    count = ceil(2 * newest / _LANES) * _LANES
    positions = newest - np.arange(count - 1, -1, -1.0) - fraction
    correction = _droop_correction()
    weights = np.zeros(count)
    for shift, weight in zip(range(-_DROOP_REACH, _DROOP_REACH + 1), correction, strict=True):
        weights += weight * _windowed_sinc(positions - shift, ratio)
    return np.asarray(weights / weights.sum())


def _windowed_sinc(positions: FloatArray, ratio: float) -> FloatArray:
    samples = positions / max(ratio, 1.0)
    inside = np.clip(1 - (samples / _HALF_WIDTH_SAMPLES) ** 2, 0, None)
    window = np.where(inside > 0, np.i0(_KAISER_BETA * np.sqrt(inside)), 0.0)
    return np.asarray(np.sinc(samples) * window)


def _droop_correction() -> FloatArray:
    """Symmetric weights that undo sin(pi f)/(pi f), the gain of a mean over one step."""
    frequency = np.linspace(0, _DROOP_BAND, _DROOP_FIT_POINTS)
    cosines = [np.ones_like(frequency)]
    cosines += [2 * np.cos(2 * np.pi * order * frequency) for order in range(1, _DROOP_REACH + 1)]
    matrix = np.array(cosines).T
    half, *_ = np.linalg.lstsq(matrix * np.sinc(frequency)[:, np.newaxis], np.ones_like(frequency))
    return np.concatenate([half[:0:-1], half])
