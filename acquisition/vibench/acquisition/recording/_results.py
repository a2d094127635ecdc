"""Results of an analysis, stored with their samples in the recording: ``/results/NAME/``."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from . import _layout as layout
from ._contents import json_object
from ._header import collect_provenance
from ._layout import json_text, read_attributes, read_text_dataset, write_attributes, write_text_dataset
from ._seal import SealKey, SealState, check_result, require_reachable, seal_result

REAL_SUFFIX, IMAG_SUFFIX = "_real", "_imag"
COMPLEX_PART = "complex_part"
"""Attribute that marks the real or imaginary part of a complex array; only h5py reads complex numbers."""
SETTINGS_JSON = "settings_json"
AXES = "axes_json"
"""Attribute of an array that names the axis array of each of its dimensions."""
RAW_SHA256 = "raw_sha256_"

Setting = Any
"""Any JSON value: a number, text or boolean, or a list or object of these."""


@dataclass(frozen=True)
class ResultArray:
    """One array of a result, with its unit and the names of its axes."""

    values: NDArray[Any]
    """Real or complex numbers, in an array of any shape."""
    unit: str = "1"
    axes: tuple[str, ...] = ()
    """Name of the axis array of each dimension (``("frequency",)``); empty if the array itself is an axis."""


@dataclass(frozen=True)
class SavedResult:
    """A result read from a recording."""

    name: str
    arrays: Mapping[str, ResultArray]
    settings: Mapping[str, Setting]
    saved_utc: str
    software_version: str
    software_commit: str
    raw_sha256: Mapping[str, str]
    """Checksum of each raw channel that was used."""


def write_result(
    file: h5py.File,
    name: str,
    arrays: Mapping[str, ResultArray],
    settings: Mapping[str, Setting],
    roles: Sequence[str],
    key: SealKey | None,
) -> str:
    """Add a sealed result and return its name. If the name exists, ``-2``, ``-3``, ... is appended."""
    _require_axes(name, arrays)
    results = file.require_group(layout.RESULTS)
    free_name = _free_name(results, name)
    group = results.create_group(free_name)
    provenance = collect_provenance()
    write_attributes(
        group,
        {
            "saved_utc": datetime.now(UTC).isoformat(timespec="seconds"),
            "software_version": provenance.packages.get("vibench", ""),
            "software_commit": provenance.commit,
            **{RAW_SHA256 + role: read_attributes(file[role])["sha256"] for role in roles},
        },
    )
    write_text_dataset(group, SETTINGS_JSON, json_text(f"The settings of result {name!r}", settings))
    scalars = {key: value for key, value in settings.items() if type(value) in {int, float, str}}
    write_attributes(group.create_group(layout.SETTINGS), scalars)
    _write_arrays(group, arrays)
    seal_result(group, key)
    return free_name


def result_groups(file: h5py.File) -> dict[str, h5py.Group]:
    """Return the group of every result, by name; raises RecordingError if an entry is not a group."""
    try:
        results = file.get(layout.RESULTS)
        found = {} if results is None else dict(results.items())
    except (OSError, RuntimeError, KeyError, AttributeError) as error:
        require_reachable(file, error)
        raise RecordingError(f"the results cannot be read ({error})") from error
    for name, group in found.items():
        if not isinstance(group, h5py.Group):
            raise RecordingError(f"the entry {name!r} of the results is not a result")
    return found


def read_results(file: h5py.File) -> dict[str, SavedResult]:
    """Return every result of a recording, by name.

    Raises RecordingError when a result was changed after sealing, or an entry of the group is not a result.
    """
    found = {}
    for name, group in result_groups(file).items():
        seal = check_result(group, None)
        if seal.state is SealState.DAMAGED:
            raise RecordingError(f"the result {name!r} is damaged ({seal.sentence})")
        attributes = read_attributes(group)
        found[name] = SavedResult(
            name=name,
            arrays=_read_arrays(group),
            settings=json_object(read_text_dataset(group, SETTINGS_JSON)),
            saved_utc=str(attributes["saved_utc"]),
            software_version=str(attributes["software_version"]),
            software_commit=str(attributes["software_commit"]),
            raw_sha256={
                key.removeprefix(RAW_SHA256): str(value)
                for key, value in attributes.items()
                if key.startswith(RAW_SHA256)
            },
        )
    return found


def _free_name(results: h5py.Group, name: str) -> str:
    if not name or "/" in name or name.startswith("."):
        raise RecordingError(
            f"A result cannot be called {name!r}: give a name without '/' that does not begin with a dot."
        )
    if name not in results:
        return name
    suffix = 2
    while f"{name}-{suffix}" in results:
        suffix += 1
    return f"{name}-{suffix}"


def _require_axes(name: str, arrays: Mapping[str, ResultArray]) -> None:
    for key, array in arrays.items():
        shape = np.shape(array.values)
        lengths = tuple(len(arrays[axis].values) if axis in arrays else -1 for axis in array.axes)
        if array.axes and lengths != shape:
            raise RecordingError(
                f"{key!r} of result {name!r} has shape {shape}, but its axes {array.axes} have lengths"
                f" {lengths} (-1: no such array). Nothing was saved; name one array of the right length"
                " per dimension."
            )


def _write_arrays(group: h5py.Group, arrays: Mapping[str, ResultArray]) -> None:
    axes = {axis for array in arrays.values() for axis in array.axes}
    for key in sorted(arrays, key=lambda each: each not in axes):
        array = arrays[key]
        for name, values, part in _real_parts(key, np.asarray(array.values)):
            dataset = group.create_dataset(name, data=values)
            axes_text = {AXES: json.dumps(array.axes)} if array.axes else {}
            write_attributes(dataset, {"units": array.unit, **part, **axes_text})
            if key in axes:
                dataset.make_scale(key)
            for dimension, axis in enumerate(array.axes):
                dataset.dims[dimension].attach_scale(group[axis])


def _real_parts(key: str, values: NDArray[Any]) -> list[tuple[str, NDArray[Any], dict[str, str]]]:
    """Split a complex array into two real arrays, which any program can read; booleans become integers."""
    if np.iscomplexobj(values):
        return [
            (key + REAL_SUFFIX, values.real, {COMPLEX_PART: "real"}),
            (key + IMAG_SUFFIX, values.imag, {COMPLEX_PART: "imag"}),
        ]
    return [(key, values.astype(np.int8) if values.dtype == np.bool_ else values, {})]


def _read_arrays(group: h5py.Group) -> dict[str, ResultArray]:
    arrays: dict[str, ResultArray] = {}
    for name in group:
        if name in {SETTINGS_JSON, layout.SETTINGS}:
            continue
        dataset = group[name]
        attributes = read_attributes(dataset)
        axes = _axes(group, name, attributes)
        unit = str(attributes["units"])
        match attributes.get(COMPLEX_PART):
            case "real":
                key = name.removesuffix(REAL_SUFFIX)
                values = dataset[()] + 1j * group[key + IMAG_SUFFIX][()]
                arrays[key] = ResultArray(values, unit, axes)
            case None:
                arrays[name] = ResultArray(dataset[()], unit, axes)
    return arrays


def _axes(group: h5py.Group, name: str, attributes: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of an array's axes; in files of earlier versions, names follow from the lengths."""
    if AXES in attributes:
        axes = tuple(json.loads(attributes[AXES]))
        if not all(isinstance(axis, str) for axis in axes):
            raise RecordingError(f"the axes of {name!r} are not names")
        return axes
    scales = [each for each in group if read_attributes(group[each]).get("CLASS") == "DIMENSION_SCALE"]
    if name in scales:
        return ()
    return tuple(
        next(each for each in scales if group[each].shape == (length,))
        for length in group[name].shape
        if any(group[each].shape == (length,) for each in scales)
    )
