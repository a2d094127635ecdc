"""The pages there are, in the order of the rail."""

from collections.abc import Callable
from dataclasses import dataclass

from ..desk import Desk
from ..page import Page
from ..page_names import COMPARE, FILES, QUEUE, RIG, RUN, SIMULATE, TEST
from .compare.compare_page import ComparePage
from .files.files_page import FilesPage
from .queue.queue_page import QueuePage
from .rig.rig_page import RigPage
from .run.run_page import RunPage
from .simulate.simulate_page import SimulatePage
from .test.test_page import TestPage


@dataclass(frozen=True)
class PageEntry:
    """A page by its name, its place on the rail, and how it is made."""

    name: str
    number: int
    """Ctrl and this number shows it."""
    make: Callable[[Desk], Page]


PAGES: tuple[PageEntry, ...] = (
    PageEntry(RIG, 1, RigPage),
    PageEntry(TEST, 2, TestPage),
    PageEntry(RUN, 3, RunPage),
    PageEntry(FILES, 4, FilesPage),
    PageEntry(COMPARE, 5, ComparePage),
    PageEntry(SIMULATE, 6, SimulatePage),
    PageEntry(QUEUE, 7, QueuePage),
)
