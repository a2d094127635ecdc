"""All kinds of excitation, told apart by the word ``kind`` in a file."""

from typing import Annotated, TypeAlias

from pydantic import Field

from ._dwell import Dwell
from ._held_dwell import HeldDwell
from ._held_sweep import HeldSweep
from ._multisine_noise import MultisineNoise
from ._odd_multisine import OddMultisine
from ._plan import AbstractExcitation
from ._resonance_tracking import ResonanceTracking
from ._settled_sine import SettledSine
from ._sine_sweep import SineSweep
from ._stepped_level import SteppedLevel
from ._stepped_sine import SteppedSine
from ._streamed_noise import StreamedNoise

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
