"""Description of a specimen, in its own file or as a table in another file: parameters and their sources.

No parameter of a description has a default value. Instead a description may name another one (``model``, a
name or path) and state only the differences, as the specimen tables of rigs, studies and imports do.
"""

import math
import reprlib
import tomllib
import warnings
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    NonNegativeFloat,
    PositiveFloat,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    field_serializer,
    field_validator,
    model_validator,
)

from .contact_laws import Elasticity, hertz_stiffness, law_by_name
from .frozen_model import FrozenModel
from .specimen import Gaps, Specimen, Triple
from .toml_table import fault_in_words, toml_table

BASE = "model"
"""Key for the name or path of the specimen from which a table takes its missing values."""
FOLDER = "folder"
"""Key, in pydantic's validation context, for the folder to which paths in ``model`` are relative. Without a
folder only names of vibench's specimens are allowed, so that a recording cannot open other files."""
SOURCES = "sources"
SUFFIX = ".toml"
FORMAT, VERSION = "format_version", 1
"""Key for the format version of a file, and the supported version."""
DEEPEST = 5
"""Largest number of descriptions in a chain in which each names the next in ``model``."""
USUAL_SPECIMEN = "gong2025"
"""Default specimen of rigs, studies and commands."""
ALTERNATIVES = (("single_frequencies_hz", "stiffnesses_n_per_m"), ("damping_time_s", "dampings_ns_per_m"))
"""Pairs of alternative keys; a specimen has exactly one key of each pair."""
_ANY_GAP_M = 1e-5
"""Arbitrary gap, used only to check whether a contact law is known."""
PositiveTriple = tuple[PositiveFloat, PositiveFloat, PositiveFloat]
NonNegativeTriple = tuple[NonNegativeFloat, NonNegativeFloat, NonNegativeFloat]


class UnknownSpecimenError(ValueError):
    """Error: a specimen name is unknown, or a file does not describe a specimen."""


class SpecimenWarning(UserWarning):
    """Warning: a replaced value also changed stiffnesses or dampings, which are computed from this value."""


class _DescribedModel(FrozenModel):
    model_config = ConfigDict(ser_json_inf_nan="strings")


class Material(_DescribedModel):
    """Elastic constants of a body."""

    youngs_modulus_pa: PositiveFloat
    """Young's modulus E [Pa]."""
    poissons_ratio: Annotated[float, Field(gt=-1.0, le=0.5)]
    """Poisson's ratio: lateral over axial strain."""

    @property
    def elasticity(self) -> Elasticity:
        """Elastic constants as `Elasticity`."""
        return Elasticity(self.youngs_modulus_pa, self.poissons_ratio)


class SphereOnPlane(_DescribedModel):
    """Sphere on a plane: k = 4/3 E* sqrt(R), Johnson, Contact Mechanics (1985), eq. 4.23."""

    radius_m: PositiveFloat
    """Radius of the sphere at the contact point [m]."""
    sphere: Material
    plane: Material

    @property
    def stiffness(self) -> float:
        """Hertz stiffness k of F = k d^(3/2) [N/m^1.5]."""
        return hertz_stiffness(self.sphere.elasticity, self.plane.elasticity, self.radius_m)


def _require_law(word: str) -> str:
    law_by_name(word, 1.0, _ANY_GAP_M)
    return word


ContactWord = Annotated[str, AfterValidator(_require_law)]
"""Name of a contact law from `CONTACT_LAWS` with its numbers: ``hertz``, ``rigid:0.8``, ``power:3+5+7``."""


def _infinity(value: object) -> object:
    """Convert the word for an infinite gap to infinity, because JSON has no infinite numbers."""
    return math.inf if value in ("inf", "Infinity") else value


Gap = Annotated[float, Field(gt=0.0, allow_inf_nan=True), BeforeValidator(_infinity)]
DampingTime = Annotated[float, Field(ge=0.0, le=1.0)]
"""Damping over stiffness [s]. The maximum is 300 times critical damping in the paper's first mode; with much
larger values, runs take minutes or overflow."""


class SpecimenDescription(_DescribedModel):
    """Three masses in a chain, base - m0 - m2 - m1, with stops for m1 on m2 (Gong et al. 2025, eq. 1).

    Other numbers of masses, stops between other masses, hardening springs, friction and several pairs of
    stops are not supported.
    """

    name: Annotated[str, Field(min_length=1, max_length=60)]
    """Name of the specimen in results."""
    about: str = ""
    """Description in one line."""
    masses_kg: PositiveTriple
    """Masses m0, m1, m2 [kg]."""
    single_frequencies_hz: PositiveTriple | None = None
    """Frequency f_i of each mass on its spring alone, k_i = m_i (2 pi f_i)^2; alternative to stiffnesses."""
    stiffnesses_n_per_m: PositiveTriple | None = None
    """Stiffnesses k0 (base to m0), k1 (m2 to m1), k2 (m0 to m2) [N/m]."""
    damping_time_s: DampingTime | None = None
    """Damping over stiffness, c_i / k_i [s]; alternative to the dampings."""
    dampings_ns_per_m: NonNegativeTriple | None = None
    """Damping coefficients c0, c1, c2, parallel to k0, k1, k2 [N s/m]."""
    gap_m: Gap | tuple[Gap, Gap]
    """Clearance between m1 and each stop at rest, or (lower, upper) at negative and positive p = y - z [m];
    infinite for a side without a stop."""
    contact: ContactWord
    """Contact law: hertz, linear (no stops), linear_gap, hunt_crossley:0.1, rigid:0.8, power:5, ..."""
    hertz_stiffness: PositiveFloat | SphereOnPlane
    """Hertz stiffness k of a stop [N/m^1.5], or the two bodies; other laws are fitted to this contact."""
    sources: dict[str, str] = Field(default={})
    """Source of each parameter, by its key."""
    _meant: ClassVar[Mapping[str, str]] = {}
    """Keys and values that a table has by default."""

    def __hash__(self) -> int:
        # Hash the JSON text, which contains all fields: the dict of sources cannot be hashed.
        return hash(self.model_dump_json())

    @model_validator(mode="before")
    @classmethod
    def _from_its_base(cls, value: object, info: ValidationInfo) -> object:
        """Complete a table with values of the specimen that the table names; plain text counts as a name."""
        folder: Path | None = (info.context or {}).get(FOLDER)
        match value:
            case str():
                return _complete({BASE: value}, folder)
            case Mapping():
                return _complete({**cls._meant, **value}, folder)
            case _:
                return value

    @field_validator("gap_m", mode="wrap")
    @classmethod
    def _one_clearance_or_two(cls, value: object, handler: ValidatorFunctionWrapHandler) -> object:
        try:
            return handler(value)
        except ValidationError as error:
            raise ValueError("it must be a number above 0 [m], or [lower, upper]") from error

    @field_validator("hertz_stiffness", mode="wrap")
    @classmethod
    def _number_or_bodies(cls, value: object, handler: ValidatorFunctionWrapHandler) -> object:
        """Report what is wrong with the two bodies of a contact, instead of pydantic's "not a number"."""
        try:
            return handler(value)
        except ValidationError as error:
            fault = max(error.errors(), key=lambda each: len(each["loc"]))
            within = ".".join(str(part) for part in fault["loc"][1:])
            message = f"{within} is missing" if fault["type"] == "missing" else fault_in_words(fault)
            raise ValueError(
                f"{within}: {message}" if within and within not in message else message
            ) from error

    @field_serializer("gap_m", when_used="json")
    def _without_infinity(self, gap_m: float | Gaps) -> float | list[float | str]:
        """Return the clearances, with words for infinite clearances, because JSON has no infinite numbers."""
        if isinstance(gap_m, float):
            return gap_m
        return [gap if math.isfinite(gap) else str(gap) for gap in gap_m]

    @model_validator(mode="after")
    def _alternatives_exclude(self) -> Self:
        for pair in ALTERNATIVES:
            keys = [key for key in pair if getattr(self, key) is not None]
            if len(keys) != 1:
                have = "both are" if keys else "neither is"
                raise ValueError(f"{' and '.join(pair)} are alternatives; {have} given; give one of them")
        unknown = sorted(self.sources.keys() - type(self).model_fields.keys())
        if unknown:
            raise ValueError(f"sources names {unknown[0]!r}, which is not a key of a specimen")
        try:
            with np.errstate(all="ignore"):
                moves = self.specimen().natural_frequencies_hz
        except ArithmeticError:
            moves = np.array([math.nan])
        if not bool(np.all(np.isfinite(moves))):
            raise ValueError("its masses and springs are too small, or too large, for computation")
        return self

    def specimen(
        self,
        contact: str | None = None,
        damping_time_s: float | None = None,
        gap_m: float | Gaps | None = None,
    ) -> Specimen:
        """Return the specimen; an argument replaces the value of this description.

        Raises ValueError when a number or the law is not allowed.

        Parameters
        ----------
        contact
            Name of a law from `CONTACT_LAWS`, with its numbers.
        damping_time_s
            Damping over stiffness, c_i = damping_time_s * k_i [s].
        gap_m
            Clearance at both stops [m], or (lower, upper). A power law is fitted at the smaller clearance.
        """
        gap = self.gap_m if gap_m is None else gap_m
        lower, upper = gap if isinstance(gap, tuple) else (None, gap)
        nearest = upper if lower is None else min(lower, upper)
        return Specimen(
            masses=self.masses_kg,
            stiffnesses=self.stiffnesses,
            dampings=self._dampings(damping_time_s),
            gap_m=upper,
            contact=law_by_name(self.contact if contact is None else contact, self.hertz_k, nearest),
            lower_gap_m=lower,
        )

    @property
    def stiffnesses(self) -> Triple:
        """Stiffnesses k0, k1, k2 [N/m]."""
        if self.stiffnesses_n_per_m is not None:
            return self.stiffnesses_n_per_m
        assert self.single_frequencies_hz is not None, "one of the two alternative keys is given"
        k0, k1, k2 = (
            m * (2.0 * math.pi * f) ** 2
            for m, f in zip(self.masses_kg, self.single_frequencies_hz, strict=True)
        )
        return k0, k1, k2

    @property
    def hertz_k(self) -> float:
        """Hertz stiffness k of F = k d^(3/2) at a stop [N/m^1.5]."""
        given = self.hertz_stiffness
        return given if isinstance(given, float) else given.stiffness

    def _dampings(self, damping_time_s: float | None) -> Triple:
        time_s = self.damping_time_s if damping_time_s is None else damping_time_s
        if time_s is None:
            assert self.dampings_ns_per_m is not None, "one of the two alternative keys is given"
            return self.dampings_ns_per_m
        if not 0.0 <= time_s < math.inf:
            raise ValueError(f"Damping time {time_s} s is not allowed: it must be zero or positive.")
        k0, k1, k2 = self.stiffnesses
        return time_s * k0, time_s * k1, time_s * k2


class SpecimenTable(SpecimenDescription):
    """Specimen table of a rig, study or import: the differences from ``model``, by default the paper's."""

    _meant = MappingProxyType({BASE: USUAL_SPECIMEN})


def usual_specimen() -> SpecimenTable:
    """Return the default specimen, the paper's."""
    return SpecimenTable.model_validate(USUAL_SPECIMEN)


def load_specimen(specimen: str | Path) -> SpecimenDescription:
    """Return the description of a specimen, from its name in vibench or the path of a TOML file.

    Raises UnknownSpecimenError when there is no such file, or the file does not describe a specimen.
    """
    try:
        return SpecimenDescription.model_validate(str(specimen), context={FOLDER: Path()})
    except ValidationError as error:
        raise UnknownSpecimenError(_complaint(str(specimen), error)) from error


def shipped_specimens() -> Mapping[str, SpecimenDescription]:
    """Return the specimens that come with vibench, by name."""
    return {name: SpecimenDescription.model_validate(name) for name in _shipped_texts()}


def _complete(table: dict[str, Any], folder: Path | None, depth: int = 0) -> dict[str, Any]:
    """Return a table completed with the values of the specimens named in ``model``, recursively."""
    if BASE not in table:
        return table
    if depth > DEEPEST:
        raise ValueError(f"{table[BASE]!r} is based on itself (perhaps through others); give another {BASE}")
    specimen = str(table.pop(BASE))
    known = _shipped_texts()
    if specimen in known:
        return _merge(_complete(tomllib.loads(known[specimen]), None, depth + 1), table)
    names, called = ", ".join(known), reprlib.repr(specimen)
    if folder is None:
        raise ValueError(f"no specimen that comes with vibench is called {called}; give one of {names}")
    path = folder / specimen
    try:
        is_there = path.exists()
    except OSError:  # a name that this system does not allow
        is_there = False
    if not is_there:
        raise ValueError(
            f"no specimen is called {called}, and there is no such file; give the path of a TOML file, "
            f"or one of {names}"
        )
    return _merge(_complete(_of_this_version(path), path.parent, depth + 1), table)


def _of_this_version(path: Path) -> dict[str, Any]:
    """Return the table of a file without the format version; refuse any version except `VERSION`."""
    table = toml_table(path)
    written = table.pop(FORMAT, VERSION)
    if isinstance(written, bool) or written != VERSION:
        raise ValueError(
            f"{path}: {FORMAT} = {reprlib.repr(written)} is not version {VERSION}, which this vibench reads; "
            "the file is from a later version of vibench: install that version"
        )
    return table


@cache
def _shipped_texts() -> Mapping[str, str]:
    """Return the TOML text of each specimen that comes with vibench, by name."""
    found = [each for each in (files("vibench.sim") / "specimens").iterdir() if each.name.endswith(SUFFIX)]
    return {
        each.name.removesuffix(SUFFIX): each.read_text("utf-8")
        for each in sorted(found, key=lambda each: each.name)
    }


def _merge(base: Mapping[str, Any], table: Mapping[str, Any]) -> dict[str, Any]:
    """Return ``base`` updated with ``table``, without `about` and the sources of replaced values."""
    replaced = {key for pair in ALTERNATIVES if table.keys() & pair for key in pair} | table.keys()
    replaced |= {"about"} if table else set()
    kept = {key: value for key, value in base.items() if key not in replaced}
    _warn_of_changes(base, {**kept, **table}, table)
    old, new = base.get(SOURCES, {}), table.get(SOURCES, {})
    if not (isinstance(old, Mapping) and isinstance(new, Mapping)):
        return {**kept, **table}
    return {**kept, **table, SOURCES: {**{key: old[key] for key in old if key not in replaced}, **new}}


def _warn_of_changes(base: Mapping[str, Any], made: Mapping[str, Any], table: Mapping[str, Any]) -> None:
    """Warn if stiffnesses or dampings changed only because they are computed from replaced values."""
    changed = {key: value for key, value in made.items() if key in _KEYS and key != SOURCES}
    try:
        before, now = (SpecimenDescription.model_validate(each).specimen() for each in (base, changed))
    except ValidationError:  # other code refuses invalid specimens
        return
    for name, (kept, direct) in zip(("stiffnesses", "dampings"), ALTERNATIVES, strict=True):
        old, new = getattr(before, name), getattr(now, name)
        if not (table.keys() & {kept, direct} or np.allclose(old, new, rtol=1e-4, atol=0.0)):
            warnings.warn(
                f"{made['name']}: {name} changed from {_join(old)} to {_join(new)}, because {kept} was "
                f"kept; give {direct} = {_join(old)} to keep them, or {kept} = {made[kept]} to confirm "
                "the change",
                SpecimenWarning,
                stacklevel=2,
            )


def _join(numbers: Triple) -> str:
    return f"[{', '.join(f'{each:.6g}' for each in numbers)}]"


def _complaint(specimen: str, error: ValidationError) -> str:
    """Return a description of the first fault: key, given value, and allowed values."""
    first = error.errors()[0]
    key = ".".join(str(part) for part in first["loc"] if isinstance(part, int) or part in _KEYS)
    message = fault_in_words(first)
    match first["type"]:
        case "missing":
            fault = f'{key} is missing; give it, or model = "{USUAL_SPECIMEN}" for all keys of that specimen'
        case "extra_forbidden":
            fault = f"{first['loc'][-1]} is not a key of a specimen; allowed are {', '.join(sorted(_KEYS))}"
        case _ if key:
            fault = f"{key} = {reprlib.repr(first['input'])}: {message}"
        case _:
            return message if specimen in message else f"{specimen}: {message}"
    return f"{specimen} describes no specimen: {fault}"


_KEYS = frozenset(SpecimenDescription.model_fields)
