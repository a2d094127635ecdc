"""What the specimen is predicted to do under a plan: responses and where it collides."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vibench.acquisition.plan import (
    Direction,
    Excitation,
    FrequencySteps,
    Measurement,
    SineSweep,
    excited_band_hz,
    predicted_loads,
)
from vibench.acquisition.rig import BaseQuantity, Rig, RigModel

from ..recordings import specimen_of
from ..signals import Flags, Reals
from ._overlay import prediction_grid
from ._prediction import Approach, ResponsePrediction, predicted

MOST_POINTS = 60
"""Frequencies that are simulated: some seconds of work."""
SIMULATED_S = 6.0
"""Simulated from rest at each frequency; all but a thousandth of the transient has died out by half of it."""
FOLLOWED_POINTS = 200
FOLLOWED_S = 2.0
"""Where a sweep is followed: steps so small that they disturb little, and the time spent at each [s]."""
_TONES = frozenset({"dwell", "sine_sweep", "stepped_sine"})


@dataclass(frozen=True, eq=False)
class MeasurementPrediction:
    """Responses under sines of the base amplitude that the rig's linear model promises."""

    measurement: Measurement
    prediction: ResponsePrediction
    basis: str
    """Where the base amplitude comes from."""
    approach: Approach
    """Where each simulated point begins."""

    @property
    def collision_bands_hz(self) -> tuple[tuple[float, float], ...]:
        """Stretches of frequency in which the masses are predicted to strike."""
        return bands_of(self.prediction.frequency_hz, self.prediction.is_colliding)

    @property
    def model(self) -> str:
        """The model that said so, for a legend."""
        specimen = self.prediction.specimen
        return f"gong2025, gap {specimen.gap_m * 1e6:g} µm"


def predict_measurement(measurement: Measurement, rig: Rig) -> MeasurementPrediction:
    """Simulate the specimen of a rig over the band that a measurement excites."""
    specimen = specimen_of({"specimen": rig.specimen.model_dump()})
    low_hz, high_hz = excited_band_hz(measurement.excitation)
    approach = approach_of(measurement.excitation)
    match approach:
        case Approach.REST:
            grid, each_s = _thinned(prediction_grid(specimen, low_hz, high_hz)), SIMULATED_S
        case Approach.UP | Approach.DOWN:
            grid, each_s = np.linspace(low_hz, high_hz, FOLLOWED_POINTS, dtype=np.float64), FOLLOWED_S
    amplitude_m, basis = base_amplitude_m(measurement, rig, grid)
    prediction = predicted(specimen, grid, amplitude_m, duration_s=each_s, approach=approach)
    return MeasurementPrediction(measurement, prediction, basis, approach)


def approach_of(excitation: Excitation) -> Approach:
    """Tell how a measurement comes to each of its frequencies: a sweep keeps to its branch."""
    match excitation:
        case SineSweep(start_hz=start, stop_hz=stop):
            return Approach.UP if start < stop else Approach.DOWN
        case FrequencySteps():
            first, _ = next(excitation.passes())
            return Approach.UP if first == Direction.UP.value else Approach.DOWN
        case _:
            return Approach.REST


def base_amplitude_m(measurement: Measurement, rig: Rig, frequency_hz: Reals) -> tuple[Reals, str]:
    """Amplitude of the base's sine at each frequency, shape of ``frequency_hz``, and what it is.

    Sines are followed through the rig's linear model at the setting that the plan has for each
    frequency; noise is stood for by a sine of the same rms displacement.
    """
    excitation = measurement.excitation
    if excitation.kind not in _TONES:
        rms_m = predicted_loads(excitation, rig)[BaseQuantity.STROKE].rms
        return np.full(frequency_hz.shape, np.sqrt(2) * rms_m), "a sine of the same rms base displacement"
    terminal_v = 0.5 * excitation.amplitude_vpp * rig.generator.terminal_factor()
    stroke_m = np.abs(RigModel(rig).transfer(BaseQuantity.STROKE, frequency_hz)) * terminal_v
    if isinstance(excitation, SineSweep):
        stroke_m = stroke_m * np.array([excitation.level(float(each)) for each in frequency_hz])
    return np.asarray(stroke_m), "the rig's linear model"


def bands_of(frequency_hz: Reals, is_inside: Flags) -> tuple[tuple[float, float], ...]:
    """Stretches of rising frequencies whose points are inside; an edge lies half way to the next point."""
    middles = np.array([0.5 * (low + high) for low, high in pairwise(frequency_hz)])
    lows = np.concatenate([frequency_hz[:1], middles])
    highs = np.concatenate([middles, frequency_hz[-1:]])
    change = np.diff(np.concatenate([[0], np.asarray(is_inside, dtype=np.int64), [0]]))
    starts, ends = np.flatnonzero(change == 1), np.flatnonzero(change == -1) - 1
    return tuple((float(lows[a]), float(highs[b])) for a, b in zip(starts, ends, strict=True))


def _thinned(grid: Reals) -> Reals:
    step = -(-len(grid) // MOST_POINTS)
    return np.asarray(grid[::step])
