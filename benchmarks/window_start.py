"""Measure the time from `vibench gui` to the first painted window, with files in the disk cache.

    python benchmarks/window_start.py [TIMES]

Each start is a separate process; the time runs from before the process exists until its window has been
painted once. The first start, which may have to read everything from the disk, is not counted.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
STARTED = """
import sys, time
from pathlib import Path
from vibench.gui.window.window import application
from vibench.gui.page.app_context import AppContext
from vibench.gui.window.window import PAGES
from vibench.gui.page.app_context import Settings
from vibench.gui.window.window import Window
app = application(["vibench"])
window = Window(AppContext(Settings(Path(sys.argv[1]))), PAGES)
window.show()
app.processEvents()
window.grab()
print(time.time())
"""


def start_s(settings: Path) -> float:
    """Start a window once; return the time until it was painted [s]."""
    environment = {
        "QT_QPA_PLATFORM": "offscreen",
        **os.environ,
        "PYTHONPATH": str(ROOT),
        "OPENBLAS_NUM_THREADS": "1",
    }
    began_s = time.time()
    done = subprocess.run(
        [sys.executable, "-c", STARTED, str(settings)],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    return float(done.stdout) - began_s


def main() -> None:
    """Start the window repeatedly and print the times."""
    times = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    with tempfile.TemporaryDirectory() as folder:
        settings = Path(folder) / "window.ini"
        start_s(settings)
        taken = [start_s(settings) for _ in range(times)]
    typical_s, longest_s = statistics.median(taken), max(taken)
    print(f"first painted window after {typical_s:.2f} s (median of {times}), {longest_s:.2f} s at most")


if __name__ == "__main__":
    main()
