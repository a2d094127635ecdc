"""Pictures of every page, light and dark, made by the window itself while it measures on the rig."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic

from PySide6.QtCore import QEventLoop, QTimer
from PySide6.QtWidgets import QApplication

from acquisition.engine.start import start_engine
from acquisition.engine.state import Attendance, EngineState
from acquisition.plan.measurement import Measurement

from .app import application
from .desk import Desk
from .page_names import COMPARE, RUN, SIMULATE
from .pages.catalogue import PAGES
from .pages.compare.compare_page import ComparePage
from .pages.simulate.simulate_page import SimulatePage
from .pages.test.test_page import TestPage
from .settings import Remembered, Settings
from .theme import THEMES, Theme
from .window import Window

SIZE = (1400, 900)
PATIENCE_S = 180.0
SHOWN = Measurement.model_validate(
    {
        "name": "sweep",
        "ramp_s": 0.3,
        "ramp_step_s": 0.03,
        "excitation": {
            "kind": "sine_sweep",
            "amplitude_vpp": 1.5,
            "start_hz": 150,
            "stop_hz": 350,
            "duration_s": 20,
            "settle_s": 0.5,
            "hold": "displacement",
        },
    }
)
"""The paper's sweep through the impacting region, ten times as fast."""
SHOWN_AT_S = 17.0


def make_screenshots(bench: Path | None, folder: Path) -> int:
    """Measure with a window, and picture its pages; gives the exit code of the process."""
    application(["vibench"])
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as scratch:
        settings = Settings(Path(scratch) / "window.ini")
        if bench is not None:
            settings.keep_text(Remembered.BENCH, str(bench.resolve()))
        # Unattended: to change the theme and to write pictures takes longer than an attended run waits.
        desk = Desk(settings, partial(start_engine, Attendance.UNATTENDED))
        desk.choose_folder(Path(scratch) / "recordings")
        window = Window(desk, PAGES)
        window.resize(*SIZE)
        window.show()
        try:
            _measure(window, lambda: _picture(window, (RUN,), folder))
            _compare_and_simulate(window)
            _picture(window, tuple(name for name in window.pages if name != RUN), folder)
        finally:
            window.close()
    return 0


def _measure(window: Window, during: Callable[[], None]) -> None:
    """Open, check, arm, start; ``during`` happens inside the region of collisions."""
    bridge, test = window.desk.bridge, window.pages["Test"]
    assert isinstance(test, TestPage)
    test.form.show_measurement(SHOWN)
    rig = window.desk.intent.rig
    assert rig is not None
    bridge.open(rig, None)
    _wait(lambda: bridge.state is EngineState.READY)
    window.orders.check()
    _wait(lambda: bridge.status is not None and bridge.status.check is not None)
    _wait(lambda: not test.is_busy)
    window.orders.arm_test()
    _wait(lambda: bridge.state is EngineState.ARMED)
    window.orders.start()
    _wait(lambda: _elapsed_s(window) > SHOWN_AT_S)
    during()
    _wait(lambda: bridge.state is EngineState.READY)


def _elapsed_s(window: Window) -> float:
    status = window.desk.bridge.status
    return 0.0 if status is None or status.run is None else status.run.elapsed_s


def _compare_and_simulate(window: Window) -> None:
    """Simulate what the form says at first, and lay it over what was measured."""
    compare, simulation = window.pages[COMPARE], window.pages[SIMULATE]
    assert isinstance(compare, ComparePage)
    assert isinstance(simulation, SimulatePage)
    simulation.begin()
    compare.add_recordings(tuple(window.desk.folder.glob("*.h5")))
    _wait(lambda: not simulation.simulator.is_busy and not compare.is_busy)
    if simulation.course is not None:
        compare.add_prediction(simulation.course.traces())


def _picture(window: Window, pages: tuple[str, ...], folder: Path) -> None:
    """Save each page in each theme."""
    first = window.desk.theme
    for page in pages:
        window.show_page(page)
        for theme in THEMES.values():
            _themed(window, theme)
            window.grab().save(str(folder / f"{page.lower()}_{theme.name}.png"))
    _themed(window, first)


def _themed(window: Window, theme: Theme) -> None:
    window.desk.choose_theme(theme)
    _pass_ms(300)


def _wait(is_so: Callable[[], bool]) -> None:
    give_up_s = monotonic() + PATIENCE_S
    while not is_so() and monotonic() < give_up_s:
        QApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 20)


def _pass_ms(duration_ms: int) -> None:
    """Let the window live for a while."""
    loop = QEventLoop()
    QTimer.singleShot(duration_ms, loop.quit)
    loop.exec()
