"""All kinds of excitation, selected by the key ``kind`` in a file."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from inspect import getdoc
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar, Union, get_args

from pydantic import BeforeValidator, Field

from ..errors import ConfigurationError
from ..instruments import PlugInKind, missing_package, plug_in, plug_in_names
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

_Ours: TypeAlias = (
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
    | HeldResponse
)
_LACKING: dict[str, str] = {}
"""Kinds of installed packages that cannot be loaded, each with the reason."""


def _of_packages() -> Iterator[type[AbstractExcitation]]:
    """Load the kinds that installed packages add; a broken package does not affect the others."""
    taken = {word for plan in get_args(_Ours) for word in _words(plan)}
    for name in plug_in_names(PlugInKind.EXCITATION):
        try:
            plan = plug_in(PlugInKind.EXCITATION, name)
        except ConfigurationError as error:
            _LACKING[name] = str(error)
            continue
        is_plan = isinstance(plan, type) and issubclass(plan, AbstractExcitation)
        if is_plan and name in _words(plan) and taken.isdisjoint(_words(plan)):
            taken.update(_words(plan))
            yield plan
        else:
            _LACKING[name] = f"{name!r} of vibench.excitations is {plan!r:.80}: no plan with that kind alone"


def _words(plan: type[AbstractExcitation]) -> tuple[str, ...]:
    kind = plan.model_fields.get("kind")
    words = () if kind is None else get_args(kind.annotation)
    return words if kind is not None and kind.default in words else ()


def _require_installed(given: Any) -> Any:
    """Refuse a kind whose package is missing or broken, with a sentence that names it."""
    word = given.get("kind") if isinstance(given, dict) else None
    if isinstance(word, str) and word not in EXCITATION_KINDS:
        reason = _LACKING.get(word) or missing_package(word)
        if reason is not None:
            raise ValueError(reason)
    return given


if TYPE_CHECKING:
    Excitation: TypeAlias = _Ours
else:
    Excitation = Annotated[
        Union[(_Ours, *_of_packages())],
        Field(discriminator="kind"),
        BeforeValidator(_require_installed),
    ]
Row = TypeVar("Row")
_GROUPS = {Family.STEPPED: "steps"}


@dataclass(frozen=True)
class ExcitationKind:
    """Names and texts of a kind of excitation."""

    plan: type[AbstractExcitation]

    @property
    def word(self) -> str:
        """The value of ``kind`` in a file."""
        return str(self.plan.model_fields["kind"].default)

    @property
    def label(self) -> str:
        """Name for people."""
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
        """The label with a capital letter, for the start of a sentence or a figure's title."""
        return self.label.capitalize()

    @property
    def is_feedback(self) -> bool:
        """Whether its next step depends on what was measured."""
        return issubclass(self.plan, AbstractFeedback)


EXCITATION_KINDS: Mapping[str, ExcitationKind] = {
    kind.word: kind for kind in map(ExcitationKind, get_args(get_args(Excitation)[0]))
}
"""One entry for each plan of the union; the union lists our plans so that types can be checked."""
_PRESENT_WORDS = {word: kind.word for kind in EXCITATION_KINDS.values() for word in _words(kind.plan)}


def present_word(word: str) -> str:
    """Return the present name of a kind of excitation for ``word``, a name of this or an earlier version; an
    unknown name is returned unchanged.
    """
    return _PRESENT_WORDS.get(word, word)


def rows_by_kind(
    of_family: Mapping[Family, Row], of_kind: Mapping[str, Row], of_packages: PlugInKind | None = None
) -> Mapping[str, Row]:
    """Return the row of every kind: its own if it has one, else its family's (decision 0062).

    Raises KeyError when a row is given for an unknown kind.

    Parameters
    ----------
    of_family
        Row of each family of excitations.
    of_kind
        Rows of single kinds, by name.
    of_packages
        Entry points by which installed packages give rows of the kinds that they add.
    """
    rows = {word: of_family[kind.plan.family] for word, kind in EXCITATION_KINDS.items()}
    for word, row in of_kind.items():
        rows[EXCITATION_KINDS[word].word] = row
    return MappingProxyType(rows) if of_packages is None else _RowsOfPackages(rows, of_packages)


class _RowsOfPackages(Mapping[str, Row]):
    """Rows by kind; those of packages are loaded on first use, because they may import higher layers."""

    def __init__(self, rows: Mapping[str, Row], group: PlugInKind) -> None:
        self._rows, self._group = rows, group

    def __getitem__(self, word: str) -> Row:
        row = self._rows[word]
        return plug_in(self._group, word) if word in plug_in_names(self._group) else row

    def __iter__(self) -> Iterator[str]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)


def excitation_text(excitation: Excitation) -> str:
    """Return the signal and its level in words."""
    return f"{EXCITATION_KINDS[excitation.kind].label}, {excitation.level_text}"
