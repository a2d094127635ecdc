"""The main window: banner with STOP, messages, navigation bar, pages, status line."""

import gc
import sys
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from importlib import import_module
from pathlib import Path
from threading import Thread
from time import monotonic

import matplotlib as mpl
from PySide6.QtCore import QCoreApplication, QEvent, Qt, QTimer, Signal
from PySide6.QtGui import QCloseEvent, QDragEnterEvent, QDropEvent, QFont, QFontDatabase, QShowEvent
from PySide6.QtWidgets import (
    QApplication,
    QLabel,
    QListWidget,
    QListWidgetItem,
    QMainWindow,
    QMessageBox,
    QSizePolicy,
    QStackedWidget,
    QStyleFactory,
    QVBoxLayout,
    QWidget,
)

from vibench.acquisition import ConfigurationError, printable
from vibench.acquisition.engine import CampaignRequest, unattended_engine

from ..background import in_next_pass
from ..engine_link import Urgency
from ..page.app_context import AppContext, SettingKey, Settings, default_settings_path
from ..page.page import Page, file_kind
from ..page.user_actions import UserActions
from ..pages.compare.compare_page import ComparePage
from ..pages.files.files_page import FilesPage
from ..pages.maps import MapsPage
from ..pages.queue.queue_page import QueuePage
from ..pages.rig import RigPage
from ..pages.run.run_page import RunPage
from ..pages.simulate.simulate_page import SimulatePage
from ..pages.test.test_page import TestPage
from ..widgets.boxes import fill_box, row
from ..widgets.notice import (
    COMPARE,
    FILES,
    MAPS,
    QUEUE,
    RIG,
    RUN,
    SIMULATE,
    TEST,
    Notice,
    NoticeKind,
)
from ..widgets.theme import Theme, palette, style_sheet
from .banner import NEXT_STEPS, Banner, MessageStrip, StatusField, StatusLine, indicator_of, status_fields
from .event_loop_monitor import EventLoopMonitor
from .menus import AbortKey, build_menus

PAGES: Mapping[str, Callable[[AppContext], Page]] = {
    RIG: RigPage,
    TEST: TestPage,
    RUN: RunPage,
    FILES: FilesPage,
    COMPARE: ComparePage,
    SIMULATE: SimulatePage,
    QUEUE: QueuePage,
    MAPS: MapsPage,
}
"""Pages in the order of the navigation bar; Ctrl and a number selects a page."""


DONE = "✔"


class NavigationBar(QListWidget):
    """List of the pages; selecting a page shows it."""

    chosen = Signal(str)

    def __init__(self, names: tuple[str, ...]) -> None:
        super().__init__()
        self.setObjectName("rail")
        self.setAccessibleName("Pages")
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Expanding)
        self._names = names
        self._done: dict[str, bool] = {}
        for number, name in enumerate(names, start=1):
            item = QListWidgetItem()
            item.setToolTip(f"{name} page (Ctrl+{number})")
            self.addItem(item)
        self.show_done({})
        self.currentRowChanged.connect(self._emit_choice)

    def choose(self, name: str) -> None:
        """Select the page ``name`` in the list; the window already shows this page."""
        self.setCurrentRow(self._names.index(name))

    def show_done(self, done: dict[str, bool]) -> None:
        """Show a tick beside each finished page."""
        if done == self._done and self.item(0).text():
            return
        self._done = done
        for place, name in enumerate(self._names):
            tick = DONE if done.get(name) else " "
            self.item(place).setText(f"{place + 1}  {name}  {tick}")
            spoken = f"{name}, done" if done.get(name) else name
            self.item(place).setData(Qt.ItemDataRole.AccessibleTextRole, spoken)
        self._fit()

    def changeEvent(self, event: QEvent) -> None:
        """Apply a change of the font at once."""
        super().changeEvent(event)
        if event.type() is QEvent.Type.FontChange and self.count():
            self._fit()

    def _fit(self) -> None:
        """Fit the width to the longest name in bold with a tick, as shown for a selected page."""
        bold = self.font()
        bold.setBold(True)
        metrics = self.fontMetrics()
        longest = max(self._names, key=metrics.horizontalAdvance)
        em = metrics.height()
        self.setFixedWidth(round(metrics.horizontalAdvance(f"8  {longest}  {DONE}") * 1.15) + 2 * em)

    def _emit_choice(self, row: int) -> None:
        if row >= 0:
            self.chosen.emit(self._names[row])


SPAN_S = 1.0
"""Averaging time of the frame rate [s]."""
MOST_DROPPED = 20
"""Largest number of files that are opened when they are dropped together."""
TICK_MS = 50
"""Interval between updates of the window [ms]; a shorter one uses a whole core, a longer one looks jerky."""


class Window(QMainWindow):
    """The main window; its pages and its banner show the engine's state at every tick."""

    def __init__(self, context: AppContext, pages: Mapping[str, Callable[[AppContext], Page]]) -> None:
        super().__init__()
        self.context = context
        self.setWindowTitle("vibench")
        self.banner = Banner()
        self.strip = MessageStrip()
        self.status_line = StatusLine()
        self.pages: dict[str, Page] = {name: make(context) for name, make in pages.items()}
        self.navigation = NavigationBar(tuple(self.pages))
        self.navigation.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self._stack = QStackedWidget()
        self._unthemed: list[Callable[[], None]] = []
        for name, page in self.pages.items():
            page.setAccessibleName(f"{name} page")
            self._stack.addWidget(page)
        body = row(self.navigation, (self._stack, 1))
        body.setSpacing(0)
        middle = QWidget()
        layout = fill_box(QVBoxLayout(middle), self.banner, self.strip, (body, 1), self.status_line, margin=0)
        layout.setSpacing(0)
        self.setCentralWidget(middle)
        self.user_actions = UserActions(context, self)
        self.setAcceptDrops(True)
        build_menus(self)
        self._connect()
        self._restore()
        self._timer = QTimer(self, interval=TICK_MS)
        self._timer.timeout.connect(self.tick)
        self._timer.start()
        self._drawn_s: deque[float] = deque()
        self.event_loop_monitor = EventLoopMonitor(lambda: self.page.accessibleName(), self)  # noqa: PLW0108 - the page that is then visible

    @property
    def page(self) -> Page:
        """The visible page."""
        page = self._stack.currentWidget()
        assert isinstance(page, Page)
        return page

    def show_page(self, name: str) -> None:
        """Show the page ``name``, and store it as the page to open next time."""
        page = self.pages.get(name)
        if page is None or page is self._stack.currentWidget():
            return
        self.page.leave()
        self._stack.setCurrentWidget(page)
        self.navigation.choose(name)
        self.context.settings.keep_text(SettingKey.PAGE, name)
        page.enter()
        page.refresh()

    def tick(self) -> None:
        """Update the visible page, and report to the engine that the window is alive."""
        self.context.bridge.tick()
        status = self.context.bridge.status
        self.banner.show_indicator(indicator_of(status, self.context.bridge.is_ordering))
        self.strip.hint(NEXT_STEPS[self.context.bridge.state])
        now_s = monotonic()
        self._drawn_s.append(now_s)
        while now_s - self._drawn_s[0] > SPAN_S:
            self._drawn_s.popleft()
        frames = len(self._drawn_s) / SPAN_S
        self.status_line.show_fields(*status_fields(status, frames, self.event_loop_monitor.longest_s))
        self.status_line.explain(StatusField.FRAMES, self.event_loop_monitor.text)
        self.page.refresh()
        self.navigation.show_done({name: page.is_done for name, page in self.pages.items()})

    def closeEvent(self, event: QCloseEvent) -> None:
        """Ask the user before closing during a run; on closing, end the engine and store the layout."""
        how = self._how_to_close()
        if how is None:
            event.ignore()
            return
        self._timer.stop()
        self.event_loop_monitor.stop()
        self.context.bridge.close(how)
        self.page.leave()
        self.context.settings.keep_state(SettingKey.GEOMETRY, self.saveGeometry())
        self.context.background.close()
        super().closeEvent(event)

    def adopt_left_campaign(self) -> None:
        """If another window left an engine and its campaign running, take them over."""
        self.context.background.ask(unattended_engine, self.context.bridge.adopt, self.context.fail)

    def _show_adopted(self, request: CampaignRequest) -> None:
        """Show a campaign that was taken over, as if it had been armed in this window."""
        self.context.selection.choose_rig(self.context.bridge.rig)
        self.context.selection.choose_campaign(request.campaign)
        self.context.say(
            Notice(
                NoticeKind.INFO,
                f"The campaign {request.campaign.name} was left to run unattended and continues.",
                "It is shown here.",
                "STOP ramps down as planned; Esc aborts.",
            )
        )
        self.show_page(RUN)

    def _how_to_close(self) -> Urgency | None:
        """Ask how to close while a measurement runs; None means that the window stays open."""
        if not self.context.bridge.is_driving:
            return Urgency.END
        box = QMessageBox(QMessageBox.Icon.Question, "A measurement is running", "", parent=self)
        box.setText("Ramp down, keep the recording, and close the window?")
        stop = box.addButton("Ramp down and close", QMessageBox.ButtonRole.AcceptRole)
        leave = None
        if self.context.bridge.may_leave:
            leave = box.addButton("Continue it and close", QMessageBox.ButtonRole.DestructiveRole)
            box.setInformativeText(
                "The campaign was armed to run unattended: 'vibench watch' or a new window shows it; "
                "'vibench stop' ends it."
            )
        box.setDefaultButton(box.addButton(QMessageBox.StandardButton.Cancel))
        box.exec()
        if box.clickedButton() is stop:
            return Urgency.END
        return Urgency.LEAVE if leave is not None and box.clickedButton() is leave else None

    def _connect(self) -> None:
        self.navigation.chosen.connect(self.show_page)
        self.context.page_requested.connect(self.show_page)
        self.context.noticed.connect(self.strip.say)
        self.context.theme_changed.connect(self._retheme)
        application = QApplication.instance()
        assert isinstance(application, QApplication)
        self.abort_key = AbortKey(application, self)
        self.abort_key.pressed.connect(self.user_actions.abort)
        self.banner.stop_requested.connect(self.user_actions.stop)
        self.context.bridge.armed.connect(lambda _plan: self.show_page(RUN))
        self.context.bridge.adopted.connect(self._show_adopted)
        self.context.bridge.advanced.connect(self.strip.dismiss)

    def _restore(self) -> None:
        self.resize(1280, 800)
        geometry = self.context.settings.state(SettingKey.GEOMETRY)
        if not geometry.isEmpty():
            self.restoreGeometry(geometry)
        first = next(iter(self.pages))
        wanted = self.context.settings.text(SettingKey.PAGE, first)
        name = wanted if wanted in self.pages else first
        self._stack.setCurrentWidget(self.pages[name])
        self.navigation.choose(name)
        self._prepare_theme(self.context.theme)
        while self._unthemed:
            self._unthemed.pop(0)()

    def _retheme(self, theme: Theme) -> None:
        """Change the colours: first of the frame, then page by page, so that the window stays responsive."""
        self._prepare_theme(theme)
        in_next_pass(self, self._theme_next)

    def _prepare_theme(self, theme: Theme) -> None:
        application = QApplication.instance()
        assert isinstance(application, QApplication)
        application.setPalette(palette(theme))
        sheet = style_sheet(theme)
        # Set style sheets part by part: setting one for the application blocks the event loop for 0.3 s.
        for part in (self.banner, self.strip, self.navigation, self.status_line):
            part.setStyleSheet(sheet)
        in_sight = self._stack.currentWidget()
        assert in_sight is not None
        # Paint the page once at the end instead of after every step.
        in_sight.setUpdatesEnabled(False)
        pages = sorted(self.pages.values(), key=lambda each: each is not in_sight)
        self._unthemed = [
            step
            for page in pages
            for step in (
                partial(page.retheme, theme),
                *(partial(part.setStyleSheet, sheet) for part in page.styled_parts),
                partial(page.setUpdatesEnabled, True),
            )
        ]

    @property
    def is_themed(self) -> bool:
        """Whether all pages have the colours of the theme."""
        return not self._unthemed

    def _theme_next(self) -> None:
        if self._unthemed:
            self._unthemed.pop(0)()
            self.context.bridge.heartbeat()
            in_next_pass(self, self._theme_next)

    def showEvent(self, event: QShowEvent) -> None:
        """Focus the button for the next step on the visible page; otherwise STOP would have the focus."""
        super().showEvent(event)
        self.navigation.setFocus()
        self.page.enter()

    def changeEvent(self, event: QEvent) -> None:
        """Apply a change of the font; parts that have a style sheet need a new style sheet."""
        super().changeEvent(event)
        if event.type() is QEvent.Type.FontChange and self.isVisible():
            self._retheme(self.context.theme)

    def undo(self) -> None:
        """Undo the last edit of the plan on the visible page."""
        self.page.edits.undo()

    def redo(self) -> None:
        """Redo the last undone edit."""
        self.page.edits.redo()

    def open_path(self, path: Path) -> None:
        """Open a file or folder on the page for files of its kind."""
        try:
            kind = file_kind(path)
        except ConfigurationError as error:
            self.context.fail(error)
            return
        name, act = next((name, page.opens[kind]) for name, page in self.pages.items() if kind in page.opens)
        self.show_page(name)
        self.context.note_file(path)
        act(path)

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Accept a drag onto the window if the drag contains files."""
        if event.mimeData().hasUrls():
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """Open the files that were dropped onto the window."""
        paths = [Path(url.toLocalFile()) for url in event.mimeData().urls() if url.isLocalFile()]
        for path in paths[:MOST_DROPPED]:
            self.open_path(path)
        event.acceptProposedAction()

    def reset_layout(self) -> None:
        """Restore the default layout of the window."""
        self.context.settings.forget_layout()
        self.showNormal()
        self.resize(1280, 800)


FONT_FILES = ("DejaVuSans.ttf", "DejaVuSans-Bold.ttf", "DejaVuSansMono.ttf")
FONT_POINTS = 10
SMALLEST_POINTS, LARGEST_POINTS = 7, 24


def application(arguments: list[str]) -> QApplication:
    """Return the application, with the same style and font on every computer."""
    existing = QCoreApplication.instance()
    if existing is None:
        QApplication.setHighDpiScaleFactorRoundingPolicy(Qt.HighDpiScaleFactorRoundingPolicy.PassThrough)
        existing = QApplication(arguments)
    assert isinstance(existing, QApplication)
    existing.setApplicationName("vibench")
    existing.setStyle(QStyleFactory.create("Fusion"))
    # DejaVu Sans has all required characters and is installed with matplotlib.
    folder = Path(mpl.get_data_path()) / "fonts" / "ttf"
    for name in FONT_FILES:
        QFontDatabase.addApplicationFont(str(folder / name))
    existing.setFont(QFont("DejaVu Sans", FONT_POINTS))
    return existing


def open_window(bench: Path | None, settings: Path | None, starting: QLabel | None = None) -> int:
    """Show the window in place of the label ``starting`` until it is closed; return the exit code."""
    app = application(["vibench"])
    stored = Settings(settings or default_settings_path())
    context = AppContext(stored)
    context.first_bench = None if bench is None else bench.resolve()
    font = app.font()
    font.setPointSize(int(stored.number(SettingKey.FONT, FONT_POINTS, SMALLEST_POINTS, LARGEST_POINTS)))
    app.setFont(font)
    window = Window(context, PAGES)
    # Garbage collection blocks the event loop, so exempt existing objects.
    gc.freeze()
    window.show()
    if starting is not None:
        starting.close()
    QTimer.singleShot(0, window.context.background.prepare)
    QTimer.singleShot(0, window.adopt_left_campaign)
    QTimer.singleShot(0, Thread(target=load_ahead).start)
    code = app.exec()
    if complaint := stored.complaint:
        sys.stderr.write(f"{printable(complaint)}\n")
        code = code or 1
    return code


def load_ahead() -> None:
    """Import the modules for the first prediction and its curves, after the window has been painted."""
    import_module("scipy.signal")
    getattr(import_module("vibench.analysis"), "MeasurementPrediction")  # noqa: B009
