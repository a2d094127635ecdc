"""Read HDF5 of any layout, including netCDF-4, MATLAB 7.3 and formats of instrument makers."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibench.acquisition.recording import Origin
from vibench.sim.hdf5_files import UnsafeHdf5, open_hdf5, system_error, walk

from ..errors import UnusableData
from ..signals import Reals
from ._source_channel import Read, Source, SourceChannel, exact_step, own_facts, scale_among, unit_among
from ._times import stated_times

FEWEST_SAMPLES = 2
TRUNCATED = re.compile(r"truncated file: eof = (\d+),.* stored_eof = (\d+)")
"""Error message of HDF5 for a truncated file."""
MOST_LETTERS = 1000
"""Maximum length of MATLAB texts that are read."""

Facts = tuple[tuple[str, Any], ...]


@contextmanager
def open_hdf5_source(path: Path) -> Iterator[Source]:
    """Open a file; channels are 1-D datasets, and rows or columns of 2-D datasets (``"/data#1"``, ...).

    CF's ``scale_factor``, ``add_offset`` and ``_FillValue`` are applied. Files that refer to data in other
    files (external links and storage, virtual datasets) are refused unless external data are allowed.

    Raises UnusableData when the file is not HDF5.
    """
    try:
        file = open_hdf5(path, locking=False)
    except UnsafeHdf5 as error:
        raise UnusableData(f"{path.name} was not read: {str(error)[:300]}") from error
    except OSError as error:
        if cut := TRUNCATED.search(str(error)):
            raise UnusableData(
                f"{path.name} is cut off: it has {cut[1]} of {cut[2]} bytes; copy or export it again"
            ) from error
        if reason := system_error(error):
            raise UnusableData(f"{path.name} could not be read ({reason}); check the disk") from error
        raise UnusableData(f"{path.name} is not an HDF5 file ({error}); copy or export it again") from error
    with file:
        yield Source(dict(_readers(file)), are_in_order=False)


def _readers(file: h5py.File) -> Iterator[tuple[SourceChannel, Read]]:
    known: dict[str, Facts] = {}
    items = [item for _, item in walk(file)]
    groups = [item for item in items if isinstance(item, h5py.Group)]
    elsewhere = [fact for group in groups for fact in _facts(group, known)]
    named = [(f"{group.name.rsplit('/')[-1]}_{n}", x) for group in groups for n, x in _facts(group, known)]
    for dataset in filter(_holds_samples, items):
        beside = _facts(dataset.parent, known)
        own = own_facts((*beside, *named), dataset.name.rsplit("/", 1)[-1])
        facts = (*dataset.attrs.items(), *own, *beside, *_facts_above(dataset.parent, known))
        times = stated_times(facts, elsewhere)
        axis = int(dataset.ndim == 2 and dataset.shape[0] < dataset.shape[1])
        rows = dataset.size // dataset.shape[axis]
        for row in range(rows):
            name = dataset.name if rows == 1 else f"{dataset.name}#{row + 1}"
            channel = _channel(dataset, name, dataset.shape[axis], row, own, beside)
            yield replace(channel, **times), partial(_read, file, dataset.name, axis, row)


def _read(file: h5py.File, name: str, axis: int, row: int, start: int, stop: int) -> Reals:
    """Read samples along an axis of a dataset; ``row`` is the index along the other axis of a 2-D dataset."""
    dataset = file[name]
    place: list[int | slice] = [row] * dataset.ndim
    place[axis] = slice(start, stop)
    raw = dataset[tuple(place)]
    values = np.asarray(raw, dtype=np.float64) * _number(dataset, "scale_factor", 1.0, row)
    values += _number(dataset, "add_offset", 0.0, row)
    for attribute in {"_FillValue", "missing_value"} & dataset.attrs.keys():
        values[raw == dataset.attrs[attribute]] = np.nan
    if dataset.chunks:
        # For samples of a chunk that was never written, HDF5 returns a fill value.
        length, corner = dataset.chunks[axis], [0] * dataset.ndim
        for corner[axis] in range(start - start % length, start + len(values), length):
            if dataset.id.get_chunk_info_by_coord(tuple(corner)).byte_offset is None:
                values[max(corner[axis] - start, 0) : corner[axis] + length - start] = np.nan
    return values


def _holds_samples(item: h5py.HLObject) -> bool:
    return (
        isinstance(item, h5py.Dataset)
        and item.dtype.kind in "iuf"
        and item.attrs.get("MATLAB_class") not in {b"char", b"logical"}
        and item.ndim in {1, 2}
        and min(item.shape) > 0
        and max(item.shape) >= FEWEST_SAMPLES
    )


def _channel(
    dataset: h5py.Dataset, name: str, samples: int, place: int, named: Facts, beside: Facts
) -> SourceChannel:
    own = (*dataset.attrs.items(), *named)
    step = exact_step(dataset.dtype) if _number(dataset, "add_offset", 0.0, place) == 0.0 else None
    scale = scale_among((*own, *beside), are_counts=step is not None)
    origin = str(dataset.file.attrs.get("origin", ""))
    return SourceChannel(
        name=name,
        samples=samples,
        label=name.rsplit("/", 1)[-1],
        unit=unit_among(own, place) or unit_among(beside, place),
        stated_scale="" if "scale_factor" in dataset.attrs else scale,
        step=None if step is None else step * abs(_number(dataset, "scale_factor", 1.0, place)),
        origin=Origin(origin) if origin in set(Origin) else None,
    )


def _facts(group: h5py.Group, known: dict[str, Facts]) -> Facts:
    """Return the attributes, texts and single values of an HDF5 group, with their names."""
    if group.name not in known:
        hard = [name for name in group if isinstance(group.get(name, getlink=True), h5py.HardLink)]
        items = [(name, group[name]) for name in hard]
        values = ((name, _value(one)) for name, one in items if isinstance(one, h5py.Dataset))
        known[group.name] = (*group.attrs.items(), *(each for each in values if each[1] is not None))
    return known[group.name]


def _facts_above(group: h5py.Group, known: dict[str, Facts]) -> Facts:
    """Return the facts of all groups above a group, the nearest group first."""
    if group.name == "/":
        return ()
    return (*_facts(group.parent, known), *_facts_above(group.parent, known))


def _value(dataset: h5py.Dataset) -> Any:
    """Return a single value, or MATLAB texts (stored as character codes, or as references to such codes)."""
    if dataset.size > MOST_LETTERS or dataset.size == 0:
        return None
    match dataset.attrs.get("MATLAB_class"):
        case b"char":
            rows = np.atleast_2d(dataset[()].T)
            return np.array(["".join(map(chr, row)).strip() for row in rows])
        case b"cell":
            cells = [_value(dataset.file[each]) for each in np.ravel(dataset[()]) if each]
            return np.array([str(np.ravel(each)[0]) for each in cells if each is not None])
    return dataset[()] if dataset.size == 1 else None


def _number(dataset: h5py.Dataset, name: str, otherwise: float, place: int) -> float:
    """Return an attribute as a number; of one number per row or column, take number ``place``."""
    numbers = np.ravel(dataset.attrs.get(name, otherwise))
    if numbers.size not in {1, min(dataset.shape)}:
        raise UnusableData(f"{dataset.name}: {name} has {numbers.size} numbers; export the file again")
    return float(numbers[place if numbers.size > 1 else 0])
