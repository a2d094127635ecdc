"""What of the hidden motion is known at the moment, beside a running measurement."""

from dataclasses import dataclass
from enum import StrEnum
from typing import ClassVar

from ..signals.arrays import Reals
from ..tables import Labelled
from ._forecast import Forecast


class LiveState(StrEnum):
    """What of the hidden motion is known at the moment."""

    WAITING = "waiting"
    """Too little has been measured, or nothing moves enough to be told."""
    TRACKED = "tracked"
    LOST = "lost"
    """What is measured does not fit the specimen's numbers: nothing is shown as motion."""


@dataclass(frozen=True, eq=False)
class LiveMotion(Labelled):
    """The newest of the hidden motion."""

    OWN_UNITS: ClassVar = {"p": "m"}

    state: LiveState
    why: str
    """Where it is not tracked."""
    first: int
    """Number in the recording of the first sample of ``p``."""
    p: Reals
    """Relative displacement, NaN where it was not followed [m]."""
    forecast: Forecast | None
    """Under a sine only."""
    gaps_m: tuple[float, float]
    level: float
    """Of the last block; 1 when nothing but noise is left."""
    limit: float
    """Beyond which a block lies out; NaN while the usual level is being learnt."""
