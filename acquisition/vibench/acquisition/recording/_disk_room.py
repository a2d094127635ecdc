"""Room on the disk for what HDF5 is going to write, claimed before and given back after.

HDF5 must never meet a full disk: closing a file that cannot be flushed crashes the process
(seen with HDF5 2.0). So plain system calls meet it first, and fail as they should.
"""

import os
from pathlib import Path

from vibench.sim.operating_system.this import allocate, open_to_write

from ._disk_trouble import meet_trouble

FILE_MODE = 0o666
"""Before the user's mask, as for any file a program makes."""

SIGNATURE = b"\x89HDF\r\n\x1a\n\x00"
"""HDF5's, followed by version 0 of the superblock."""
END_ADDRESS = slice(40, 48)
"""Where superblock 0 keeps the end of the file (HDF5 File Format Specification 3.0, II.A)."""


def claim_room(path: Path, allocated: int, length: int) -> None:
    """Create a file that the disk gives ``allocated`` bytes, and that may be ``length`` bytes long.

    Raises OSError when the file exists, or the disk or a limit refuses; a file made here is gone again.
    """
    meet_trouble()
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, FILE_MODE)
    try:
        allocate(descriptor, 0, allocated)
        os.ftruncate(descriptor, length)
    except OSError:
        path.unlink()
        raise
    finally:
        os.close(descriptor)


def extend_room(path: Path, allocated: int) -> None:
    """Give an existing file at least ``allocated`` bytes on the disk."""
    descriptor = open_to_write(path)
    try:
        allocate(descriptor, 0, allocated)
    finally:
        os.close(descriptor)


def release_room(path: Path) -> None:
    """Cut off what HDF5 did not use. Call it when HDF5 has closed the file."""
    with path.open("r+b") as file:
        head = file.read(END_ADDRESS.stop)
        if head.startswith(SIGNATURE):  # another superblock keeps its surplus, which does no harm
            file.truncate(int.from_bytes(head[END_ADDRESS], "little"))
