"""The pages there are, in the order of the navigation bar."""

from collections.abc import Callable
from dataclasses import dataclass

from ..page.app_context import AppContext
from ..page.page import Page
from ..pages.compare.compare_page import ComparePage
from ..pages.files.files_page import FilesPage
from ..pages.maps.maps_page import MapsPage
from ..pages.queue.queue_page import QueuePage
from ..pages.rig.rig_page import RigPage
from ..pages.run.run_page import RunPage
from ..pages.simulate.simulate_page import SimulatePage
from ..pages.test.test_page import TestPage
from ..widgets.page_names import COMPARE, FILES, MAPS, QUEUE, RIG, RUN, SIMULATE, TEST


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
