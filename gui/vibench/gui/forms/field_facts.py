"""Label, unit, limits and explanation of a form field, taken from the plan model."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, get_args

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from vibench.acquisition import ChosenFrom
from vibench.analysis.prediction.field_docstrings import field_docstring

from ..widgets.units import CHOICES, UNITS

_ENDINGS = (
    ("_m_per_s2", "m/s²"),
    ("_m_per_s", "m/s"),
    ("_per_s", "1/s"),
    ("_vpp", "Vpp"),
    ("_pt", "pt"),
    ("_hz", "Hz"),
    ("_db", "dB"),
    ("_deg", "°"),
    ("_s", "s"),
    ("_m", "m"),
    ("_v", "V"),
    ("_a", "A"),
    ("_n", "N"),
)
"""Endings of field names, longest first, with their units."""


@dataclass(frozen=True)
class FieldFacts:
    """Description of a field for the form."""

    name: str
    label: str
    unit: str
    """Unit in the plan: an SI unit, or another one such as dB."""
    allowed: str
    """Allowed range, such as ``"above 0, at most 60 s"``; empty without limits."""
    explanation: str
    examples: tuple[str, ...] = ()
    """Suggested texts; the user may also type other texts."""

    @property
    def shown_unit(self) -> str:
        """Unit in which a number without a unit is read."""
        return UNITS.in_field(self.unit)

    @property
    def limits(self) -> str:
        """Allowed range of the field, in the chosen units."""
        return UNITS.convert(self.allowed)

    @property
    def tooltip(self) -> str:
        """Explanation of the field, followed by its limits."""
        limits = f"Allowed: {self.limits}" if self.limits else ""
        return "\n".join(part for part in (UNITS.convert(self.explanation), limits) if part)

    @property
    def label_with_unit(self) -> str:
        """Label with unit; error messages about the field begin with it."""
        return f"{self.label} ({self.shown_unit})" if self.unit else self.label

    @property
    def accessible_name(self) -> str:
        """Name of the field for screen readers."""
        return f"{self.label} in {self.shown_unit}" if self.unit else self.label


def field_facts(model: type[BaseModel], name: str, field: FieldInfo) -> FieldFacts:
    """Return the description of a model's field for the form."""
    suffix, unit = next(((s, u) for s, u in _ENDINGS if name.endswith(s)), ("", ""))
    words = name.removesuffix(suffix).replace("_", " ")
    return FieldFacts(
        name=name,
        label=words[:1].upper() + words[1:],
        unit=unit,
        allowed=_limits(field, unit),
        explanation=field_docstring(model, name),
        examples=tuple(
            each for mark in field.metadata if isinstance(mark, ChosenFrom) for each in mark.texts()
        ),
    )


def _limits(field: FieldInfo, unit: str) -> str:
    """Return the limits as text; a selectable unit follows each number, any other unit the last number."""
    each = f" {unit}" if unit in CHOICES else ""
    texts = ", ".join(_limit_texts(field, each))
    return texts if each or not texts else f"{texts} {unit}".strip()


def _limit_texts(field: FieldInfo, unit: str) -> Iterator[str]:
    constraints = (*field.metadata, *_inner(field.annotation))
    # State lower bounds before upper bounds.
    for constraint in sorted(constraints, key=lambda each: isinstance(each, (Le, Lt))):
        match constraint:
            case Ge(ge):
                yield f"at least {ge:g}{unit}"
            case Gt(gt):
                yield f"above {gt:g}{unit}"
            case Le(le):
                yield f"at most {le:g}{unit}"
            case Lt(lt):
                yield f"below {lt:g}{unit}"


def _inner(annotation: Any) -> Iterator[object]:
    """Yield the constraints on the elements of a tuple, or on an optional value."""
    for part in get_args(annotation):
        yield from getattr(part, "__metadata__", ())
        yield from _inner(part)
