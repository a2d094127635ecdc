"""The pages of the documentation on this computer: as a built site, or as they were written."""

import re
from importlib.metadata import version
from pathlib import Path

from vibench.sim import state_folder

from ..errors import ConfigurationError
from .shipped import shipped_folder


def built_site() -> Path:
    """Folder of the site that ``vibench docs`` builds for this version; it need not exist yet."""
    return state_folder() / "documentation" / version("vibench")


def documentation_page(page: str = "index") -> Path:
    """Path of a page of the documentation on this computer, without the network.

    ``page`` is its name in ``docs`` without ``.md``: ``"gui"``, ``"campaigns"``. The page is HTML where the
    site has been built (``vibench docs``), else the Markdown behind it.

    Raises ConfigurationError when there is no such page.
    """
    sources = shipped_folder("docs")
    built, written = built_site() / f"{page}.html", sources / f"{page}.md"
    if not re.fullmatch(r"[\w/-]+", page) or not (built.is_file() or written.is_file()):
        names = ", ".join(sorted(path.stem for path in sources.glob("*.md")))
        raise ConfigurationError(f"the documentation has no page {page!r}; there are {names}")
    return built if built.is_file() else written
