"""From nothing to a window on the screen, and from its end to the end of the process."""

import gc
import sys
from pathlib import Path

from PySide6.QtCore import QTimer

from ..page import Desk, Remembered, Settings, default_settings_path
from ._app import application
from ._page_catalogue import PAGES
from ._window import Window


def open_window(bench: Path | None, settings: Path | None) -> int:
    """Show the window until it is closed; gives the exit code of the process."""
    app = application(sys.argv[:1])
    kept = Settings(settings or default_settings_path())
    if bench is not None:
        kept.keep_text(Remembered.BENCH, str(bench.resolve()))
    window = Window(Desk(kept), PAGES)
    # None of all this ever is garbage: a collector that looked through it would hold the window up.
    gc.freeze()
    window.show()
    QTimer.singleShot(0, window.desk.background.prepare)
    return app.exec()
