"""Check an HDF5 file before reading: no external data, and no sizes that the file cannot contain."""

import errno
import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py

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
    """Yield path and object of a group and of all objects below it; each object once, ordered by name.

    Raises UnsafeHdf5 at a link to another file, unless that is allowed. Soft links are not followed.
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
        links += len(item)  # counted before the loop, because many links may lead to one object
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
    return f"{place} refers to another file ({where}); read it with --allow-external if you trust this file"


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
                    f"{dataset.name} ends at byte {begin + stored}, but the file has {size_bytes}"
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
