"""An excerpt of a recording becomes a file that other programs read."""

import errno
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from enum import Enum, StrEnum, auto
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np

from vibench.acquisition.recording import Recording, ResultArray, SavedResult
from vibench.sim.operating_system.this import rename

from ..errors import InvalidRequest, NotEnoughData
from ..recordings.facts import require_intact
from ..tables import Table, table, write_csv
from ._csv import write_csv_samples
from ._excerpt import Excerpt, TransferObserver, ignore_progress
from ._facts_document import facts_path, write_facts
from ._mat import require_small, write_mat
from ._nexus import write_nexus
from ._uff import UniversalFunction, write_uff, write_uff_functions
from ._wav import require_sound, write_wav

UNFINISHED = ".unfinished"
_REFUSED = (errno.EACCES, errno.EPERM, errno.EROFS)


def require_unused(path: Path) -> None:
    """InvalidRequest when a file has that name, or its folder does not exist."""
    if path.exists():
        raise InvalidRequest(f"{path} exists, and nothing is ever overwritten; choose another name")
    if not path.parent.is_dir():
        raise InvalidRequest(f"{path.parent} is no folder; make it, or choose another place for {path.name}")


@contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Give a name to write to; when all went well the file has ``path`` as its name, else it is gone.

    Raises InvalidRequest when ``path`` or its unfinished form exists, the folder does not, or the disk
    refuses.
    """
    unfinished = path.with_name(path.name + UNFINISHED)
    for each in (path, unfinished):
        require_unused(each)
    try:
        yield unfinished
        require_unused(path)  # another program may have been as busy
        rename(unfinished, path)
    except OSError as error:
        mend = "choose another folder" if error.errno in _REFUSED else "make room and try again"
        raise InvalidRequest(
            f"{path} could not be written: {error}; nothing was kept of it, so {mend}"
        ) from error
    finally:
        with suppress(OSError):
            unfinished.unlink()


def require_results(recording: Recording) -> Mapping[str, SavedResult]:
    """Return them; NotEnoughData when there are none."""
    found = recording.results
    if not found:
        raise NotEnoughData(
            f"no analysis has saved a result in {recording.path.name} (Recording.save_results does); "
            "leave --results out, or take the tables that vibench analyse writes"
        )
    return found


def result_paths(recording: Recording, path: Path) -> tuple[Path, ...]:
    """Names of the files that :func:`write_result_tables` makes; InvalidRequest when one is taken."""
    paths = tuple(path.with_name(f"{path.stem}.{each.name}.csv") for each in _tables(recording))
    for each in paths:
        require_unused(each)
    return paths


def write_result_tables(recording: Recording, path: Path) -> tuple[Path, ...]:
    """Write each result as ``NAME.RESULT.AXIS.csv`` beside ``path``, one for every set of axes."""
    paths = result_paths(recording, path)
    for each, content in zip(paths, _tables(recording), strict=True):
        with new_file(each) as unfinished:
            write_csv(content, unfinished)
    return paths


def matlab_results(recording: Recording) -> dict[str, Any]:
    """Return the results as nested structs: ``results.noise.transmission.values``."""
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
    """Make a MATLAB name of a result's: ``noise-2`` becomes ``noise_2``."""
    return "".join(each if each.isalnum() else "_" for each in name)


def _tables(recording: Recording) -> Iterator[Table]:
    for name, result in require_results(recording).items():
        sets = dict.fromkeys(each.axes for each in result.arrays.values() if each.axes)
        for axes in sets:
            yield _table(f"{name}.{'.'.join(axes)}", result.arrays, axes)


def _table(name: str, arrays: Mapping[str, ResultArray], axes: tuple[str, ...]) -> Table:
    """Lay everything over the same axes side by side: one row for each point of their grid."""
    grid = np.meshgrid(*(arrays[axis].values for axis in axes), indexing="ij")
    columns = {_heading(axis, arrays[axis].unit): values for axis, values in zip(axes, grid, strict=True)}
    for key, array in arrays.items():
        if array.axes == axes:
            columns.update(_columns(key, array))
    return table(name, **columns)


def _columns(key: str, array: ResultArray) -> Iterator[tuple[str, Any]]:
    if np.iscomplexobj(array.values):
        yield _heading(f"{key}_real", array.unit), array.values.real
        yield _heading(f"{key}_imag", array.unit), array.values.imag
    else:
        yield _heading(key, array.unit), array.values


def _heading(name: str, unit: str) -> str:
    return f"{name} [{unit}]"


class Format(StrEnum):
    """What an excerpt can become; the word is the file's suffix too."""

    CSV = "csv"
    """Text with units in its headings."""
    UFF = "uff"
    """Universal file, datasets 58: samples binary, spectra as text."""
    MAT = "mat"
    """MATLAB 5: a struct for each channel."""
    NEXUS = "nxs"
    """HDF5 after the NeXus standard: silx and others plot it with labels."""
    WAV = "wav"
    """Sound: 32 bits, full scale is 1."""


class Results(Enum):
    """Whether saved results go out with the samples."""

    LEFT_OUT = auto()
    INCLUDED = auto()


def export_samples(
    excerpt: Excerpt,
    to: Format,
    path: Path,
    results: Results = Results.LEFT_OUT,
    observer: TransferObserver = ignore_progress,
) -> tuple[Path, ...]:
    """Write the excerpt as ``path``, and what its format has no place for as ``PATH.facts.json`` beside it.

    Results become structs in a MATLAB file, and beside the others ``NAME.RESULT.AXIS.csv``. Gives the
    files that were written. Nothing is ever overwritten.

    Parameters
    ----------
    excerpt
        As `excerpt` gives it.
    to
        The format.
    path
        The new file.
    results
        Whether saved results go out too.
    observer
        Told how many values were written since it was last called.

    Raises
    ------
    InvalidRequest
        When a name is taken, the disk refuses, or the format cannot hold so much; nothing is left of it.
    UnusableData
        When the recording is not as it was sealed.
    NotEnoughData
        When results are asked for and none is saved.
    """
    require_intact(excerpt.recording)
    return EXPORTERS[to].export(excerpt, path, results, observer)


def export_functions(
    excerpt: Excerpt, functions: Sequence[UniversalFunction], to: Format, path: Path
) -> tuple[Path, ...]:
    """Write frequency responses and spectra of an excerpt as ``path``, and its facts beside it.

    Parameters
    ----------
    excerpt
        What they were estimated from.
    functions
        In the order in which they are to stand.
    to
        A format that has a place for them.
    path
        The new file.

    Raises
    ------
    InvalidRequest
        When the format has no place for them, a name is taken, or the disk refuses; nothing is left of it.
    """
    write = EXPORTERS[to].write_functions
    if write is None:
        able = " and ".join(each.value for each, row in EXPORTERS.items() if row.write_functions is not None)
        raise InvalidRequest(
            f"spectra were asked for as {to.value}, which is written for samples; ask for {able}, or take "
            "the tables that vibench analyse writes"
        )
    facts = facts_path(path)
    require_unused(facts)
    with new_file(path) as unfinished:
        write(excerpt, functions, unfinished)
    with new_file(facts) as unfinished:
        write_facts(excerpt, unfinished)
    return path, facts


WriteFunctions = Callable[[Excerpt, Sequence[UniversalFunction], Path], None]


class Exporter(Protocol):
    """A row of `EXPORTERS`: how an excerpt becomes files of one format."""

    @property
    def write_functions(self) -> WriteFunctions | None:
        """Writes frequency responses and spectra; None where the format has no place for them."""

    def export(
        self, excerpt: Excerpt, path: Path, results: Results, observer: TransferObserver
    ) -> tuple[Path, ...]:
        """Write the files; gives them. Nothing is left of what could not be written whole."""


def _accept(_excerpt: Excerpt) -> None:
    """Take an excerpt of any length."""


@dataclass(frozen=True)
class SamplesFile:
    """A format for samples alone: the facts go into a document beside it, results into tables."""

    write: Callable[[Excerpt, Path, TransferObserver], None]
    require: Callable[[Excerpt], None] = _accept
    """Raises InvalidRequest for what the format cannot hold."""
    write_functions: WriteFunctions | None = None

    def export(
        self, excerpt: Excerpt, path: Path, results: Results, observer: TransferObserver
    ) -> tuple[Path, ...]:
        """Write samples, facts and tables, once every name is known to be free."""
        recording, facts = excerpt.recording, facts_path(path)
        are_included = results is Results.INCLUDED
        require_unused(facts)
        self.require(excerpt)
        if are_included:
            result_paths(recording, path)
        with new_file(path) as unfinished:
            self.write(excerpt, unfinished, observer)
        with new_file(facts) as unfinished:
            write_facts(excerpt, unfinished)
        tables = write_result_tables(recording, path) if are_included else ()
        return path, facts, *tables


@dataclass(frozen=True)
class WholeFile:
    """A format with a place for facts and results too."""

    write: Callable[[Excerpt, Path, Mapping[str, Any], TransferObserver], None]
    require: Callable[[Excerpt], None] = _accept
    write_functions: WriteFunctions | None = None

    def export(
        self, excerpt: Excerpt, path: Path, results: Results, observer: TransferObserver
    ) -> tuple[Path, ...]:
        """Write everything into one file."""
        self.require(excerpt)
        structs = matlab_results(excerpt.recording) if results is Results.INCLUDED else {}
        with new_file(path) as unfinished:
            self.write(excerpt, unfinished, structs, observer)
        return (path,)


EXPORTERS: Mapping[Format, Exporter] = MappingProxyType(
    {
        Format.CSV: SamplesFile(write_csv_samples),
        Format.UFF: SamplesFile(write_uff, write_functions=write_uff_functions),
        Format.MAT: WholeFile(write_mat, require_small),
        Format.NEXUS: SamplesFile(write_nexus),
        Format.WAV: SamplesFile(write_wav, require_sound),
    }
)
"""How each format is written: a new one is a file with its writer, its word above, and its row here."""
