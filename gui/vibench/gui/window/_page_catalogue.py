"""The pages there are, in the order of the navigation bar."""

from collections.abc import Callable
from dataclasses import dataclass

from ..page import AppContext, Page
from ..pages.compare import ComparePage
from ..pages.files import FilesPage
from ..pages.maps import MapsPage
from ..pages.queue import QueuePage
from ..pages.rig import RigPage
from ..pages.run import RunPage
from ..pages.simulate import SimulatePage
from ..pages.test import TestPage
from ..widgets import COMPARE, FILES, MAPS, QUEUE, RIG, RUN, SIMULATE, TEST


@dataclass(frozen=True)
class PageEntry:
    """A page by its name, its place on the rail, and how it is made."""

    name: str
    number: int
    """Ctrl and this number shows it."""
    make: Callable[[AppContext], Page]


PAGES: tuple[PageEntry, ...] = (
    PageEntry(RIG, 1, RigPage),
    PageEntry(TEST, 2, TestPage),
    PageEntry(RUN, 3, RunPage),
    PageEntry(FILES, 4, FilesPage),
    PageEntry(COMPARE, 5, ComparePage),
    PageEntry(SIMULATE, 6, SimulatePage),
    PageEntry(QUEUE, 7, QueuePage),
    PageEntry(MAPS, 8, MapsPage),
)
