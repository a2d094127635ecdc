"""Keeping the first error in front: what fails while cleaning up after it becomes a note on it."""

from collections.abc import Iterator
from contextlib import contextmanager

from ..errors import AcquisitionError


@contextmanager
def noted(error: BaseException) -> Iterator[None]:
    """Clean up after ``error``: a further failure of an instrument is added to it as a note."""
    try:
        yield
    except AcquisitionError as failure:
        error.add_note(f"While cleaning up: {failure}")
