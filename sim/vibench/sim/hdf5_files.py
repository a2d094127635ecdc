"""Open HDF5 files that may be damaged or malicious, and write files to disks that may fail.

HDF5 files can include data of other files (external storage, external links, virtual datasets), and the HDF5
library does not check the sizes stated in a file. `open_hdf5` refuses external data, except inside the
context `allow_external_data`, and compares the stated sizes with the length of the file before reading.

HDF5 2.0 crashes if a write fails while a file is being closed, and h5py only prints errors that occur while
an object is being closed. Therefore `open_hdf5_to_write` gives HDF5 a file object that accepts every write
and stores the first error. The error is raised after HDF5 has closed the file; a Ctrl-C is also delayed until
the file is closed.

>>> from pathlib import Path
>>> from tempfile import TemporaryDirectory
>>> import h5py
>>> from vibench.sim.hdf5_files import UnsafeHdf5, open_hdf5
>>> with TemporaryDirectory() as folder:
...     path = Path(folder) / "foreign.h5"
...     with h5py.File(path, "w") as file:
...         file["copied"] = h5py.ExternalLink("/etc/hosts.h5", "/secret")
...     try:
...         open_hdf5(path)
...     except UnsafeHdf5 as error:
...         print(error)
/copied refers to another file (/etc/hosts.h5); read it with --allow-external if you trust this file
"""

import errno
import math
import re
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from io import FileIO
from pathlib import Path
from traceback import walk_stack
from types import FrameType
from typing import Any, Literal

import h5py

from .operating_system.this import Buffer, write_all

MOST_OBJECTS = 20_000
"""Largest allowed number of links to groups and datasets in a file; a recording has about forty."""
MOST_ATTRIBUTES = 1_000
"""Largest allowed number of attributes of an HDF5 object; a channel of a recording has about 25."""
DEEPEST = 32
"""Deepest allowed nesting of groups in a file."""
LARGEST_ATTRIBUTE_BYTES = 1_000_000
LARGEST_CHUNK_BYTES = 256_000_000
"""Largest allowed chunk of a dataset [bytes]; chunks of recordings have 200 kB."""
LARGEST_RATIO = 1100
"""Largest ratio of declared to stored bytes; Deflate compresses at most 1030-fold (zlib's documentation)."""
UNSTORED_BYTES = 1_000_000
"""Size [bytes] that a dataset may declare beyond its stored data, to allow for constant fill values."""
OWN_FILTERS = frozenset(
    {
        h5py.h5z.FILTER_DEFLATE,
        h5py.h5z.FILTER_SHUFFLE,
        h5py.h5z.FILTER_FLETCHER32,
        h5py.h5z.FILTER_SZIP,
        h5py.h5z.FILTER_NBIT,
        h5py.h5z.FILTER_SCALEOFFSET,
        h5py.h5z.FILTER_LZF,
    }
)
"""Allowed HDF5 filters for data; any other filter is a plug-in library that HDF5 would execute."""

UNREADABLE = (RuntimeError, KeyError, TypeError, OverflowError, ValueError)
"""Errors that h5py raises for unreadable headers or number types."""

_SYSTEM_ERROR = re.compile(r"errno = (?!22,)\d+, error message = '([^']*)'")
"""Pattern of an operating-system error in a message of HDF5; excludes error 22, a bad address in the file."""

_allowances: list[None] = []
"""One entry for each active `allow_external_data`, which applies to all threads of the process."""


class UnsafeHdf5(ValueError):
    """Error: a file refers to other files or is inconsistent; the message does not name the file."""


def system_error(error: BaseException) -> str:
    """Return the operating system's message in a read error ("Input/output error"); empty if none."""
    if found := _SYSTEM_ERROR.search(str(error)):
        return found[1]
    return error.strerror or "" if isinstance(error, OSError) and error.errno else ""


@contextmanager
def allow_external_data() -> Iterator[None]:
    """Allow files opened in this context to include data of other files."""
    _allowances.append(None)
    try:
        yield
    finally:
        _allowances.pop()


def open_hdf5(path: Path, *, locking: bool | None = None) -> h5py.File:
    """Open a file for reading after checking its structure; the numbers in datasets are not checked.

    Raises OSError when HDF5 cannot open the file; UnsafeHdf5 for external data or impossible sizes.

    Parameters
    ----------
    path
        Path of the file.
    locking
        As for ``h5py.File``; None for the default of HDF5.
    """
    file = h5py.File(path, "r", locking=locking)
    try:
        size_bytes = path.stat().st_size
        for _, item in walk(file):
            _require_attributes(item)
            if isinstance(item, h5py.Dataset):
                _require_dataset(item, size_bytes)
    except BaseException as error:
        file.close()
        if reason := system_error(error):
            raise OSError(errno.EIO, reason) from error
        if isinstance(error, UNREADABLE) and not isinstance(error, UnsafeHdf5):
            raise UnsafeHdf5(f"its contents cannot be read ({error})") from error
        raise
    return file


def walk(file: h5py.Group) -> Iterator[tuple[str, h5py.HLObject]]:
    """Yield path and object of a group and of all objects in the group; each object once, ordered by name.

    Raises UnsafeHdf5 at a link to another file, unless such links are allowed. Soft links are not followed.
    """
    seen = {_address(file)}
    links = 0
    waiting = [(file.name, file, 0)]
    while waiting:
        path, item, depth = waiting.pop()
        yield path, item
        if not isinstance(item, h5py.Group):
            continue
        if depth == DEEPEST:
            raise UnsafeHdf5(f"its groups are nested more than {DEEPEST} levels deep")
        links += len(item)  # before the loop: many links may lead to one object
        if links > MOST_OBJECTS:
            raise UnsafeHdf5(f"it contains more than {MOST_OBJECTS} objects")
        for name in sorted(item, reverse=True):
            if not _leads_to_own_object(item, name):
                continue
            below = item[name]
            if _address(below) in seen:
                continue
            seen.add(_address(below))
            waiting.append((f"{path.rstrip('/')}/{name}", below, depth + 1))


def _leads_to_own_object(group: h5py.Group, name: str) -> bool:
    link = group.get(name, getlink=True)
    if isinstance(link, h5py.HardLink):
        return True
    if isinstance(link, h5py.ExternalLink) and not _allowances:
        raise UnsafeHdf5(_pointing_out(f"{group.name.rstrip('/')}/{name}", link.filename))
    return False


def _pointing_out(place: str, where: str) -> str:
    return f"{place} refers to another file ({where}); if you trust that file, give --allow-external"


def _address(item: h5py.HLObject) -> tuple[int, int]:
    found = h5py.h5o.get_info(item.id)
    return found.fileno, found.addr


def _require_attributes(item: h5py.HLObject) -> None:
    if len(item.attrs) > MOST_ATTRIBUTES:
        raise UnsafeHdf5(f"{item.name} has more than {MOST_ATTRIBUTES} attributes")
    for name in item.attrs:
        attribute = item.attrs.get_id(name)
        size = math.prod(attribute.shape or ()) * attribute.dtype.itemsize
        if size > LARGEST_ATTRIBUTE_BYTES:
            raise UnsafeHdf5(f"the attribute {name!r} of {item.name} claims {size} bytes")


def _require_dataset(dataset: h5py.Dataset, size_bytes: int) -> None:
    settings = dataset.id.get_create_plist()
    if settings.get_external_count():
        if not _allowances:
            raise UnsafeHdf5(
                _pointing_out(dataset.name, settings.get_external(0)[0].decode(errors="replace"))
            )
        return
    match settings.get_layout():
        case h5py.h5d.VIRTUAL:
            if not _allowances:
                raise UnsafeHdf5(_pointing_out(dataset.name, "it is a virtual dataset"))
        case h5py.h5d.CHUNKED:
            _require_chunks(dataset, settings, size_bytes)
        case h5py.h5d.CONTIGUOUS:
            begin, stored = dataset.id.get_offset(), dataset.id.get_storage_size()
            if begin is not None and begin + stored > size_bytes:
                raise UnsafeHdf5(
                    f"{dataset.name} ends at byte {begin + stored}, but the file has {size_bytes} bytes"
                )
            _require_size(dataset, stored, 1)
        case _:
            _require_size(dataset, dataset.id.get_storage_size(), 1)


def _require_chunks(dataset: h5py.Dataset, settings: h5py.h5p.PropDCID, size_bytes: int) -> None:
    for number in range(settings.get_nfilters()):
        code = settings.get_filter(number)[0]
        if code not in OWN_FILTERS:
            raise UnsafeHdf5(f"{dataset.name} is packed by filter {code}, which is not part of HDF5")
    chunk_bytes = math.prod(settings.get_chunk()) * dataset.dtype.itemsize
    if chunk_bytes > LARGEST_CHUNK_BYTES:
        raise UnsafeHdf5(f"{dataset.name} has chunks of {chunk_bytes} bytes")
    stored = dataset.id.get_storage_size()
    if stored > size_bytes:
        raise UnsafeHdf5(f"{dataset.name} claims {stored} bytes, but the file has {size_bytes}")
    _require_size(dataset, stored, LARGEST_RATIO if settings.get_nfilters() else 1, chunk_bytes)


def _require_size(dataset: h5py.Dataset, stored: int, ratio: int, spare_bytes: int = 0) -> None:
    declared = math.prod(dataset.shape or ()) * dataset.dtype.itemsize
    if declared > ratio * stored + spare_bytes + UNSTORED_BYTES:
        raise UnsafeHdf5(f"{dataset.name} declares {declared} bytes, but stores only {stored}")


class _Disk(FileIO):
    refusal: OSError | KeyboardInterrupt | None = None

    def write(self, data: Buffer) -> int:  # type: ignore[override]  # h5py passes nothing else
        try:
            write_all(self.fileno(), data, self.tell())
        except OSError as error:
            self.refusal = self.refusal or error
        return len(data)

    def truncate(self, size: int | None = None) -> int:
        try:
            return super().truncate(size)
        except OSError as error:
            self.refusal = self.refusal or error
            return 0


@contextmanager
def open_hdf5_to_write(
    path: Path, mode: Literal["x", "r+"], libver: tuple[str, str] | None = None
) -> Iterator[h5py.File]:
    """Open a file to create (``x``) or change (``r+``) it; raise OSError at the end if any write failed."""
    with _Disk(path, "x+" if mode == "x" else mode) as disk:
        try:
            with _interrupts(disk), h5py.File(disk, "w" if mode == "x" else mode, libver=libver) as file:
                yield file
        finally:
            if disk.refusal is not None:
                raise disk.refusal


@contextmanager
def _interrupts(disk: _Disk) -> Iterator[None]:
    """Delay a Ctrl-C (KeyboardInterrupt) that arrives inside this module until the file is closed."""
    is_reached = threading.current_thread() is threading.main_thread()
    found = {each: signal.getsignal(each) for each in (signal.valid_signals() if is_reached else ())}
    handlers: dict[int, Any] = {number: handler for number, handler in found.items() if callable(handler)}

    def on_signal(number: int, frame: FrameType | None) -> None:
        try:
            handlers[number](number, frame)
        except KeyboardInterrupt as interrupt:
            disk.refusal = disk.refusal or interrupt
            if all(each.f_code.co_filename != __file__ for each, _ in walk_stack(frame)):
                raise

    for number in handlers:
        signal.signal(number, on_signal)
    try:
        yield
    finally:
        for number, handler in handlers.items():
            if signal.getsignal(number) is on_signal:  # keep a newer handler
                signal.signal(number, handler)
