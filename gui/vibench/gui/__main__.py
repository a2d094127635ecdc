"""The commands `vibench-gui` and `python -m vibench.gui`, which open the window.

Qt is imported inside `main`, because spawned worker processes import this module too.
"""

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from vibench.acquisition import ConfigurationError, printable
from vibench.acquisition.rig import load_rig

from .window.display import display_trouble

if TYPE_CHECKING:
    from PySide6.QtWidgets import QLabel

NO_WINDOW = 1
"""Exit code when no window can be shown."""


def main(arguments: list[str] | None = None) -> int:
    """Open the window and return the exit code when it is closed."""
    options = _options(arguments)
    # Use PySide6 in pyqtgraph too, and one thread for linear algebra, because the matrices are small.
    os.environ.setdefault("PYQTGRAPH_QT_LIB", "PySide6")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    trouble = display_trouble()
    if trouble:
        sys.stderr.write(f"The window cannot be opened: {trouble}.\n")
        return NO_WINDOW
    if options.bench is not None:
        try:
            load_rig(options.bench)
        except ConfigurationError as error:
            sys.stderr.write(f"error: {printable(str(error))}\n")
            return NO_WINDOW
    starting = _sign_of_life()
    from .window.open_window import open_window  # noqa: PLC0415

    if options.screenshots is not None:
        from .window.screenshots import make_screenshots  # noqa: PLC0415

        return make_screenshots(options.bench, options.screenshots)
    return open_window(options.bench, options.settings, starting)


def _sign_of_life() -> "QLabel":
    """Return a "starting" label, shown first because loading the window takes seconds on a busy computer."""
    from PySide6.QtCore import Qt  # noqa: PLC0415
    from PySide6.QtWidgets import QApplication, QLabel  # noqa: PLC0415

    QApplication.setHighDpiScaleFactorRoundingPolicy(Qt.HighDpiScaleFactorRoundingPolicy.PassThrough)
    application = QApplication.instance() or QApplication(["vibench"])
    label = QLabel("vibench is starting…", None, Qt.WindowType.SplashScreen)
    label.setWindowTitle("vibench")
    label.setMargin(2 * label.fontMetrics().height())
    label.show()
    application.processEvents()
    return label


def _options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="vibench gui", description="The window of vibench.")
    parser.add_argument(
        "--bench", type=Path, metavar="BENCH.toml", help="hardware configuration to begin with"
    )
    parser.add_argument(
        "--settings", type=Path, metavar="FILE.ini", help="settings file; the user's if absent"
    )
    parser.add_argument(
        "--screenshots", type=Path, metavar="DIR", help="save a picture of every page there, and exit"
    )
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
