"""All kinds of excitation, told apart by the word ``kind`` in a file."""

from collections.abc import Mapping
from dataclasses import dataclass
from inspect import getdoc
from types import MappingProxyType
from typing import Annotated, TypeAlias, TypeVar, get_args

from pydantic import Field

from .branch_continuation import BranchContinuation
from .dwell import Dwell
from .held_dwell import HeldDwell
from .held_noise import HeldNoise
from .held_response import HeldResponse
from .held_sweep import HeldSweep
from .odd_multisine import OddMultisine
from .plan import AbstractExcitation, AbstractFeedback, Family
from .resonance_tracking import ResonanceTracking
from .settled_sine import SettledSine
from .sine_sweep import SineSweep
from .stepped_level import SteppedLevel
from .stepped_sine import SteppedSine
from .streamed_noise import StreamedNoise
from .white_noise import WhiteNoise

Excitation: TypeAlias = Annotated[
    WhiteNoise
    | StreamedNoise
    | SineSweep
    | Dwell
    | SteppedSine
    | SteppedLevel
    | OddMultisine
    | SettledSine
    | HeldSweep
    | HeldDwell
    | ResonanceTracking
    | HeldNoise
    | BranchContinuation
    | HeldResponse,
    Field(discriminator="kind"),
]
Row = TypeVar("Row")
_GROUPS = {Family.STEPPED: "steps"}


@dataclass(frozen=True)
class ExcitationKind:
    """What a kind of excitation is to whoever meets its word in a file."""

    plan: type[AbstractExcitation]

    @property
    def word(self) -> str:
        """What a file gives as ``kind``."""
        return str(self.plan.model_fields["kind"].default)

    @property
    def label(self) -> str:
        """What a person reads."""
        return self.word.replace("_", " ")

    @property
    def about(self) -> str:
        """One-line description of the signal."""
        return getdoc(self.plan).splitlines()[0]  # type: ignore[union-attr] # each has a docstring

    @property
    def group(self) -> str:
        """Heading in a list of kinds."""
        return "feedback" if self.is_feedback else _GROUPS.get(self.plan.family, self.plan.family.value)

    @property
    def title(self) -> str:
        """The label where a sentence or a figure begins with it."""
        return self.label.capitalize()

    @property
    def is_feedback(self) -> bool:
        """Whether its next step depends on what was measured."""
        return issubclass(self.plan, AbstractFeedback)


EXCITATION_KINDS: Mapping[str, ExcitationKind] = MappingProxyType(
    {kind.word: kind for kind in map(ExcitationKind, get_args(get_args(Excitation)[0]))}
)
"""A row for each plan of the union, which is written out for whoever checks types."""
_PRESENT_WORDS = {
    word: kind.word
    for kind in EXCITATION_KINDS.values()
    for word in get_args(kind.plan.model_fields["kind"].annotation)
}


def present_word(word: str) -> str:
    """Return the present name of a kind for a name in a file; an unknown name is returned unchanged.

    Parameters
    ----------
    word
        Name of a kind of excitation, of this version or of an earlier one.

    """
    return _PRESENT_WORDS.get(word, word)


def rows_by_kind(of_family: Mapping[Family, Row], of_kind: Mapping[str, Row]) -> Mapping[str, Row]:
    """Give every kind the row of its family, or its own where it has one.

    Parameters
    ----------
    of_family
        Row of each family of excitations.
    of_kind
        Rows of single kinds, by their words.

    Raises
    ------
    KeyError
        When a row is given for a word that is no kind.

    """
    rows = {word: of_family[kind.plan.family] for word, kind in EXCITATION_KINDS.items()}
    for word, row in of_kind.items():
        rows[EXCITATION_KINDS[word].word] = row
    return MappingProxyType(rows)


def excitation_text(excitation: Excitation) -> str:
    """Say in words what is played, and how strongly."""
    return f"{EXCITATION_KINDS[excitation.kind].label}, {excitation.level_text}"
