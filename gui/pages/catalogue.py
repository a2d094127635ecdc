"""The pages there are, in the order of the rail."""

from collections.abc import Callable
from dataclasses import dataclass

from ..desk import Desk
from ..page import Page
from ..page_names import FILES
from .files.files_page import FilesPage


@dataclass(frozen=True)
class PageEntry:
    """A page by its name, its place on the rail, and how it is made."""

    name: str
    number: int
    """Ctrl and this number shows it."""
    make: Callable[[Desk], Page]


PAGES: tuple[PageEntry, ...] = (PageEntry(FILES, 4, FilesPage),)
