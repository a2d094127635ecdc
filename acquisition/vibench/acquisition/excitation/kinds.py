"""All kinds of excitation, selected by the key ``kind`` in a file."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from inspect import getdoc
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar, Union, get_args

from pydantic import BeforeValidator, Field

from ..errors import ConfigurationError
from ..instruments import PlugInKind, missing_package, plug_in, plug_in_names
from .dwell import Dwell, HeldDwell
from .noise import HeldNoise, OddMultisine, StreamedNoise, WhiteNoise
from .plan import AbstractExcitation, AbstractFeedback, Family
from .resonance_tracking import ResonanceTracking
from .sine_sweep import HeldSweep, SineSweep
from .stepped_sine import HeldResponse, SettledSine, SteppedLevel, SteppedSine

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
"""Reason why a kind from an installed package could not be loaded, keyed by the name of the kind."""


def _of_packages() -> Iterator[type[AbstractExcitation]]:
    """Yield the plan classes that installed packages add; list in `_LACKING` the kinds that fail to load."""
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
            _LACKING[name] = f"{name!r} of vibench.excitations is {plan!r:.80}, not the plan of that kind"


def _words(plan: type[AbstractExcitation]) -> tuple[str, ...]:
    kind = plan.model_fields.get("kind")
    words = () if kind is None else get_args(kind.annotation)
    return words if kind is not None and kind.default in words else ()


def _require_installed(given: Any) -> Any:
    """Return ``given`` unchanged; raise ValueError if the package of its kind is missing or broken."""
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
    """Names and descriptions of one kind of excitation, derived from its plan class."""

    plan: type[AbstractExcitation]

    @property
    def word(self) -> str:
        """Value of ``kind`` that selects this kind in a file."""
        return str(self.plan.model_fields["kind"].default)

    @property
    def label(self) -> str:
        """Name for display: ``word`` with spaces instead of underscores."""
        return self.word.replace("_", " ")

    @property
    def about(self) -> str:
        """One-line description of the kind's signal."""
        return getdoc(self.plan).splitlines()[0]  # type: ignore[union-attr] # each has a docstring

    @property
    def group(self) -> str:
        """Heading under which a list of kinds shows this kind."""
        return "feedback" if self.is_feedback else _GROUPS.get(self.plan.family, self.plan.family.value)

    @property
    def title(self) -> str:
        """Label with a capital letter, for the start of a sentence or the title of a figure."""
        return self.label.capitalize()

    @property
    def is_feedback(self) -> bool:
        """Whether the next step of the excitation depends on measured values."""
        return issubclass(self.plan, AbstractFeedback)


EXCITATION_KINDS: Mapping[str, ExcitationKind] = {
    kind.word: kind for kind in map(ExcitationKind, get_args(get_args(Excitation)[0]))
}
"""All kinds by name, one for each plan class in the union `Excitation`."""
_PRESENT_WORDS = {word: kind.word for kind in EXCITATION_KINDS.values() for word in _words(kind.plan)}


def present_word(word: str) -> str:
    """Return the present name of a kind, given its name ``word`` in this or an earlier version.
    An unknown name is returned unchanged.
    """
    return _PRESENT_WORDS.get(word, word)


def rows_by_kind(
    of_family: Mapping[Family, Row], of_kind: Mapping[str, Row], of_packages: PlugInKind | None = None
) -> Mapping[str, Row]:
    """Return a table entry (row) per kind: its row in ``of_kind`` if present, else the row of its family.

    ``of_packages`` is the group of entry points through which installed packages supply rows for the kinds
    that they add. See decision 0062. Raises KeyError when a row is given for an unknown kind.
    """
    rows = {word: of_family[kind.plan.family] for word, kind in EXCITATION_KINDS.items()}
    for word, row in of_kind.items():
        rows[EXCITATION_KINDS[word].word] = row
    return MappingProxyType(rows) if of_packages is None else _RowsOfPackages(rows, of_packages)


class _RowsOfPackages(Mapping[str, Row]):
    """Rows by kind. Rows from packages are loaded on first use, because they may import higher layers."""

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
    """Return a description of the signal and its level, for display."""
    return f"{EXCITATION_KINDS[excitation.kind].label}, {excitation.level_text}"
