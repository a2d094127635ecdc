"""Prediction of a plan: responses and collision bands of the specimen."""

from dataclasses import dataclass

import numpy as np

from vibench.acquisition.plan import Approach, Measurement, base_motion
from vibench.acquisition.rig import Rig

from ..signals.arrays import Flags, Reals, runs_of
from ..tables import Tabular
from .overlay import prediction_grid
from .prediction import ResponsePrediction, predict

MOST_POINTS = 60
"""Maximum number of simulated frequencies; their simulation takes a few seconds."""
SIMULATED_S = 6.0
"""Simulated time from rest at each frequency; the transient decays to 0.1 % in half of this time."""
FOLLOWED_POINTS = 200
FOLLOWED_S = 2.0
"""Number of frequency steps that imitate a sweep (small steps cause small transients); time per step [s]."""


@dataclass(frozen=True, eq=False)
class MeasurementPrediction(Tabular):
    """Responses to sines with the base amplitude of the plan or of the rig's model."""

    measurement: Measurement
    prediction: ResponsePrediction
    basis: str
    """Source of the base amplitude, in words."""
    approach: Approach
    """Initial state of each simulated point: rest, or the final state of the previous point."""
    specimen_name: str
    """Name of the specimen in the rig's configuration."""

    @property
    def collision_bands_hz(self) -> tuple[tuple[float, float], ...]:
        """Return the frequency bands with predicted collisions."""
        return bands_of(self.prediction.frequency_hz, self.prediction.is_colliding)

    @property
    def base_text(self) -> str:
        """Return the base amplitude or its range as text."""
        bounds = (np.min(self.prediction.amplitude_m), np.max(self.prediction.amplitude_m))
        return " to ".join(dict.fromkeys(f"{1e6 * each:.3g} µm" for each in bounds))

    @property
    def model(self) -> str:
        """Return the name of the model for a legend."""
        gaps = " and ".join(f"{1e6 * each:g}" for each in dict.fromkeys(self.prediction.specimen.gaps_m))
        return f"{self.specimen_name}, gap {gaps} µm"


def predict_measurement(measurement: Measurement, rig: Rig) -> MeasurementPrediction:
    """Simulate the specimen of a rig over the excited band of a measurement."""
    specimen = rig.specimen.specimen()
    low_hz, high_hz = measurement.excitation.band_hz
    approach = measurement.excitation.approach
    match approach:
        case Approach.REST:
            grid, each_s = prediction_grid(specimen, low_hz, high_hz), SIMULATED_S
            grid = grid[:: -(-len(grid) // MOST_POINTS)]
        case Approach.UP | Approach.DOWN:
            grid, each_s = np.linspace(low_hz, high_hz, FOLLOWED_POINTS, dtype=np.float64), FOLLOWED_S
    base = base_motion(measurement.excitation, rig, grid)
    prediction = predict(specimen, grid, base.amplitude_m, duration_s=each_s, approach=approach)
    return MeasurementPrediction(measurement, prediction, base.basis, approach, rig.specimen.name)


def bands_of(frequency_hz: Reals, is_inside: Flags) -> tuple[tuple[float, float], ...]:
    """Return the bands of points flagged in ``is_inside``; bands end halfway to the next unflagged point."""
    middles = 0.5 * (frequency_hz[1:] + frequency_hz[:-1])
    lows = np.concatenate([frequency_hz[:1], middles])
    highs = np.concatenate([middles, frequency_hz[-1:]])
    return tuple((float(lows[first]), float(highs[stop - 1])) for first, stop in runs_of(is_inside))
