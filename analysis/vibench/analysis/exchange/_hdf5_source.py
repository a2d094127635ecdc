"""Read HDF5 of any layout, including netCDF-4, MATLAB 7.3 and formats of instrument makers."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibench.acquisition.recording import Origin
from vibench.sim.hdf5_files.door import UnsafeHdf5, open_hdf5, system_error, walk

from ..errors import UnusableData
from ..signals.arrays import Reals
from ._alignment import stated_rate_hz, stated_start_s
from ._source_channel import SourceChannel, scale_among, unit_among

FEWEST_SAMPLES = 2
TRUNCATED = re.compile(r"truncated file: eof = (\d+),.* stored_eof = (\d+)")
"""HDF5's message for a truncated file."""
EXACT_KINDS = {"i": 4, "u": 2}
"""Most bytes of signed and unsigned integers that a recording can store exactly."""


Facts = tuple[tuple[str, Any], ...]


@dataclass(frozen=True)
class _Place:
    """Location of a channel's numbers in the file."""

    path: str
    row: int | None
    """Row or column of a table; None for a dataset of one dimension."""
    has_time_first: bool = True


@dataclass(frozen=True, eq=False)
class Hdf5Source:
    """One-dimensional datasets, and the rows or columns of two-dimensional ones: ``"/data#1"``, from one.

    CF's ``scale_factor``, ``add_offset`` and ``_FillValue`` are applied. A file whose data lie in other files
    (external links and storage, virtual datasets) is refused unless external data are allowed.
    """

    file: h5py.File
    places: Mapping[SourceChannel, _Place]

    @property
    def channels(self) -> tuple[SourceChannel, ...]:
        """Channels in the order of their names."""
        return tuple(self.places)

    def read(self, channel: SourceChannel, start: int, stop: int) -> Reals:
        """Read the samples of a channel from ``start`` to ``stop``."""
        place = self.places[channel]
        dataset = self.file[place.path]
        match place:
            case _Place(row=None):
                raw = dataset[start:stop]
            case _Place(row=row, has_time_first=True):
                raw = dataset[start:stop, row]
            case _Place(row=row):
                raw = dataset[row, start:stop]
        values = np.asarray(raw, dtype=np.float64) * _number(dataset, "scale_factor", 1.0)
        values += _number(dataset, "add_offset", 0.0)
        for name in {"_FillValue", "missing_value"} & dataset.attrs.keys():
            values[raw == dataset.attrs[name]] = np.nan
        return values


@contextmanager
def open_hdf5_source(path: Path) -> Iterator[Hdf5Source]:
    """Open a file; raises UnusableData when it is not HDF5."""
    try:
        file = open_hdf5(path, locking=False)
    except UnsafeHdf5 as error:
        raise UnusableData(f"{path.name} was not read: {str(error)[:300]}") from error
    except OSError as error:
        if cut := TRUNCATED.search(str(error)):
            raise UnusableData(
                f"{path.name} announces {cut[2]} bytes, and {cut[1]} are there; copy or export it again"
            ) from error
        if reason := system_error(error):
            raise UnusableData(f"{path.name} could not be read ({reason}); check the disk") from error
        raise UnusableData(f"{path.name} is no HDF5 file ({error}); copy or export it again") from error
    with file:
        yield Hdf5Source(file, dict(_places(file)))


def _places(file: h5py.File) -> Iterator[tuple[SourceChannel, _Place]]:
    known: dict[str, Facts] = {}
    for dataset in (item for _, item in walk(file) if _holds_samples(item)):
        facts = (*dataset.attrs.items(), *_facts(dataset.parent, known))
        rate_hz, trouble = stated_rate_hz(facts)
        values = {"sample_rate_hz": rate_hz, "time_trouble": trouble, "start_s": stated_start_s(facts)}
        if dataset.ndim == 1:
            yield _channel(dataset, dataset.name, dataset.shape[0], 0, values), _Place(dataset.name, None)
            continue
        has_time_first = dataset.shape[0] >= dataset.shape[1]
        samples, rows = dataset.shape if has_time_first else dataset.shape[::-1]
        for row in range(rows):
            name = dataset.name if rows == 1 else f"{dataset.name}#{row + 1}"
            yield _channel(dataset, name, samples, row, values), _Place(dataset.name, row, has_time_first)


def _holds_samples(item: h5py.HLObject) -> bool:
    return (
        isinstance(item, h5py.Dataset)
        and item.dtype.kind in "iuf"
        and item.ndim in {1, 2}
        and min(item.shape) > 0
        and max(item.shape) >= FEWEST_SAMPLES
    )


def _channel(
    dataset: h5py.Dataset, name: str, samples: int, place: int, values: Mapping[str, Any]
) -> SourceChannel:
    scale = abs(_number(dataset, "scale_factor", 1.0))
    is_exact = dataset.dtype.itemsize <= EXACT_KINDS.get(dataset.dtype.kind, 0)
    is_exact = is_exact and _number(dataset, "add_offset", 0.0) == 0.0
    return SourceChannel(
        name=name,
        samples=samples,
        label=name.rsplit("/", 1)[-1],
        unit=unit_among(dataset.attrs.items(), place),
        stated_scale="" if "scale_factor" in dataset.attrs else scale_among(dataset.attrs.items()),
        step=scale if is_exact else None,
        origin=_origin(dataset.file),
        **values,
    )


def _origin(file: h5py.File) -> Origin | None:
    """Read the origin stated by a recording or by an export of one."""
    origin = str(file.attrs.get("origin", ""))
    return Origin(origin) if origin in set(Origin) else None


def _facts(group: h5py.Group, known: dict[str, Facts]) -> Facts:
    """Return named attributes and single values of a group and then of its parents."""
    if group.name not in known:
        hard = [name for name in group if isinstance(group.get(name, getlink=True), h5py.HardLink)]
        items = [(name, group[name]) for name in hard]
        single = [(name, one[()]) for name, one in items if isinstance(one, h5py.Dataset) and one.size == 1]
        around = () if group.name == "/" else _facts(group.parent, known)
        known[group.name] = (*group.attrs.items(), *single, *around)
    return known[group.name]


def _number(dataset: h5py.Dataset, name: str, otherwise: float) -> float:
    return float(np.ravel(dataset.attrs[name])[0]) if name in dataset.attrs else otherwise
