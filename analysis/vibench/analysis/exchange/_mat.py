"""Write MATLAB 5 files with one struct per channel and a struct of facts.

Read MATLAB files: version 7.3 is HDF5; version 5, the default of ``save``, is read into memory.
"""

import json
import struct
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from scipy.io import loadmat, savemat, whosmat
from scipy.io.matlab import MatReadError

from vibench.acquisition.recording import ChannelHeader

from ..errors import InvalidRequest
from ..signals import Reals
from ._excerpt import Excerpt, TransferObserver, facts_document, ignore_progress
from ._hdf5_source import FEWEST_SAMPLES, open_hdf5_source
from ._source_channel import (
    MOST_CHANNELS,
    Source,
    SourceChannel,
    exact_step,
    own_facts,
    read_from,
    scale_among,
    unit_among,
)
from ._times import stated_times

# The elements of a MATLAB 5 file are checked before reading, because scipy crashes on wrong types. Layout:
# MathWorks, MAT-File Format, "Level 5 MAT-file format". After a 128-byte header, each element has a tag
# (type, number of bytes) and data padded to a multiple of eight bytes. Matrices and compressed data contain
# further elements.

HEAD_BYTES, TAG_BYTES = 128, 8
MATRIX, COMPRESSED = 14, 15
PLAIN = frozenset({*range(1, 8), 9, 12, 13, 16, 17, 18})
"""Type codes of numbers and text in MATLAB 5 files."""
SMALL_BYTES = 4
"""Largest element whose data may be stored in its tag [bytes]."""
DEEPEST = 30
"""Maximum depth of nested cells and structs."""


def require_whole(path: Path) -> None:
    """Raise ValueError for a file with inconsistent elements or unknown types."""
    content = memoryview(path.read_bytes())
    if len(content) < HEAD_BYTES:
        raise ValueError("it ends within its header")
    order = {b"IM": "<", b"MI": ">"}.get(bytes(content[HEAD_BYTES - 2 : HEAD_BYTES]))
    # Files of version 4 have no 128-byte header. They have few types, which scipy itself checks.
    if order is not None:
        _look(content[HEAD_BYTES:], order, 0)


def _look(content: memoryview, order: str, depth: int) -> None:
    """Check consecutive elements of a MATLAB 5 file, and the elements nested in them."""
    if depth > DEEPEST:
        raise ValueError(f"more than {DEEPEST} nested structs or cells")
    while len(content) >= TAG_BYTES:
        kind, size = struct.unpack(f"{order}II", content[:TAG_BYTES])
        if kind >> 16:  # small: four bytes for type and size, four bytes for data
            _require_plain(kind & 0xFFFF)
            if kind >> 16 > SMALL_BYTES:
                raise ValueError(f"a small element has {kind >> 16} bytes; at most four are allowed")
            content = content[TAG_BYTES:]
            continue
        data = content[TAG_BYTES : TAG_BYTES + size]
        if len(data) < size:
            raise ValueError(f"an element should have {size} bytes, but only {len(data)} are left")
        match kind:
            case _ if kind == MATRIX:
                _look(data, order, depth + 1)
            case _ if kind == COMPRESSED:
                unpacking = zlib.decompressobj()
                found = unpacking.decompress(data, LARGEST_BYTES)
                if unpacking.unconsumed_tail:
                    raise ValueError(f"a variable of more than {LARGEST_BYTES} bytes")
                _look(memoryview(found), order, depth + 1)
            case _:
                _require_plain(kind)
        padding = 0 if kind == COMPRESSED else -size % TAG_BYTES
        content = content[TAG_BYTES + size + padding :]


def _require_plain(kind: int) -> None:
    if kind not in PLAIN:
        raise ValueError(f"an element of the unknown type {kind}")


LARGEST_BYTES = 2**31
"""Largest MATLAB 5 file: sizes of variables have 31 bits, and many readers limit file sizes too."""
VALUE_BYTES = 8
LONGEST_NAME = 63
"""Longest name of a MATLAB variable; longer channel names are cut."""


def write_mat(
    excerpt: Excerpt, path: Path, results: Mapping[str, Any], observer: TransferObserver = ignore_progress
) -> None:
    """Write the variables one after the other, so that only one channel is in memory at a time.

    Raises InvalidRequest when the file would be larger than the format allows.
    """
    columns = len(excerpt.channels) + 1
    size = excerpt.samples * columns * VALUE_BYTES
    if size >= LARGEST_BYTES:
        longest_s = LARGEST_BYTES // (columns * VALUE_BYTES) / excerpt.recording.sample_rate_hz
        raise InvalidRequest(
            f"{excerpt.samples} samples of {len(excerpt.channels)} channels need {size / 2**30:.1f} GiB, but "
            f"a MATLAB 5 file has at most 2 GiB; export {longest_s:.0f} s or less, export fewer channels, or "
            f"read {excerpt.recording.path.name} in MATLAB with ncread"
        )
    with path.open("xb") as file:
        # Numbers and texts are stored unchanged, nested values as JSON for ``jsondecode``.
        facts = facts_document(excerpt)
        del facts["segments"]
        plain = {name: value for name, value in facts.items() if type(value) in {str, int, float}}
        nested = {f"{name}_json": json.dumps(value) for name, value in facts.items() if name not in plain}
        _save(file, {"recording": {**plain, **nested, "segments": _segments(excerpt)}})
        if results:
            _save(file, {"results": results})
        _save(file, {"time_s": excerpt.recording.time_s(excerpt.start, excerpt.stop)[:, np.newaxis]})
        for channel in excerpt.channels:
            values = _whole(excerpt, channel.role, observer)
            _save(file, {channel.role[:LONGEST_NAME]: _channel(channel, values)})


def _save(file: Any, variables: dict[str, Any]) -> None:
    savemat(file, variables, long_field_names=True, oned_as="column")


def _whole(excerpt: Excerpt, role: str, observer: TransferObserver) -> Reals:
    values = np.empty(excerpt.samples)
    done = 0
    for block in excerpt.channel_blocks(role):
        values[done : done + block.size] = block
        done += block.size
        observer(block.size)
    return values


def _channel(channel: ChannelHeader, values: Reals) -> dict[str, Any]:
    known = {name: value for name, value in asdict(channel).items() if value is not None}
    del known["unit"]
    return {
        "values": values,
        "units": channel.unit,
        "scale_factor": channel.scale_factor,
        "add_offset": channel.add_offset,
        **known,
    }


def _segments(excerpt: Excerpt) -> dict[str, Any]:
    """Return the excerpt's segments as columns; sample indices start at 1, as is usual in MATLAB."""
    touched = [
        each
        for each in excerpt.recording.segments
        if each.stop > max(excerpt.start, each.start) and each.start < excerpt.stop
    ]
    first = [max(each.start, excerpt.start) - excerpt.start + 1 for each in touched]
    last = [min(each.stop, excerpt.stop) - excerpt.start for each in touched]
    return {
        "label": np.array([each.label for each in touched], dtype=object),
        "first": np.array(first, dtype=float),
        "last": np.array(last, dtype=float),
        "is_complete": np.array([each.is_complete for each in touched], dtype=bool),
        "numbers_json": np.array([json.dumps(dict(each.numbers)) for each in touched], dtype=object),
    }


@contextmanager
def open_mat(path: Path) -> Iterator[Source]:
    """Open a MATLAB file; channels are named ``"name"``, ``"struct.field"`` or ``"name#2"``.

    Raises ValueError when the file is damaged.
    """
    if h5py.is_hdf5(path):
        with open_hdf5_source(path) as source:
            yield source
        return
    require_whole(path)
    try:
        names = [name for name, *_ in whosmat(path)]
        if len(set(names)) < len(names):
            raise ValueError("it has several variables of the same name")
        content = loadmat(path, simplify_cells=True)
    except (MatReadError, zlib.error) as error:  # neither error is a ValueError
        raise ValueError(str(error)) from error
    own = {name: value for name, value in content.items() if not name.startswith("__")}
    # In files exported by vibench, the sample rate is stored beside the channels.
    about = tuple(_part(own, "recording").items())
    numbers = _numbers(own, "", about, tuple(_all_facts(own)), tuple(_named_facts(own)))
    yield Source({channel: read_from(values) for channel, values in numbers})


def _all_facts(struct: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the values of a struct, and of all structs inside the struct, with their names."""
    for name, value in struct.items():
        yield from _all_facts(value) if isinstance(value, dict) else ((name, value),)


def _named_facts(struct: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the values in all structs inside a struct, named by struct and field, such as ``"v_unit"``."""
    for name, value in struct.items():
        if isinstance(value, dict):
            yield from (
                (f"{name}_{each}", one) for each, one in value.items() if np.size(one) <= MOST_CHANNELS
            )
            yield from _named_facts(value)


def _numbers(
    struct: Mapping[str, Any],
    prefix: str,
    around: tuple[tuple[str, Any], ...],
    elsewhere: tuple[tuple[str, Any], ...],
    named: tuple[tuple[str, Any], ...],
) -> Iterator[tuple[SourceChannel, Any]]:
    # Some programs store start and increment in a struct beside the values.
    axis, quantity = _part(struct, "x_values"), _part(struct, "quantity")
    labels = {"x_unit": _part(axis, "quantity").get("label", ""), "unit": quantity.get("label", "")}
    own = {**{name: label for name, label in labels.items() if label}, **struct, **axis}
    own |= _part(quantity, "unit_transformation")
    facts = (*((name, value) for name, value in own.items() if np.size(value) <= MOST_CHANNELS), *around)
    for name, value in struct.items():
        match value:
            case dict():
                yield from _numbers(value, f"{prefix}{name}.", facts, elsewhere, named)
            case np.ndarray() if value.dtype.kind in "iuf" and value.ndim in {1, 2}:
                if max(value.shape) < FEWEST_SAMPLES:
                    continue
                step = exact_step(value.dtype)
                known = own_facts((*facts, *named), name)
                times, said = stated_times((*known, *facts), elsewhere), (*known, *facts)
                scale = "" if "scale_factor" in struct else scale_among(said, are_counts=step is not None)
                for place, (channel, row) in enumerate(_channels(f"{prefix}{name}", value)):
                    unit = unit_among(known, place) or unit_among(own.items(), place)
                    yield replace(channel, unit=unit, step=step, stated_scale=scale, **times), row


def _part(struct: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return a struct inside a struct; empty if there is none."""
    part = struct.get(name)
    return part if isinstance(part, dict) else {}


def _channels(name: str, values: np.ndarray[Any, Any]) -> Iterator[tuple[SourceChannel, Any]]:
    """Yield a channel for each row of a matrix, or for each column if there are fewer columns than rows."""
    rows = np.atleast_2d(values) if values.ndim == 1 or values.shape[0] < values.shape[1] else values.T
    label = name.removesuffix(".values").rsplit(".", 1)[-1]
    for number, row in enumerate(rows, start=1):
        own = name if len(rows) == 1 else f"{name}#{number}"
        yield SourceChannel(own, row.size, label), np.asarray(row, dtype=np.float64)
