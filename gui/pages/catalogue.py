"""The pages there are, in the order of the rail."""

from collections.abc import Callable
from dataclasses import dataclass

from ..desk import Desk
from ..page import Page


@dataclass(frozen=True)
class PageEntry:
    """A page by its name, its place on the rail, and how it is made."""

    name: str
    number: int
    """Ctrl and this number shows it."""
    make: Callable[[Desk], Page]


RIG, TEST, RUN, FILES, COMPARE, SIMULATE, QUEUE = (
    "Rig",
    "Test",
    "Run",
    "Files",
    "Compare",
    "Simulate",
    "Queue",
)
"""Names that pages call each other by."""

PAGES: tuple[PageEntry, ...] = ()
