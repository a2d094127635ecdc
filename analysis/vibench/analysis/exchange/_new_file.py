"""A file that appears whole, under a name that nobody had, or not at all."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from vibench.sim.operating_system.this import rename

from ..errors import InvalidRequest

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

    Raises
    ------
    InvalidRequest
        When ``path`` or its unfinished form exists, the folder does not, or the disk refuses.

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
