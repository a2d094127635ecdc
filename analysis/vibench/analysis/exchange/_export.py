"""Export an excerpt of a recording to a file for other programs."""

import errno
import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from enum import Enum, StrEnum, auto
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibench.acquisition.recording import (
    ChannelHeader,
    Recording,
    RecordingDescription,
    ResultArray,
    SavedResult,
)
from vibench.sim.hdf5_files import open_hdf5_to_write
from vibench.sim.operating_system.this import rename

from ..errors import InvalidRequest, NotEnoughData
from ..recordings.facts import require_intact
from ..tables import Table, table, write_csv
from ._csv import write_csv_samples
from ._excerpt import BLOCK_SAMPLES, Excerpt, TransferObserver, facts_path, ignore_progress, write_facts
from ._mat import write_mat
from ._uff import UniversalFunction, write_uff, write_uff_functions
from ._wav import write_wav

ENTRY = "entry"
SIGNAL, TIME = "values", "time"


def write_nexus(excerpt: Excerpt, path: Path, observer: TransferObserver = ignore_progress) -> None:
    """Write channels one after the other in blocks; lost samples are NaN."""
    with open_hdf5_to_write(path, "x") as file:
        file.attrs.update({"NX_class": "NXroot", "default": ENTRY})
        entry = _group(file, ENTRY, "NXentry")
        entry["title"] = f"{excerpt.name}: {excerpt.recording.plan.get('name', '')}".removesuffix(": ")
        entry["start_time"] = excerpt.recording.started_utc
        entry["program_name"] = "vibench"
        # By default, plot the velocity of m0 if this channel was exported.
        entry.attrs["default"] = "m0_velocity" if "m0_velocity" in excerpt.roles else excerpt.roles[-1]
        for channel in excerpt.channels:
            _write_channel(entry, excerpt, channel, observer)


def _group(parent: h5py.Group, name: str, nexus_class: str) -> h5py.Group:
    group = parent.create_group(name)
    group.attrs["NX_class"] = nexus_class
    return group


def _write_channel(
    entry: h5py.Group, excerpt: Excerpt, channel: ChannelHeader, observer: TransferObserver
) -> None:
    data = _group(entry, channel.role, "NXdata")
    data.attrs.update({"signal": SIGNAL, "axes": [TIME], f"{TIME}_indices": 0})
    # The title also contains the unit, because silx does not label the vertical axis.
    data["title"] = f"{excerpt.name}: {channel.long_name or channel.role} [{channel.unit}]"
    chunks = (min(BLOCK_SAMPLES, excerpt.samples),)
    stored = {"shape": (excerpt.samples,), "dtype": "f8", "chunks": chunks, "compression": "gzip"}
    values, time = data.create_dataset(SIGNAL, **stored), data.create_dataset(TIME, **stored)
    label = f"{channel.long_name or channel.role} [{channel.unit}]"
    values.attrs.update({"units": channel.unit, "long_name": label})
    time.attrs.update({"units": "s", "long_name": "time [s]"})
    errors = data.create_dataset(f"{SIGNAL}_errors", **stored, fillvalue=0.5 * abs(channel.scale_factor))
    errors.attrs["units"] = channel.unit
    done = 0
    for block in excerpt.channel_blocks(channel.role):
        place = slice(done, done + block.size)
        values[place] = block
        time[place] = excerpt.recording.time_s(excerpt.start + done, excerpt.start + done + block.size)
        done += block.size
        observer(block.size)


UNFINISHED = ".unfinished"
_REFUSED = (errno.EACCES, errno.EPERM, errno.EROFS)


def require_unused(path: Path) -> None:
    """Raise InvalidRequest when the path exists, or its folder does not exist."""
    if path.exists():
        raise InvalidRequest(f"{path} exists, and nothing is ever overwritten; choose another name")
    if not path.parent.is_dir():
        raise InvalidRequest(
            f"{path.parent} is not a folder; create this folder, or choose another folder for {path.name}"
        )


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Yield the name of a temporary file; on success, rename the file to ``path``, otherwise delete it.

    Raises InvalidRequest when ``path`` or its temporary name exists, the folder does not exist, or writing
    fails.
    """
    unfinished = path.with_name(path.name + UNFINISHED)
    for each in (path, unfinished):
        require_unused(each)
    try:
        yield unfinished
        require_unused(path)  # another program may have created the file since
        rename(unfinished, path)
    except OSError as error:
        mend = "choose another folder" if error.errno in _REFUSED else "make room on the disk and try again"
        raise InvalidRequest(
            f"{path} could not be written: {error}; the incomplete file was deleted; {mend}"
        ) from error
    finally:
        with suppress(OSError):
            unfinished.unlink()


def require_results(recording: Recording) -> Mapping[str, SavedResult]:
    """Return the saved results of a recording; raises NotEnoughData when there are none."""
    found = recording.results
    if not found:
        raise NotEnoughData(
            f"{recording.path.name} contains no saved results (Recording.save_results writes them); "
            "leave --results out, or use the tables that vibench analyse writes"
        )
    return found


def result_paths(recording: Recording, path: Path) -> tuple[Path, ...]:
    """Return the files that :func:`write_result_tables` would write; raises InvalidRequest if one exists."""
    paths = tuple(path.with_name(f"{path.stem}.{each.name}.csv") for each in _tables(recording))
    for each in paths:
        require_unused(each)
    return paths


def write_result_tables(recording: Recording, path: Path) -> tuple[Path, ...]:
    """Write each result next to ``path``, in one file ``NAME.RESULT.AXIS.csv`` per set of axes."""
    paths = result_paths(recording, path)
    for each, content in zip(paths, _tables(recording), strict=True):
        with new_file(each) as unfinished:
            write_csv(content, unfinished)
    return paths


def matlab_results(recording: Recording) -> dict[str, Any]:
    """Return the results as nested structs, such as ``results.noise.transmission.values``."""
    return {
        _identifier(name): {
            "settings_json": json.dumps(dict(result.settings)),
            "saved_utc": result.saved_utc,
            "software_version": result.software_version,
            **{
                _identifier(key): {
                    "values": array.values,
                    "units": array.unit,
                    "axes": np.array(array.axes, dtype=object),
                }
                for key, array in result.arrays.items()
            },
        }
        for name, result in require_results(recording).items()
    }


def _identifier(name: str) -> str:
    """Return the name of a result as a valid MATLAB name: ``noise-2`` becomes ``noise_2``."""
    return "".join(each if each.isalnum() else "_" for each in name)


def _tables(recording: Recording) -> Iterator[Table]:
    for name, result in require_results(recording).items():
        sets = dict.fromkeys(each.axes for each in result.arrays.values() if each.axes)
        for axes in sets:
            yield _table(f"{name}.{'.'.join(axes)}", result.arrays, axes)


def _table(name: str, arrays: Mapping[str, ResultArray], axes: tuple[str, ...]) -> Table:
    """Return one table that contains all arrays with the given axes, one row per grid point."""
    grid = np.meshgrid(*(arrays[axis].values for axis in axes), indexing="ij")
    columns = {f"{axis} [{arrays[axis].unit}]": values for axis, values in zip(axes, grid, strict=True)}
    for key, array in arrays.items():
        if array.axes == axes:
            values = array.values
            parts = {"_real": values.real, "_imag": values.imag} if np.iscomplexobj(values) else {"": values}
            columns.update({f"{key}{part} [{array.unit}]": each for part, each in parts.items()})
    return table(name, **columns)


class Format(StrEnum):
    """Export formats; the value is also the file suffix."""

    CSV = "csv"
    """Text with units in the headings."""
    UFF = "uff"
    """Universal file, datasets 58: samples binary, spectra as text."""
    MAT = "mat"
    """MATLAB 5 with one struct per channel."""
    NEXUS = "nxs"
    """HDF5 in the NeXus standard, which silx and other programs plot with labels."""
    WAV = "wav"
    """Sound with 32 bits; full scale is 1."""


class Results(Enum):
    """Whether saved results are exported with the samples."""

    LEFT_OUT = auto()
    INCLUDED = auto()


def export_samples(
    excerpt: Excerpt,
    to: Format,
    path: Path,
    results: Results = Results.LEFT_OUT,
    observer: TransferObserver = ignore_progress,
) -> tuple[Path, ...]:
    """Write the excerpt to ``path``, and facts that the format cannot store to ``PATH.facts.json``.

    Results become structs in a MATLAB file; for other formats they are written to ``NAME.RESULT.AXIS.csv``.
    Returns the written files. Nothing is ever overwritten.

    Parameters
    ----------
    excerpt
        Channels and sample range, from `excerpt`.
    to
        Export format.
    path
        The new file.
    results
        Whether to export saved results too.
    observer
        Receives the number of values written since the last call.

    Raises
    ------
    InvalidRequest
        When a file name exists, writing fails, or the excerpt is too large for the format; no file is left.
    UnusableData
        When the recording was changed after it was sealed.
    NotEnoughData
        When results are requested but none is saved.
    """
    require_intact(excerpt.recording)
    return EXPORTERS[to].export(excerpt, path, results, observer)


def export_functions(
    excerpt: Excerpt, functions: Iterable[UniversalFunction], to: Format, path: Path
) -> tuple[Path, ...]:
    """Write frequency responses and spectra of an excerpt to ``path``, and its facts to a file next to it.

    Raises InvalidRequest when the format cannot store them, a file name exists, or writing fails; no file is
    left.

    Parameters
    ----------
    excerpt
        Excerpt from which the functions were estimated.
    functions
        Functions in the order of writing; computed only after the format and the path are checked.
    to
        Export format that can store functions.
    path
        The new file.
    """
    write = EXPORTERS[to].write_functions
    if write is None:
        able = " and ".join(each.value for each, row in EXPORTERS.items() if row.write_functions is not None)
        raise InvalidRequest(
            f"spectra were requested as {to.value}, which can only store samples; choose {able}, or use "
            "the tables that vibench analyse writes"
        )
    facts = facts_path(path)
    for each in (path, facts):
        require_unused(each)
    with new_file(path) as unfinished:
        write([(excerpt.recording, each) for each in functions], unfinished)
    with new_file(facts) as unfinished:
        write_facts(excerpt, unfinished)
    return path, facts


def export_scan(
    nodes: Mapping[int, tuple[float, float, float]],
    functions: Sequence[tuple[RecordingDescription, UniversalFunction]],
    path: Path,
) -> Path:
    """Write the nodes of a scan and their frequency responses to a universal file.

    Raises InvalidRequest when the file exists or writing fails; no file is left.

    Parameters
    ----------
    nodes
        Coordinates x, y and z [m], keyed by node number.
    functions
        Functions in the order of writing, each with its recording.
    path
        The new file.
    """
    with new_file(path) as unfinished:
        write_uff_functions(functions, unfinished, nodes)
    return path


WriteFunctions = Callable[[Sequence[tuple[RecordingDescription, UniversalFunction]], Path], None]
WriteSamples = Callable[[Excerpt, Path, TransferObserver], None]
WriteAll = Callable[[Excerpt, Path, Mapping[str, Any], TransferObserver], None]


@dataclass(frozen=True)
class Exporter:
    """Functions that export to one format; each exporter is an entry of `EXPORTERS`."""

    write: WriteSamples | None = None
    """Function that writes the samples; facts and results are written to separate files.

    It raises InvalidRequest for an excerpt that the format cannot store.
    """
    write_functions: WriteFunctions | None = None
    """Function that writes frequency responses and spectra; None if the format cannot store them."""
    write_all: WriteAll | None = None
    """Function that writes samples, facts and results into one file."""

    def export(
        self, excerpt: Excerpt, path: Path, results: Results, observer: TransferObserver
    ) -> tuple[Path, ...]:
        """Check that all file names are free, write the files, and return them."""
        recording, facts, written = excerpt.recording, facts_path(path), [path]
        are_included = results is Results.INCLUDED
        if self.write_all is not None:
            structs = matlab_results(recording) if are_included else {}
            with new_file(path) as unfinished:
                self.write_all(excerpt, unfinished, structs, observer)
        if self.write is not None:
            require_unused(facts)
            if are_included:
                result_paths(recording, path)
            with new_file(path) as unfinished:
                self.write(excerpt, unfinished, observer)
            with new_file(facts) as unfinished:
                write_facts(excerpt, unfinished)
            written += [facts, *(write_result_tables(recording, path) if are_included else ())]
        return tuple(written)


EXPORTERS: Mapping[Format, Exporter] = {
    Format.CSV: Exporter(write_csv_samples),
    Format.UFF: Exporter(write_uff, write_functions=write_uff_functions),
    Format.MAT: Exporter(write_all=write_mat),
    Format.NEXUS: Exporter(write_nexus),
    Format.WAV: Exporter(write_wav),
}
"""Exporters by format. A new format needs a writer module, a value in `Format`, and an entry here."""
