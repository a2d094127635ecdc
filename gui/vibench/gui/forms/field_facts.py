"""What a form says of a field, taken from the plan model: label, unit, limits, explanation."""

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
"""Endings of names, longest first, and the unit they stand for."""


@dataclass(frozen=True)
class FieldFacts:
    """A field as a person sees it."""

    name: str
    label: str
    unit: str
    """SI, or a plain one."""
    allowed: str
    """``"above 0, at most 60 s"``; empty when anything goes."""
    explanation: str
    examples: tuple[str, ...] = ()
    """Texts to choose from; another one may be typed."""

    @property
    def shown_unit(self) -> str:
        """That of a plain number in the field."""
        return UNITS.in_field(self.unit)

    @property
    def limits(self) -> str:
        """What is allowed, in the units that people chose."""
        return UNITS.told(self.allowed)

    @property
    def tooltip(self) -> str:
        """Explanation and limits."""
        limits = f"Allowed: {self.limits}" if self.limits else ""
        return "\n".join(part for part in (UNITS.told(self.explanation), limits) if part)

    @property
    def named(self) -> str:
        """Label and unit, as a complaint begins."""
        return f"{self.label} ({self.shown_unit})" if self.unit else self.label

    @property
    def spoken(self) -> str:
        """Name for screen readers."""
        return f"{self.label} in {self.shown_unit}" if self.unit else self.label


def field_facts(model: type[BaseModel], name: str, field: FieldInfo) -> FieldFacts:
    """Return what a form must know of a field."""
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
    """Say each bound with its unit where that may be chosen, and otherwise once."""
    each = f" {unit}" if unit in CHOICES else ""
    said = ", ".join(_limit_texts(field, each))
    return said if each or not said else f"{said} {unit}".strip()


def _limit_texts(field: FieldInfo, unit: str) -> Iterator[str]:
    constraints = (*field.metadata, *_inner(field.annotation))
    # Lower bounds before upper ones.
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
    """Constraints of what a tuple holds, or of what an optional value is."""
    for part in get_args(annotation):
        yield from getattr(part, "__metadata__", ())
        yield from _inner(part)
