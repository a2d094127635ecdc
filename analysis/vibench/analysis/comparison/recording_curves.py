"""Curves of one recording, measured and simulated, and the options of their analysis."""

from collections.abc import Iterator
from enum import StrEnum
from typing import Annotated, Self

import numpy as np
from pydantic import Field, PositiveFloat, model_validator

from vibench.sim import FrozenModel

from ..frequency_response.noise_response import NoiseResponse
from ..frequency_response.request import FrequencyResponseRequest
from ..frequency_response.results import Estimator
from ..overlay.overlay import Simulation
from ..overlay.prediction import ResponsePrediction
from ..signals.arrays import Reals
from ..signals.confidence import DEFAULT_CONFIDENCE
from ..signals.window import Window
from ..sine.dwell import DwellResponse
from ..sine.stepped_response import SteppedResponse
from ..sine.sweep import SweptMotion
from .curve import Curve, CurveKind, CurveOrigin

SAME_HZ = 0.01
"""Largest difference between two frequencies that count as equal [Hz]."""


def predicted_curves(name: str, found: ResponsePrediction) -> Iterator[Curve]:
    """Yield the curves of predicted Responses I and II."""
    low, high = 1e6 * float(found.amplitude_m.min()), 1e6 * float(found.amplitude_m.max())
    level = f"{low:.3g} µm" if low == high else f"{low:.3g} to {high:.3g} µm"
    note = f"sines of A0 = {level}, {found.accuracy.value} accuracy"
    unknown = np.full(found.frequency_hz.shape, np.nan)
    values = (found.response_i, found.response_ii, unknown)
    yield from _responses(name, CurveOrigin.PREDICTED, found.frequency_hz, values, note)


def noise_traces(name: str, origin: CurveOrigin, response: NoiseResponse) -> Iterator[Curve]:
    """Yield the curve of an estimated transmission, with its standard deviation."""
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


def sweep_traces(name: str, origin: CurveOrigin, found: SweptMotion) -> Iterator[Curve]:
    """Yield the curves of Responses I and II of a sweep."""
    note = f"{found.sweep_rate_hz_per_s:+.3g} Hz/s"
    yield from _responses(
        name, origin, found.frequency_hz, (found.response_i, found.response_ii, found.sd_response_ii), note
    )


def stepped_traces(name: str, origin: CurveOrigin, found: SteppedResponse) -> Iterator[Curve]:
    """Yield separate curves for steps up and steps down; the two responses differ between the jumps."""
    if found.frequency_hz.size > 1 and np.ptp(found.frequency_hz) < SAME_HZ:
        return  # several levels at one frequency are not a curve over frequency
    directions = np.array(found.direction)
    for direction in dict.fromkeys(found.direction):
        at = directions == direction
        values = (found.response_i[at], found.response_ii[at], found.sd_response_ii[at])
        yield from _responses(
            f"{name} {direction}", origin, found.frequency_hz[at], values, f"steps {direction}"
        )


def dwell_traces(name: str, origin: CurveOrigin, found: DwellResponse) -> Iterator[Curve]:
    """Yield Responses I and II of a dwell as curves of one point."""
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


class Model(StrEnum):
    """Simulation to overlay on measurements."""

    LEFT_OUT = "left out"
    UNDER_VOLTAGE = "under the recorded voltage"
    """Several simulated runs of rig and specimen; also valid for chaotic motion."""
    UNDER_BASE = "under the recorded base motion"
    """One simulated run of the specimen alone; for linear and coherent motion."""


_SIMULATIONS = {
    Model.LEFT_OUT: Simulation.LEFT_OUT,
    Model.UNDER_VOLTAGE: Simulation.UNDER_VOLTAGE,
    Model.UNDER_BASE: Simulation.UNDER_BASE,
}


class AnalysisOptions(FrozenModel):
    """Options of an analysis; the options from estimator to confidence apply to noise only."""

    model: Model = Model.LEFT_OUT
    """Simulation to overlay: rig and specimen driven by the recorded voltage (the twin), or the specimen
    alone driven by the recorded base motion. A simulation takes seconds to minutes per recording."""
    estimator: Estimator = Estimator.DRIVE
    """Estimator: noise on the base biases 'h1', noise on the response biases 'h2', neither biases 'drive'."""
    noise_ratio: float | None = Field(default=None, ge=0.0)
    """For hv only: ratio of the noise densities of m0's velocity and the base acceleration, in s²."""
    window: Window = Window.HANN
    """Window of the segments of streamed noise."""
    resolution_hz: PositiveFloat | None = None
    """Resolution for streamed noise; automatic by default. Give either resolution or averages."""
    averages: Annotated[float, Field(gt=1.0)] | None = None
    """Number of independent averages of streamed noise; automatic by default."""
    overlap: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.5
    """Overlap of neighbouring segments, as a fraction of their length."""
    confidence: Annotated[float, Field(gt=0.0, lt=1.0)] = DEFAULT_CONFIDENCE
    """Probability that the bounds at a spectral line contain the true value."""

    @model_validator(mode="after")
    def _is_allowed(self) -> Self:
        """Refuse invalid combinations of options, for which building the noise request raises an error."""
        self.request  # noqa: B018 - making it is the check
        return self

    @property
    def request(self) -> FrequencyResponseRequest:
        """Noise analysis requested by these options."""
        return FrequencyResponseRequest(**self.model_dump(exclude={"model"}))

    @property
    def simulation(self) -> Simulation:
        """Simulation to compute: none, or one driven by the recorded voltage or base motion."""
        return _SIMULATIONS[self.model]
