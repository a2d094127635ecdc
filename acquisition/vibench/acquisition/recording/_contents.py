"""Models that validate attributes and texts of a recording when it is opened."""

import json
import math
from collections.abc import Mapping
from datetime import date, datetime
from typing import Annotated, Any, TypeVar

import h5py
from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, JsonValue, ValidationError

from ..errors import RecordingError
from ..instruments import Identity
from ._header import ROLE_PATTERN, UNPLANNED, ChannelHeader
from ._layout import (
    CONFIGURATION,
    ROLE_WIDTH,
    TEXT_WIDTH,
    Attribute,
    Origin,
    RecordingState,
    read_attributes,
    read_text_dataset,
)

DEEPEST_JSON = 40
"""Deepest nesting of JSON that is accepted; a plan has about five levels of nesting."""
SAME_SCALE = 1e-9
"""Allowed relative difference of ``scale_factor`` and ``add_offset`` from their recomputed values."""

Model = TypeVar("Model", bound=BaseModel)


def _iso_moment(text: str) -> str:
    datetime.fromisoformat(text)
    return text


def _iso_date(text: str) -> str:
    if text:
        date.fromisoformat(text)
    return text


def _names(text: str) -> str:
    for name in text.split():
        if len(name) > ROLE_WIDTH or not ROLE_PATTERN.fullmatch(name):
            raise ValueError(f"{name[:ROLE_WIDTH]!r} is not a channel name")
    return text


def _none_if_unknown(value: object) -> object:
    return None if isinstance(value, float) and math.isnan(value) else value


def _none_if_unplanned(value: object) -> object:
    return None if isinstance(value, int) and value == UNPLANNED else value


Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Unknown = BeforeValidator(_none_if_unknown)
"""Validator that turns NaN, which marks an unknown number in the file, into None."""
Rate = Annotated[float, Field(ge=1e-6, le=1e12)]
"""Sample rate, from one sample in two weeks to a terahertz [1/s]."""


class _AbstractFacts(BaseModel):
    """Attributes of one HDF5 object; unknown attributes (other programs, later versions) are ignored."""

    model_config = ConfigDict(frozen=True, strict=True, extra="ignore")


class FileFacts(_AbstractFacts):
    """Attributes of the recording's file."""

    sample_rate_hz: Rate
    requested_sample_rate_hz: Rate
    expected_samples: Annotated[Annotated[int, Field(ge=0)] | None, BeforeValidator(_none_if_unplanned)]
    origin: Annotated[Origin, Field(strict=False)]
    started_utc: Annotated[str, AfterValidator(_iso_moment)]
    recording_id: str
    roles: Annotated[str, AfterValidator(_names)]
    samples: Annotated[int, Field(ge=0)]
    state: Annotated[RecordingState, Field(strict=False)]
    reason: Annotated[str, Field(max_length=TEXT_WIDTH)]


class ChannelFacts(_AbstractFacts):
    """Attributes of a channel's dataset."""

    physical_channel: str
    quantity: str
    unit: str = Field(alias="units")
    physical_per_volt: Finite
    range_v: Positive
    volts_per_count: Annotated[Positive | None, Unknown]
    volts_at_zero_count: Finite
    physical_offset: Finite
    coupling: str
    iepe_current_a: Finite
    sensitivity: Annotated[Finite | None, Unknown]
    sensitivity_unit: str
    serial: str
    calibration_date: Annotated[str, AfterValidator(_iso_date)]
    delay_s: Annotated[float, Field(ge=-3600, le=3600)]
    long_name: str
    scale_factor: Finite
    add_offset: Finite


class ConfigurationFacts(_AbstractFacts):
    """Parsed texts of the group ``/configuration``."""

    model_config = ConfigDict(strict=False)

    plan: dict[str, JsonValue] = Field(alias="plan_json")
    bench: dict[str, JsonValue] = Field(alias="bench_json")
    instruments: dict[str, Identity] = Field(alias="instruments_json")
    confirmations: dict[str, str | float] = Field(alias="confirmations_json")
    provenance: dict[str, JsonValue] = Field(alias="provenance_json")
    bench_check: dict[str, JsonValue] = Field(default_factory=dict, alias="bench_check_json")
    """Result of the last bench check; empty for files of earlier versions, which contain no result."""


def file_facts(attributes: Mapping[str, Attribute], **found: object) -> FileFacts:
    """Return the file's validated attributes; ``found`` has those that a growing file keeps in datasets."""
    return _read("the file", FileFacts, {**attributes, **found})


def channel_header(role: str, dataset: h5py.Dataset) -> ChannelHeader:
    """Return the header of a channel, read from the attributes of its dataset.

    Raises RecordingError when an attribute is missing, has a wrong type or value, or contradicts another.
    """
    stated = dict(_read(f"the channel {role!r}", ChannelFacts, read_attributes(dataset)))
    scale = {name: stated.pop(name) for name in ("scale_factor", "add_offset")}
    header = ChannelHeader(role=role, **stated)
    for name, value in scale.items():
        follows = getattr(header, name)
        if not math.isclose(value, follows, rel_tol=SAME_SCALE):
            raise RecordingError(
                f"the channel {role!r} has {name} = {value:g}, but its other attributes give {follows:g}"
            )
    return header


def configuration_facts(file: h5py.File) -> ConfigurationFacts:
    """Return the parsed texts of ``/configuration``; raises RecordingError if one is not valid."""
    group = file[CONFIGURATION]
    texts = {name: _parse(name, read_text_dataset(group, name)) for name in group}
    return _read("the configuration", ConfigurationFacts, texts)


def json_object(text: str) -> dict[str, Any]:
    """Parse a JSON object; raises ValueError for other JSON, infinite numbers or too deep nesting."""
    try:
        value = json.loads(text, parse_constant=_refuse_constant, parse_float=_finite)
    except RecursionError as error:
        raise ValueError("its lists and objects are nested too deeply") from error
    if not isinstance(value, dict):
        raise ValueError(f"it is a JSON {type(value).__name__}; a JSON object is needed")  # noqa: TRY004
    if _is_deeper(value, DEEPEST_JSON):
        raise ValueError(f"its lists and objects are nested more than {DEEPEST_JSON} levels deep")
    return value


def _parse(name: str, text: str) -> dict[str, Any]:
    try:
        return json_object(text)
    except ValueError as error:
        raise RecordingError(f"{name} cannot be read: {error}") from error


def _refuse_constant(constant: str) -> float:
    raise ValueError(f"{constant} is not a JSON number")


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"the number {text} is too large")
    return value


def _is_deeper(value: object, levels: int) -> bool:
    match value:
        case dict():
            below: Any = value.values()
        case list():
            below = value
        case _:
            return False
    return levels == 0 or any(_is_deeper(each, levels - 1) for each in below)


def _read(what: str, model: type[Model], values: Mapping[str, object]) -> Model:
    try:
        return model.model_validate(dict(values))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        given = "" if first["type"] == "missing" else f"; it is {str(first['input'])[:80]!r}"
        raise RecordingError(f"{place} of {what}: {first['msg'].lower()}{given}") from error
