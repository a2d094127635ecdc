"""HDF5 files of branches, spectra and chains, with units and the request."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from vibench.sim.hdf5_files import UNREADABLE, open_hdf5, open_hdf5_to_write
from vibench.sim.study import software

from ..comparison import Curve
from ..errors import InvalidRequest
from ..exchange import new_file
from ..tables import unit_of
from ._branch_lines import BranchDiagram, BranchLine, LineEvent
from ._chain_computing import ChainAnswer
from ._requests import BranchRequest, ExponentSpectrum, SpectrumPoint

BRANCHES_FORMAT, SPECTRUM_FORMAT = "vibench branches", "vibench spectrum"
CHAIN_FORMAT = "vibench chain"
FORMAT_VERSION = 1
_OWN_UNITS = {
    "states": "m, m, m, m/s, m/s, m/s",
    "wave_numbers": "rad",
    "gaps": "Hz",
    "attenuation_db": "dB",
}
"""Units of datasets whose names have no unit suffix."""
_COLUMNS = (
    "frequency_hz amplitude_m response_i response_ii states multiplier_real multiplier_imaginary impacts "
    "error_estimate"
)
"""Columns of a branch; each column is an HDF5 dataset."""
_WIDTHS = {"response_i": 4, "response_ii": 4, "states": 6, "multiplier_real": 6, "multiplier_imaginary": 6}
"""How many numbers each row has, for columns with several numbers per row."""
_WORDS = "periods shape has_twin is_isolated origin begin end elapsed_s"
"""Fields of a branch that are stored as attributes."""
_EVENT_COLUMNS = ("frequency_hz", "amplitude_m", "index", "response_ii")
_CHAIN_COLUMNS = (
    "over_hz transmission largest_m impacts energy_j energy_error_j transmission_error transmission_change "
    "time_s motion_m impact_time_s impact_cell"
)
"""Results of a run of a chain; each result is a dataset."""
_RUN_WORDS = "cells frequency_hz observed_s exponent_per_s exponent_error_per_s outcome elapsed_s"
_LINEAR_COLUMNS = "wave_numbers bands_hz gaps linear_hz attenuation_db"
"""Results for the infinite chain without contact; each result is a dataset."""


def write_diagram(diagram: BranchDiagram, path: Path) -> Path:
    """Write branches to a new file, with a group for each branch.

    Raises InvalidRequest when the file exists or cannot be written.
    """
    with _new_file(path, BRANCHES_FORMAT, diagram.request.model_dump_json(), diagram.elapsed_s) as file:
        for number, line in enumerate(diagram.lines):
            group = file.create_group(f"branch_{number:03d}")
            _write(group, line, _WORDS, _COLUMNS)
            for name in ("is_stable", "is_unstable"):
                group.create_dataset(name, data=getattr(line, name).astype(np.int8))
            events = group.create_group("events")
            for name in _EVENT_COLUMNS:
                events.create_dataset(name, data=np.array([getattr(each, name) for each in line.events]))
            events.create_dataset(
                "kind", data=[each.kind for each in line.events], dtype=h5py.string_dtype("utf-8")
            )
    return path


def read_diagram(path: Path) -> BranchDiagram:
    """Read the branches that `write_diagram` or ``vibench branches`` wrote.

    Raises InvalidRequest when the file does not exist or contains no branches.
    """
    if not path.is_file():
        what = "is a folder" if path.is_dir() else "does not exist, or is not a file"
        raise InvalidRequest(f"{path} {what}; give a file that vibench branches wrote")
    try:
        with open_hdf5(path) as file:
            if (file.attrs["format"], file.attrs["format_version"]) != (BRANCHES_FORMAT, FORMAT_VERSION):
                raise ValueError("it contains no branches, or branches of another vibench version")
            request = BranchRequest.model_validate_json(str(file.attrs["request"]))
            lines = tuple(_read_line(file[name]) for name in sorted(file) if name.startswith("branch_"))
            return BranchDiagram(request, lines, float(file.attrs["elapsed_s"]))
    except (OSError, IndexError, *UNREADABLE) as error:
        why = str(error).splitlines()[0]
        raise InvalidRequest(
            f"{path} cannot be read as branches: {why}; give a file that vibench branches wrote"
        ) from error


def branch_curves(path: Path) -> tuple[Curve, ...]:
    """Read the curves of branches, to overlay them on recordings.

    Raises InvalidRequest when the file contains no branches along frequency.
    """
    found = read_diagram(path).curves()
    if not found:
        raise InvalidRequest(
            f"{path} contains no branches over frequency; compute them with --frequency START:STOP"
        )
    return found


def _read_line(group: h5py.Group) -> BranchLine:
    kept: dict[str, Any] = {name: np.asarray(group[name][()]) for name in _COLUMNS.split()}
    count = len(group["frequency_hz"])
    for name, values in kept.items():
        shape = (count, _WIDTHS[name]) if name in _WIDTHS else (count,)
        if values.dtype.kind not in "fi" or values.shape != shape or count == 0:
            raise ValueError(f"{group.name}/{name} has another shape or type than vibench wrote")
    for name in _WORDS.split():
        value = group.attrs[name]
        kept[name] = value.item() if isinstance(value, np.generic) else value
    if not isinstance(kept["periods"], int):
        raise TypeError(f"{group.name} does not state a whole number of periods")
    events = group["events"]
    rows = zip(events["kind"].asstr()[()], *(events[name][()] for name in _EVENT_COLUMNS), strict=True)
    kept["events"] = tuple(
        LineEvent(kind, float(f), float(a), int(index), float(size)) for kind, f, a, index, size in rows
    )
    return BranchLine(**{each.name: kept[each.name] for each in fields(BranchLine)})


def write_spectrum(found: ExponentSpectrum, path: Path) -> Path:
    """Write all exponents to a new file, with a dataset for each quantity.

    Raises InvalidRequest when the file exists or cannot be written.
    """
    with _new_file(path, SPECTRUM_FORMAT, found.request.model_dump_json(), found.elapsed_s) as file:
        for name, kind in ((each.name, each.type) for each in fields(SpectrumPoint)):
            if kind is str:
                words = [getattr(each, name) for each in found.points]
                file.create_dataset(name, data=words, dtype=h5py.string_dtype("utf-8"))
            else:
                _write_column(file, name, found.column(name))
    return path


def write_chain(found: ChainAnswer, path: Path) -> Path:
    """Write the infinite chain, and a group for each run, to a new file.

    Raises InvalidRequest when the file exists or cannot be written.
    """
    with _new_file(path, CHAIN_FORMAT, found.request.model_dump_json(), found.elapsed_s) as file:
        _write(file, found, "", _LINEAR_COLUMNS)
        for number, run in enumerate(found.runs):
            _write(file.create_group(f"run_{number:05d}"), run, _RUN_WORDS, _CHAIN_COLUMNS)
    return path


def _write(group: h5py.Group, source: object, words: str, columns: str) -> None:
    """Write fields of an object to HDF5: strings as attributes, arrays as datasets with their units."""
    for name in words.split():
        group.attrs[name] = getattr(source, name)
    for name in columns.split():
        _write_column(group, name, getattr(source, name))


def _write_column(group: h5py.Group, name: str, values: object) -> None:
    unit = _OWN_UNITS.get(name) or unit_of(name).replace("s-1", "1/s") or "1"
    group.create_dataset(name, data=np.asarray(values)).attrs["units"] = unit


@contextmanager
def _new_file(path: Path, kind: str, request: str, elapsed_s: float) -> Iterator[h5py.File]:
    """Create a new HDF5 file with the kind and request of its results; remove the file if writing fails."""
    with new_file(path) as unfinished, open_hdf5_to_write(unfinished, "x") as file:
        file.attrs["format"] = kind
        file.attrs["format_version"] = FORMAT_VERSION
        file.attrs["request"] = request
        file.attrs["software"] = software()
        file.attrs["elapsed_s"] = elapsed_s
        yield file
