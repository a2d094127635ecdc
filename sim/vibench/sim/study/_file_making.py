"""The file before its first point: everything known is written, and every place for an answer is there.

After this nothing but bytes at known places is written: HDF5 itself has closed the file, so that no crash
can catch it between two steps.
"""

import os
import shutil
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np

from . import _layout as layout
from ._axes import Axis
from ._columns import COLUMNS, COORDINATE, COORDINATES, Column
from ._disk import sync_file, sync_folder
from ._errors import StudyError
from ._study import Study

MAKING_SUFFIX = ".making"
HEAD_BYTES = 2_000_000
"""More than sessions, axes and attributes take together."""


def make_file(path: Path, study: Study) -> None:
    """Create a study's file, all points missing, or leave nothing.

    Raises
    ------
    StudyError
        When the name is taken, the folder does not exist, or the disk is too full.

    """
    _claim_name(path)
    making = path.with_name(path.name + MAKING_SUFFIX)
    try:
        _require_room(path, study)
        with h5py.File(making, "w", libver=layout.LIBVER, locking=False) as file:
            _fill(file, study)
        sync_file(making)
        os.replace(making, path)  # noqa: PTH105 - the pair of os.fsync
        sync_folder(path.parent)
    except OSError as error:
        _discard(making, path)
        raise StudyError(f"{path} cannot be created: {error}. Nothing was computed.") from error
    except BaseException:
        _discard(making, path)
        raise


def _discard(*paths: Path) -> None:
    for path in paths:
        path.unlink(missing_ok=True)


def _claim_name(path: Path) -> None:
    """Take the name with an empty file, so that two runs cannot both have it."""
    try:
        path.open("xb").close()
    except FileExistsError:
        raise StudyError(
            f"{path} exists, and nothing is ever overwritten; resume it, or choose another name."
        ) from None
    except OSError as error:
        raise StudyError(f"{path} cannot be created: {error.strerror}; choose another folder.") from error


def _require_room(path: Path, study: Study) -> None:
    needed_bytes = HEAD_BYTES + study.grid.size * sum(
        np.dtype(column.dtype).itemsize * column.components for column in COLUMNS
    )
    free_bytes = shutil.disk_usage(path.parent).free
    if free_bytes < needed_bytes:
        raise StudyError(
            f"{path} needs {needed_bytes / 1e6:.0f} MB for {study.grid.size} points; the disk has"
            f" {free_bytes / 1e6:.0f} MB. Make room, or choose another folder or a smaller study."
        )


def _fill(file: h5py.File, study: Study) -> None:
    _attach(
        file,
        {
            "Conventions": layout.CONVENTIONS,
            "format": layout.FORMAT,
            "format_version": layout.FORMAT_VERSION,
            "title": "predictions of vibro-impact responses",
        },
    )
    text = study.model_dump_json().encode()
    file.create_dataset(layout.STUDY, data=np.array(text, dtype=h5py.string_dtype("utf-8", len(text))))
    scales = [_scale(file, axis) for axis in study.axes]
    coordinate = _scale(file, Axis(COORDINATE, COORDINATES, "", "x, y, z and their velocities"))
    for column in COLUMNS:
        dataset = _column(file, column, study.grid.shape)
        for index, scale in enumerate([*scales, coordinate][: dataset.ndim]):
            dataset.dims[index].attach_scale(scale)
    _sessions(file)


def _scale(file: h5py.File, axis: Axis) -> h5py.Dataset:
    match axis.values[0]:
        case str():
            raw = [str(value).encode() for value in axis.values]
            kind = h5py.string_dtype("utf-8", max(len(each) for each in raw))
            dataset = file.create_dataset(axis.name, data=np.array(raw, dtype=kind))
        case _:
            dataset = file.create_dataset(axis.name, data=np.array(axis.values, dtype="<f8"))
            _attach(dataset, {"units": axis.units})
    _attach(dataset, {"long_name": axis.long_name})
    dataset.make_scale(axis.name)
    return dataset


def _column(file: h5py.File, column: Column, shape: tuple[int, ...]) -> h5py.Dataset:
    """Create a contiguous dataset in its place, filled with what stands for missing."""
    whole = shape if column.components == 1 else (*shape, column.components)
    kind = np.dtype(column.dtype)
    stored = h5py.string_dtype("utf-8", kind.itemsize) if kind.kind == "S" else kind
    dataset = file.create_dataset(column.name, data=np.full(whole, column.missing, dtype=stored))
    _attach(dataset, {"long_name": column.long_name})
    match kind.kind:
        case "f":
            _attach(dataset, {"units": column.units})
        case "i":
            dataset.attrs["_FillValue"] = kind.type(column.missing)
    if column.meanings:
        dataset.attrs["flag_values"] = np.arange(len(column.meanings), dtype=kind)
        _attach(dataset, {"flag_meanings": " ".join(column.meanings)})
    return dataset


def _sessions(file: h5py.File) -> None:
    group = file.create_group(layout.SESSIONS)
    for column in layout.SESSION_COLUMNS:
        kind = h5py.string_dtype("utf-8", column.width)
        group.create_dataset(column.name, data=np.zeros(layout.MOST_SESSIONS, dtype=kind), dtype=kind)
    group.create_dataset(layout.N_SESSIONS, data=np.zeros(1, dtype=layout.COUNTER_DTYPE))


def _attach(target: h5py.HLObject, values: Mapping[str, str | int | float]) -> None:
    """Attach scalars, text as UTF-8 of fixed length, which old readers understand."""
    for name, value in values.items():
        match value:
            case str():
                raw = value.encode()
                kind = h5py.string_dtype("utf-8", max(len(raw), 1))
                target.attrs.create(name, np.array(raw, dtype=kind), dtype=kind)
            case _:
                target.attrs[name] = value
