"""Screenshots of every page during a measurement, in both themes and several sizes."""

import gc
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic

import numpy as np
from PySide6.QtCore import QEventLoop, QTimer
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication

from vibench.acquisition import shipped
from vibench.acquisition.engine import EngineState, Supervision, start_engine
from vibench.acquisition.plan import Dwell, Hold, Measurement, SineSweep
from vibench.analysis.live import RowSpacing

from ..page.app_context import AppContext, SettingKey, Settings
from ..pages.compare.compare_page import ComparePage
from ..pages.files.files_page import FilesPage
from ..pages.maps import MapsPage
from ..pages.queue.queue_page import QueuePage
from ..pages.simulate.simulate_page import SimulatePage
from ..pages.test.test_page import TestPage
from ..widgets.notice import COMPARE, FILES, MAPS, QUEUE, RUN, SIMULATE, TEST
from ..widgets.theme import THEMES, Theme
from .window import PAGES, Window, application

SIZE = (1280, 800)
OTHER_SIZES = ((1024, 700), (1920, 1080))
"""Smallest supported window size, and a common size [pixels]; pictures of each size have their own folder."""
PATIENCE_S = 3600.0
"""Longest wait for the window to become ready [s]; long, because the computer may be busy."""
STILL_MS = 1200
"""Waiting time after which the frame rate in the status line is steady [ms]."""
_SMALLEST_FILE = 0
SHOWN = Measurement(
    name="sweep",
    ramp_s=0.3,
    ramp_step_s=0.03,
    excitation=SineSweep(
        amplitude_vpp=1.5, start_hz=150, stop_hz=350, duration_s=20, settle_s=0.5, hold=Hold.DISPLACEMENT
    ),
)
"""The paper's sine sweep through the frequency range with impacts, ten times as fast."""
SHOWN_AT_S = 17.0
SHOWN_TOO = Measurement(
    name="dwell",
    ramp_s=0.3,
    ramp_step_s=0.03,
    excitation=Dwell(amplitude_vpp=1.5, frequency_hz=260, duration_s=3),
)
CAMPAIGN = "campaigns/paper.toml"
MAP = {"columns": 61, "rows": 41}
MOTION = (300.0, 20e-6)
"""Frequency [Hz] and amplitude [m] of the motion shown beside the map."""
BRANCHES = {"start": 88.0, "stop": 101.0, "places": 3}
"""Frequency range [Hz] and number of frequencies of the search for branches."""
CHAIN = {"start_hz": 200.0, "stop_hz": 220.0, "step_hz": 10.0, "duration_s": 1.0, "settle_s": 1.0}


def make_screenshots(bench: Path | None, folder: Path) -> int:
    """Run a measurement, save pictures of all pages, and return the exit code."""
    application(["vibench"])
    with TemporaryDirectory(prefix="vibench_") as scratch:
        settings = Settings(Path(scratch) / "window.ini")
        if bench is not None:
            settings.keep_text(SettingKey.BENCH, str(bench.resolve()))
        # Saving pictures and changing the theme block the window, which would stop an attended run.
        context = AppContext(settings, partial(start_engine, Supervision.UNATTENDED))
        context.choose_folder(Path(scratch) / "recordings")
        window = Window(context, PAGES)
        # Freeze objects as `open_window` does, so that the pictures look like the real window.
        gc.freeze()
        window.resize(*SIZE)
        window.show()
        try:
            bridge, rig = window.context.bridge, window.context.selection.rig
            assert rig is not None
            bridge.open(rig, None)
            _wait(lambda: bridge.state is EngineState.READY)
            window.user_actions.check()
            _wait(lambda: bridge.status is not None and bridge.status.check is not None)
            _measure(window, SHOWN_TOO, lambda: None)
            _measure(window, SHOWN, lambda: _picture(window, (RUN,), folder))
            _fill(window)
            _picture(window, tuple(name for name in window.pages if name != RUN), folder)
            simulation = window.pages[SIMULATE]
            assert isinstance(simulation, SimulatePage)
            window.show_page(SIMULATE)
            for view in (simulation.branches, simulation.chain):
                simulation.tabs.setCurrentWidget(view)
                _save(window, folder, view.kind.name)
            simulation.tabs.setCurrentIndex(0)
            files = window.pages[FILES]
            assert isinstance(files, FilesPage)
            window.show_page(FILES)
            files.pictures.setCurrentWidget(files.pictures.spectrogram)
            files.pictures.spectrogram.spacing.setCurrentText(RowSpacing.LOGARITHMIC.value)
            _pass_ms(STILL_MS)
            _wait(lambda: not files.pictures.spectrogram.is_busy)
            _save(window, folder, "files_spectrogram")
            files.pictures.setCurrentWidget(files.time_histories)
            for width, height in OTHER_SIZES:
                window.resize(width, height)
                _picture(window, tuple(window.pages), folder / f"{width}x{height}")
        except TimeoutError as error:
            sys.stderr.write(f"The pictures are not complete: {error}.\n")
            return 1
        finally:
            window.close()
    return 0


def _measure(window: Window, measurement: Measurement, during: Callable[[], None]) -> None:
    """Arm and start a measurement; call ``during`` as soon as the masses collide."""
    bridge, test = window.context.bridge, window.pages[TEST]
    assert isinstance(test, TestPage)
    test.form.show_value(measurement)
    _wait(lambda: not test.is_busy and bridge.state is EngineState.READY)
    window.user_actions.arm_test()
    _wait(lambda: bridge.state is EngineState.ARMED)
    window.user_actions.start()
    _wait(lambda: bridge.state is EngineState.RUNNING)
    _wait(lambda: _elapsed_s(window) > SHOWN_AT_S or bridge.state is EngineState.READY)
    during()
    _wait(lambda: bridge.state is EngineState.READY)


def _elapsed_s(window: Window) -> float:
    status = window.context.bridge.status
    return 0.0 if status is None or status.run is None else status.run.elapsed_s


def _fill(window: Window) -> None:
    """Simulate and map the default scenes, overlay the simulation on the measurement, open a campaign."""
    compare, simulation, queue, maps = (window.pages[name] for name in (COMPARE, SIMULATE, QUEUE, MAPS))
    assert isinstance(compare, ComparePage)
    assert isinstance(simulation, SimulatePage)
    assert isinstance(queue, QueuePage)
    assert isinstance(maps, MapsPage)
    # Compute the results one after the other, so that the displayed computing times are realistic.
    for view, content in (
        (simulation, {}),
        (maps, MAP),
        (simulation.branches, BRANCHES),
        (simulation.chain, CHAIN),
    ):
        view.form.form.show_content({**view.form.form.content(), **content})
        view.begin()
        _wait(lambda view=view: not view.simulator.is_busy)  # type: ignore[misc]
    window.context.comparison_requested.emit(tuple(sorted(window.context.folder.glob("sweep*.h5"))))
    queue.open_file(shipped(CAMPAIGN))
    maps.pick(*MOTION)
    _wait(lambda: maps.displayed_results[1].inputs is not None and not compare.is_busy)
    for path in window.context.folder.glob("sweep*.h5"):
        window.context.recording_requested.emit(path)
    if simulation.progress is not None:
        compare.add_prediction(simulation.progress.curves())


def _picture(window: Window, pages: tuple[str, ...], folder: Path) -> None:
    first = window.context.theme
    for page in pages:
        window.show_page(page)
        _save(window, folder, page.lower())
    _use_theme(window, first)


def _save(window: Window, folder: Path, name: str) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for theme in THEMES.values():
        _use_theme(window, theme)
        window.event_loop_monitor.begin()
        _pass_ms(STILL_MS)
        _write(window.grab().toImage(), folder / f"{name}_{theme.name}.png")


def _write(picture: QImage, path: Path) -> None:
    """Save a picture with 32 shades per colour: the file size is halved without a visible loss."""
    picture = picture.convertToFormat(QImage.Format.Format_RGB32)
    shades = np.frombuffer(picture.constBits(), np.uint8) & 0xF8
    small = QImage(
        (shades | shades >> 5).tobytes(), picture.width(), picture.height(), picture.bytesPerLine(),
        QImage.Format.Format_RGB32,
    )  # fmt: skip
    small.save(str(path), None, _SMALLEST_FILE)


def _use_theme(window: Window, theme: Theme) -> None:
    if window.context.theme is not theme:
        window.context.choose_theme(theme)
        _wait(lambda: window.is_themed)


def _wait(is_so: Callable[[], bool]) -> None:
    give_up_s = monotonic() + PATIENCE_S
    while not is_so():
        if monotonic() > give_up_s:
            raise TimeoutError(
                f"the window was not ready within {PATIENCE_S / 60:g} min; use a less busy computer"
            )
        QApplication.processEvents(QEventLoop.ProcessEventsFlag.AllEvents, 20)


def _pass_ms(duration_ms: int) -> None:
    loop = QEventLoop()
    QTimer.singleShot(duration_ms, loop.quit)
    loop.exec()
