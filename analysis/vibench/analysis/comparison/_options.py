"""How recordings are analysed for a comparison, as a form shows it and a file keeps it."""

from enum import StrEnum
from typing import Annotated, Self

from pydantic import Field, PositiveFloat, model_validator

from vibench.acquisition import FrozenModel

from ..frequency_response import Estimator, FrequencyResponseRequest
from ..model import Simulation
from ..signals import DEFAULT_CONFIDENCE, Window


class Model(StrEnum):
    """Whether the model is laid over measurements."""

    LEFT_OUT = "left out"
    LAID_OVER = "laid over"


class AnalysisOptions(FrozenModel):
    """What an analyst may choose; estimator to confidence concern noise only."""

    model: Model = Model.LEFT_OUT
    """The simulated specimen under the recorded base motion; it takes seconds to a minute a recording."""
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
        """Whether the model is asked."""
        return Simulation.LAID_OVER if self.model is Model.LAID_OVER else Simulation.LEFT_OUT
