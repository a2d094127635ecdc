"""Changing a finished recording without ever having it half changed: copy, change the copy, swap names."""

import os
import shutil
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

import h5py

from vibench.sim.operating_system.this import rename, sync_file, sync_folder

from ..errors import RecordingError
from . import _layout as layout
from ._preallocate import extend_room, release_room

Answer = TypeVar("Answer")

ATTEMPTS = 10
"""How often another program may change the file first before we give up."""

_one_at_a_time = threading.Lock()


def replace_with_change(path: Path, room: int, change: Callable[[h5py.File], Answer]) -> Answer:
    """Apply ``change``, which adds at most ``room`` bytes, to a copy of the file, and swap the two.

    A crash leaves the old file untouched (and perhaps a ``.tmp`` beside it). When another program has changed
    the file meanwhile, the change is made again on top of that. Raises RecordingError when the disk refuses;
    the file is as it was.
    """
    try:
        with _one_at_a_time:
            for _ in range(ATTEMPTS):
                before = _fingerprint(path)
                tmp, answer = _changed_copy(path, room, change)
                try:
                    if _fingerprint(path) == before:
                        rename(tmp, path)
                        with suppress(OSError):  # after a power cut either file is there, and both are whole
                            sync_folder(path.parent)
                        return answer
                finally:
                    with suppress(OSError):  # a rename has taken it
                        tmp.unlink()
    except RecordingError:
        raise
    except (OSError, RuntimeError) as error:
        raise RecordingError(
            f"{path} could not be added to: {error}. It is as it was; make room, or close the programs"
            " that have it open, and try again."
        ) from error
    raise RecordingError(
        f"{path} was changed by another program each of {ATTEMPTS} times. Nothing was added; try again later."
    )


def _changed_copy(path: Path, room: int, change: Callable[[h5py.File], Answer]) -> tuple[Path, Answer]:
    descriptor, name = tempfile.mkstemp(prefix=path.name + ".", suffix=layout.TMP_SUFFIX, dir=path.parent)
    os.close(descriptor)
    tmp = Path(name)
    try:
        shutil.copyfile(path, tmp)
        shutil.copymode(path, tmp)
        extend_room(tmp, tmp.stat().st_size + room)
        with h5py.File(tmp, "r+", libver=layout.LIBVER, locking=False) as file:
            answer = change(file)
        release_room(tmp)
        sync_file(tmp)
    except BaseException:
        tmp.unlink(missing_ok=True)
        raise
    return tmp, answer


def _fingerprint(path: Path) -> tuple[int, int, int]:
    """Take what differs when another program has put its own copy in place."""
    status = path.stat()
    return (status.st_ino, status.st_mtime_ns, status.st_size)
