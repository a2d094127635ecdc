"""The curves of one recording, and of what the model says of it, as a comparison shows them."""

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
"""Frequencies that lie within this are one [Hz]."""


def predicted_curves(name: str, found: ResponsePrediction) -> Iterator[Curve]:
    """Yield Responses I and II under sines."""
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


def sweep_traces(name: str, origin: CurveOrigin, found: SweptMotion) -> Iterator[Curve]:
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


class Model(StrEnum):
    """Whether the model is overlaid on measurements."""

    LEFT_OUT = "left out"
    UNDER_VOLTAGE = "under the recorded voltage"
    """Rig and specimen together, as an ensemble: holds in chaos too."""
    UNDER_BASE = "under the recorded base motion"
    """The specimen alone, once: for linear and coherent motion."""


_SIMULATIONS = {
    Model.LEFT_OUT: Simulation.LEFT_OUT,
    Model.UNDER_VOLTAGE: Simulation.UNDER_VOLTAGE,
    Model.UNDER_BASE: Simulation.UNDER_BASE,
}


class AnalysisOptions(FrozenModel):
    """What an analyst may choose; estimator to confidence concern noise only."""

    model: Model = Model.LEFT_OUT
    """The simulated specimen, with its rig under the recorded voltage (the twin) or alone under the recorded
    base motion; it takes seconds to minutes a recording."""
    estimator: Estimator = Estimator.DRIVE
    """drive is unbiased by noise on both channels; h1 by noise on the response, h2 on the base."""
    noise_ratio: float | None = Field(default=None, ge=0.0)
    """For hv alone: noise density of m0's velocity over that of the base's acceleration, in s²."""
    window: Window = Window.HANN
    """Taper of the segments of streamed noise."""
    resolution_hz: PositiveFloat | None = None
    """Width of a line of streamed noise; chosen if not given. At most one of resolution and averages."""
    averages: Annotated[float, Field(gt=1.0)] | None = None
    """Independent averages of streamed noise; chosen if not given."""
    overlap: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.5
    """Part that neighbouring segments share."""
    confidence: Annotated[float, Field(gt=0.0, lt=1.0)] = DEFAULT_CONFIDENCE
    """Probability that the bounds of a line hold the truth."""

    @model_validator(mode="after")
    def _is_allowed(self) -> Self:
        """Refuse here what the analysis would refuse later, in its own sentence."""
        self.request  # noqa: B018 - making it is the check
        return self

    @property
    def request(self) -> FrequencyResponseRequest:
        """The same for the analysis."""
        return FrequencyResponseRequest(**self.model_dump(exclude={"model"}))

    @property
    def simulation(self) -> Simulation:
        """What the model is moved by, if it is asked."""
        return _SIMULATIONS[self.model]
