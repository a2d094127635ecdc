"""All kinds of excitation, told apart by the word ``kind`` in a file."""

from typing import Annotated, TypeAlias

from pydantic import Field

from .dwell import Dwell
from .held_dwell import HeldDwell
from .held_sweep import HeldSweep
from .multisine_noise import MultisineNoise
from .odd_multisine import OddMultisine
from .plan import AbstractExcitation
from .resonance_tracking import ResonanceTracking
from .settled_sine import SettledSine
from .sine_sweep import SineSweep
from .stepped_level import SteppedLevel
from .stepped_sine import SteppedSine
from .streamed_noise import StreamedNoise

Excitation: TypeAlias = Annotated[
    MultisineNoise
    | StreamedNoise
    | SineSweep
    | Dwell
    | SteppedSine
    | SteppedLevel
    | OddMultisine
    | SettledSine
    | HeldSweep
    | HeldDwell
    | ResonanceTracking,
    Field(discriminator="kind"),
]

_PLANS: tuple[type[AbstractExcitation], ...] = (
    MultisineNoise,
    StreamedNoise,
    SineSweep,
    Dwell,
    SteppedSine,
    SteppedLevel,
    OddMultisine,
    SettledSine,
    HeldSweep,
    HeldDwell,
    ResonanceTracking,
)
KINDS = frozenset(str(plan.model_fields["kind"].default) for plan in _PLANS)
"""The words that a file may give as ``kind``."""
