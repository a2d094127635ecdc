"""HDF5 attributes that every reader can show: numbers, UTF-8 text of fixed length, values as JSON text."""

import json
from collections.abc import Mapping
from typing import Any

import h5py
import numpy as np

from ..errors import RecordingError

ELLIPSIS = "…"


def encoded(text: str, width: int) -> bytes:
    """UTF-8 bytes of ``text``, at most ``width`` of them; what does not fit gives way to an ellipsis."""
    raw = text.replace("\0", "").encode("utf-8", "replace")
    if len(raw) <= width:
        return raw
    room = width - len(ELLIPSIS.encode())
    return (raw[:room].decode("utf-8", "ignore") + ELLIPSIS).encode()


def decoded(raw: bytes) -> str:
    """Text of a fixed-length field, without its padding."""
    return bytes(raw).rstrip(b"\0").decode("utf-8", "replace")


Attribute = str | int | float

ATTRIBUTE_BYTES = 60_000
"""HDF5 keeps an attribute in the object header, which ends at 64 KiB."""


def write_attributes(target: h5py.HLObject, values: Mapping[str, Attribute]) -> None:
    """Attach scalars to a file, group or dataset."""
    for name, value in values.items():
        if isinstance(value, str):
            _write_text(target, name, value)
        else:
            target.attrs[name] = value


READ_KINDS = "iufS"
"""Numbers and text of fixed length. HDF5 believes any length that a variable one claims, up to 16 GB."""


def read_attributes(target: h5py.HLObject) -> dict[str, Attribute]:
    """Every scalar number and text attached to an object, text as ``str``."""
    values: dict[str, Attribute] = {}
    for name in target.attrs:
        found = target.attrs.get_id(name)
        if found.shape != () or found.dtype.kind not in READ_KINDS:
            continue
        value = target.attrs[name]
        values[name] = decoded(value) if isinstance(value, bytes) else np.asarray(value).item()
    return values


def write_text_dataset(group: h5py.Group, name: str, text: str) -> None:
    """Store text of any length as a scalar dataset (an attribute ends at 64 KiB)."""
    raw = encoded(text, len(text.encode()))
    dtype = h5py.string_dtype("utf-8", max(len(raw), 1))
    group.create_dataset(name, data=np.array(raw, dtype=dtype), dtype=dtype)


def read_text_dataset(group: h5py.Group, name: str) -> str:
    """Text of a scalar dataset; ValueError where something else stands."""
    dataset = group[name]
    if not isinstance(dataset, h5py.Dataset) or dataset.shape != () or dataset.dtype.kind != "S":
        raise ValueError(f"{group.name}/{name} is no text")
    return decoded(dataset[()])


def _write_text(target: h5py.HLObject, name: str, text: str) -> None:
    raw = encoded(text, len(text.encode()))
    if len(raw) > ATTRIBUTE_BYTES:
        raise RecordingError(
            f"The text of {name!r} has {len(raw)} bytes; an HDF5 attribute holds at most {ATTRIBUTE_BYTES}."
            " Nothing was written; shorten it."
        )
    dtype = h5py.string_dtype("utf-8", max(len(raw), 1))
    target.attrs.create(name, np.array(raw, dtype=dtype), dtype=dtype)


def json_text(what: str, values: Mapping[str, Any]) -> str:
    """Write a mapping as JSON; numbers and arrays of numpy become plain ones.

    Raises RecordingError when a value is nothing that JSON can hold; ``what`` names the mapping in the
    sentence.
    """
    try:
        return json.dumps(dict(values), allow_nan=False, default=_plain)
    except (TypeError, ValueError) as error:
        raise RecordingError(
            f"{what} cannot be kept as JSON: {error}. Give text, finite numbers, truth values, None,"
            " or lists and mappings of them."
        ) from error


def _plain(value: object) -> object:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"a {type(value).__name__} was given")
