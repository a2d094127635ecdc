"""Measure the processor time of the window's thread on the Files, Compare and Simulate pages.

    python benchmarks/window_pages.py RECORDING.h5

The times are processor time of the thread that draws, offscreen at 1400 x 900; other processes do not affect
them. The recording should be large: benchmarks/overview.py leaves one in the folder that it is given.
"""

import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
os.environ.setdefault("PYQTGRAPH_QT_LIB", "PySide6")

import numpy as np
from PySide6.QtCore import QEventLoop, QTimer
from PySide6.QtWidgets import QApplication

from vibench.analysis import Curve, CurveKind, CurveOrigin
from vibench.analysis.prediction.progress import SimulatedPoint, SimulationProgress
from vibench.gui.page.app_context import AppContext, Settings
from vibench.gui.pages.compare.compare_page import ComparePage
from vibench.gui.pages.files.files_page import FilesPage
from vibench.gui.pages.simulate.simulate_page import SimulatePage
from vibench.gui.window.event_loop_monitor import EventLoopMonitor
from vibench.gui.window.window import application

SIZE = (1400, 900)
SPANS_S = (600.0, 60.0, 6.0, 2.4, 0.6, 0.06)
TRIES = 7
LOOKS = 20
"""Number of timer events after the picture is shown, for work that was deferred."""


def main() -> None:
    """Measure all three pages."""
    application(["benchmark"])
    with tempfile.TemporaryDirectory() as folder:
        context = AppContext(Settings(Path(folder) / "window.ini"))
        context.choose_folder(Path(folder))
        files(context, Path(sys.argv[1]))
        compare(context)
        simulate(context)
        context.background.close()


def files(context: AppContext, path: Path) -> None:
    """Open the recording and zoom to random places."""
    page = FilesPage(context)
    page.resize(*SIZE)
    page.show()
    for number in ("first", "next"):
        monitor = EventLoopMonitor(lambda: "Files page")
        begun = time.monotonic()
        page.time_histories.show_recording(None)
        page.open_path(path)
        wait_until(lambda: bool(page.time_histories.plots))
        print(
            f"{f'Files: {number} recording, click to picture':<44} {time.monotonic() - begun:.2f} s of clock"
        )
        wait_until(lambda monitor=monitor: monitor.rounds > LOOKS)
        print(f"{'Files: longest piece of that':<44} {1e3 * monitor.busiest_s:.0f} ms")
        monitor.stop()
    rng = np.random.default_rng(1)
    _, end_s = page.time_histories.view_s
    for span_s in (each for each in SPANS_S if each <= end_s):
        starts_s = iter(rng.uniform(0, end_s - span_s + 1e-9, 1 + TRIES))
        report(f"Files: zoom to {span_s:g} s", partial(zoom, page, starts_s, span_s))
    page.close()


def wait_until(is_so: Callable[[], bool]) -> None:
    """Run the event loop until a condition is true."""
    loop = QEventLoop()
    timer = QTimer(interval=5)
    timer.timeout.connect(lambda: loop.quit() if is_so() else None)
    timer.start()
    loop.exec()


def zoom(page: FilesPage, starts_s: Iterator[float], span_s: float) -> None:
    """Show the next time range."""
    start_s = next(starts_s)
    page.time_histories.show_range(start_s, start_s + span_s)


def compare(context: AppContext) -> None:
    """Overlay six curves of 4000 points."""
    page = ComparePage(context)
    page.resize(*SIZE)
    page.show()
    frequency_hz = np.linspace(10.0, 1000.0, 4000)
    rng = np.random.default_rng(2)
    for number in range(6):
        values = np.exp(0.2 * rng.standard_normal(4000).cumsum() / 20)
        curve = Curve(
            f"run {number}",
            CurveOrigin.MEASURED,
            CurveKind.TRANSMISSIBILITY,
            frequency_hz,
            values,
            np.full(4000, 0.02),
        )
        report(
            f"Compare: curve {number + 1} of 4000 points", lambda c=curve: page.add_prediction((c,)), tries=1
        )
    page.close()


def simulate(context: AppContext) -> None:
    """Redraw a simulation of 2 x 500 points, as every tick does while it grows."""
    page = SimulatePage(context)
    page.resize(*SIZE)
    page.show()
    progress = SimulationProgress(5e-6, 1000, "")
    for model in ("a", "b"):
        progress.add(
            tuple(SimulatedPoint(model, 10.0 + n, 2.0 + n % 7, 1.0, n % 50, 3.0) for n in range(500))
        )
    report("Simulate: draw 2 x 500 points", lambda: page.plots.show_progress(progress))
    page.close()


def report(name: str, act: Callable[[], object], tries: int = TRIES) -> None:
    """Print how long an action and the drawing after it keep the thread busy."""
    if tries > 1:
        busy(act)
    taken = [busy(act) for _ in range(tries)]
    print(f"{name:<44} median {1e3 * np.median(taken):.0f} ms, largest {1e3 * max(taken):.0f} ms")


def busy(act: Callable[[], object]) -> float:
    """Return the processor time of this thread for an action and the resulting events [s]."""
    begun = time.thread_time()
    act()
    QApplication.processEvents()
    QApplication.processEvents()
    return time.thread_time() - begun


if __name__ == "__main__":
    main()
