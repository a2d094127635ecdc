"""Names, shapes and version of the file format.

``docs/recording-format.md`` describes the format for users of h5py or MATLAB.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError

FORMAT = "vibench-recording"
FORMAT_VERSION = 1
"""Version of the format; incremented whenever an older reader would misunderstand the file."""

CONVENTIONS = "CF-1.11"
LIBVER = ("earliest", "v110")
"""HDF5 format versions: superblock 0, which all HDF5 readers since 1.8 understand, including MATLAB's."""

SUFFIX = ".h5"
PART_SUFFIX = ".part"
TMP_SUFFIX = ".tmp"

CHUNK_SAMPLES = 51_200
"""Number of samples in one compressed chunk: one second at the rig's usual rate, 200 kB."""
DEFLATE_LEVEL = 1
"""Compression level. A higher level makes files 4 % smaller, but writing takes a third longer."""

COUNT_DTYPE = "<i4"
COUNTER_DTYPE = "<i8"
MISSING_COUNT = -(2**31)
"""Count that marks a lost sample; it is CF's ``_FillValue``, so that other programs show NaN."""
LARGEST_COUNT = 2**31 - 1

N_VALID = "n_valid"
N_ROWS = "n_rows"
STATE = "state"
REASON = "reason"
TIME = "time"
ROW = "row"
CONFIGURATION = "configuration"
RESULTS = "results"
OVERVIEW = "overview"
VIEW = "view"
SEAL = "seal"
BIN = "bin"
SETTINGS = "settings"

ROLE_WIDTH = 64
STATE_WIDTH = 16
TEXT_WIDTH = 480
"""Largest size of an event's text or a reason [bytes]; longer texts are cut and end with an ellipsis."""
KIND_WIDTH = 32
NUMBERS_WIDTH = 512


class RecordingState(StrEnum):
    """State of a recording, or the way in which it ended."""

    RECORDING = "recording"
    COMPLETE = "complete"
    STOPPED = "stopped"
    FAILED = "failed"
    INTERRUPTED = "interrupted"


class Origin(StrEnum):
    """Whether the samples come from a real bench or from the virtual rig."""

    REAL = "real"
    SIMULATED = "simulated"


@dataclass(frozen=True, eq=False)
class Table:
    """A group of equally long columns; ``capacity`` rows are pre-allocated while recording."""

    name: str
    columns: Mapping[str, str]
    """Type of each column, a one-dimensional dataset of numbers or of fixed-length text, by its name."""
    capacity: int


EVENTS = Table(
    "events",
    {
        "sample": "<i8",
        "unix_time_s": "<f8",
        "kind": f"S{KIND_WIDTH}",
        "text": f"S{TEXT_WIDTH}",
    },
    capacity=4096,
)
SEGMENTS = Table(
    "segments",
    {
        "first_sample": "<i8",
        "last_sample": "<i8",
        "is_complete": "<i4",
        "label": f"S{ROLE_WIDTH}",
        "numbers_json": f"S{NUMBERS_WIDTH}",
    },
    capacity=4096,
)
OVERLOADS = Table(
    "overloads",
    {"channel": f"S{ROLE_WIDTH}", "first_sample": "<i8", "last_sample": "<i8"},
    capacity=8192,
)
GAPS = Table("gaps", {"first_sample": "<i8", "last_sample": "<i8"}, capacity=4096)
TABLES = (EVENTS, SEGMENTS, OVERLOADS, GAPS)

OPEN_SEGMENT = -1
"""``last_sample`` of a segment that has not ended yet; never in a finished file."""

RESERVED_NAMES = frozenset(
    {
        N_VALID,
        N_ROWS,
        STATE,
        REASON,
        TIME,
        ROW,
        CONFIGURATION,
        RESULTS,
        OVERVIEW,
        VIEW,
        SEAL,
        *(table.name for table in TABLES),
    }
)


def part_of(path: Path) -> Path:
    """Return ``NAME.h5.part``, the path of the file while it is being recorded."""
    return path.parent / (path.name + PART_SUFFIX)


def tmp_of(path: Path) -> Path:
    """Return ``NAME.h5.tmp``, the path of a compressed copy or ``.part`` while it is incomplete."""
    return path.parent / (path.name + TMP_SUFFIX)


def packing(items: int, chunk_items: int = CHUNK_SAMPLES) -> dict[str, Any]:
    """Return the settings with which h5py creates a compressed dataset of ``items``; empty without items."""
    if items == 0:
        return {}
    chunks = (min(chunk_items, items),)
    return {"chunks": chunks, "compression": "gzip", "compression_opts": DEFLATE_LEVEL, "shuffle": True}


ELLIPSIS = "…"


def encode(text: str, width: int) -> bytes:
    """Return at most ``width`` UTF-8 bytes of ``text``; a cut text ends with an ellipsis."""
    raw = text.replace("\0", "").encode("utf-8", "replace")
    if len(raw) <= width:
        return raw
    room = width - len(ELLIPSIS.encode())
    return (raw[:room].decode("utf-8", "ignore") + ELLIPSIS).encode()


def cell(column: str, value: str | float) -> NDArray[np.generic]:
    """Return a value as stored in a column of this type, shape (1,)."""
    dtype = np.dtype(column)
    return np.array([encode(value, dtype.itemsize) if isinstance(value, str) else value], dtype=dtype)


def decode(raw: bytes) -> str:
    """Return the text of a fixed-length field, without its padding."""
    return bytes(raw).rstrip(b"\0").decode("utf-8", "replace")


Attribute = str | int | float

ATTRIBUTE_BYTES = 60_000
"""Largest size of an attribute's text [bytes]; HDF5 limits an object's header to 64 KiB."""


def write_attributes(target: h5py.HLObject, values: Mapping[str, Attribute]) -> None:
    """Attach scalars as attributes to a file, group or dataset."""
    for name, value in values.items():
        if isinstance(value, str):
            raw = encode(value, len(value.encode()))
            if len(raw) > ATTRIBUTE_BYTES:
                raise RecordingError(
                    f"The text of {name!r} has {len(raw)} bytes; an HDF5 attribute holds at most "
                    f"{ATTRIBUTE_BYTES}. Nothing was written; shorten this text."
                )
            dtype = h5py.string_dtype("utf-8", max(len(raw), 1))
            target.attrs.create(name, np.array(raw, dtype=dtype), dtype=dtype)
        else:
            target.attrs[name] = value


READ_KINDS = "iufS"
"""Types that are read: numbers and fixed-length text; HDF5 does not check variable-length text."""


def read_attributes(target: h5py.HLObject) -> dict[str, Attribute]:
    """Return every scalar number and text attached to an object, text as ``str``."""
    values: dict[str, Attribute] = {}
    for name in target.attrs:
        found = target.attrs.get_id(name)
        if found.shape != () or found.dtype.kind not in READ_KINDS:
            continue
        value = target.attrs[name]
        values[name] = decode(value) if isinstance(value, bytes) else np.asarray(value).item()
    return values


def write_text_dataset(group: h5py.Group, name: str, text: str) -> None:
    """Store text of any length as a scalar dataset (attributes are limited to 64 KiB)."""
    raw = encode(text, len(text.encode()))
    dtype = h5py.string_dtype("utf-8", max(len(raw), 1))
    group.create_dataset(name, data=np.array(raw, dtype=dtype), dtype=dtype)


def read_text_dataset(group: h5py.Group, name: str) -> str:
    """Return the text of a scalar dataset; raises ValueError if it contains no text."""
    dataset = group[name]
    if not isinstance(dataset, h5py.Dataset) or dataset.shape != () or dataset.dtype.kind != "S":
        raise ValueError(f"{group.name}/{name} is not a text")
    return decode(dataset[()])


def json_text(what: str, values: Mapping[str, Any]) -> str:
    """Return a mapping as JSON text; numpy's numbers and arrays become plain numbers and lists.

    Raises RecordingError when JSON cannot represent a value; ``what`` names the mapping in the message.
    """
    try:
        return json.dumps(dict(values), allow_nan=False, default=_plain)
    except (TypeError, ValueError) as error:
        raise RecordingError(
            f"{what} cannot be stored as JSON: {error}. Give text, finite numbers, truth values, None,"
            " or lists and mappings of these."
        ) from error


def _plain(value: object) -> object:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"a {type(value).__name__} was given")
