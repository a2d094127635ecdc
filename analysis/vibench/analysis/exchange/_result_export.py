"""Results that analyses have saved in a recording, as tables and as MATLAB structs."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vibench.acquisition.recording import Recording, ResultArray, SavedResult

from ..errors import NotEnoughData
from ..tables import Table, table, write_csv
from ._new_file import new_file, require_unused


def require_results(recording: Recording) -> Mapping[str, SavedResult]:
    """Give them; NotEnoughData when there are none."""
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
    """Give the results as nested structs: ``results.noise.transmission.values``."""
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
