"""Scalar HDF5 attributes that old readers understand: numbers, and UTF-8 text of fixed length."""

from collections.abc import Mapping

import h5py
import numpy as np

from ..errors import RecordingError
from ._fixed_text import decoded, encoded

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


def read_attributes(target: h5py.HLObject) -> dict[str, Attribute]:
    """Every scalar number and text attached to an object, text as ``str``."""
    values: dict[str, Attribute] = {}
    for name in target.attrs:
        if target.attrs.get_id(name).shape != ():
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
    """Text of a scalar dataset."""
    return decoded(group[name][()])


def _write_text(target: h5py.HLObject, name: str, text: str) -> None:
    raw = encoded(text, len(text.encode()))
    if len(raw) > ATTRIBUTE_BYTES:
        raise RecordingError(
            f"The text of {name!r} has {len(raw)} bytes; an HDF5 attribute holds at most {ATTRIBUTE_BYTES}."
            " Nothing was written; shorten it."
        )
    dtype = h5py.string_dtype("utf-8", max(len(raw), 1))
    target.attrs.create(name, np.array(raw, dtype=dtype), dtype=dtype)
