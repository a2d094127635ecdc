"""How recordings are analysed for a comparison, as a form shows it and a file keeps it."""

from enum import StrEnum
from typing import Annotated, Self

from pydantic import Field, PositiveFloat, model_validator

from vibench.sim import FrozenModel

from ..frequency_response.request import FrequencyResponseRequest
from ..frequency_response.results import Estimator
from ..model.overlay import Simulation
from ..signals.confidence import DEFAULT_CONFIDENCE
from ..signals.window import Window


class Model(StrEnum):
    """Whether the model is laid over measurements."""

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
    """Width of a line of streamed noise; empty chooses it. At most one of resolution and averages."""
    averages: Annotated[float, Field(gt=1.0)] | None = None
    """Independent averages of streamed noise; empty chooses them."""
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
        return FrequencyResponseRequest(
            estimator=self.estimator,
            noise_ratio=self.noise_ratio,
            resolution_hz=self.resolution_hz,
            averages=self.averages,
            window=self.window,
            overlap=self.overlap,
            confidence=self.confidence,
        )

    @property
    def simulation(self) -> Simulation:
        """What the model is moved by, if it is asked."""
        return _SIMULATIONS[self.model]
