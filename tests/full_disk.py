"""Simulate a full disk for the files that this process writes."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest


@contextmanager
def full_disk(room_bytes: int = 20) -> Iterator[None]:
    """Refuse every byte of a file beyond `room_bytes`; limits on file size exist on POSIX only."""
    resource = pytest.importorskip("resource", reason="limits on file size exist on POSIX only")
    usual = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room_bytes, usual[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, usual)
