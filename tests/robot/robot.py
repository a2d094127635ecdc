"""The robot: its actions, and the checks after every action."""

import os
import signal
import sys
import time
import traceback
from collections import Counter, deque
from contextlib import suppress
from random import Random

from PySide6.QtCore import (
    QEventLoop,
    QMimeData,
    QPoint,
    QPointF,
    Qt,
    QTimer,
    QtMsgType,
    QUrl,
    qInstallMessageHandler,
)
from PySide6.QtGui import QDropEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QComboBox,
    QDialog,
    QFileDialog,
    QLineEdit,
    QTabBar,
    QTableView,
)

from vibench.acquisition import shipped
from vibench.acquisition.engine import DRIVING, EngineState
from vibench.acquisition.plan import Dwell, Measurement
from vibench.gui.page.app_context import AppContext, Settings
from vibench.gui.plots.plot import Plot
from vibench.gui.widgets.notice import TEST
from vibench.gui.window.window import PAGES, Window, application

from ..gui.forms.bad_values import BAD
from ..gui.geometry import wrongly_enabled

NASTY = (
    *BAD,
    *("2", "0.5", "260", "power:3", "rigid:2", "../..", "/", "/proc/self/mem", "a\x00b", "%s%n", "<b>x</b>"),
)
"""Values to type: numbers that no field takes, and texts that harm files, markup or formats."""
KEYS = tuple(
    getattr(Qt.Key, f"Key_{name}")
    for name in (
        *("Tab", "Backtab", "Return", "Space", "Escape", "F1", "F5", "F6", "Up", "Down", "Left", "Right"),
        *("Home", "End", "PageUp", "PageDown", "Delete", "Backspace", "Plus", "Minus", *"ADGLM", "Menu"),
    )
)
CHORDS = tuple(getattr(Qt.Key, f"Key_{name}") for name in (*"1234567ZTCAV", "Return"))
SIZES = ((1024, 700), (1280, 800), (1920, 1080), (2560, 1440), (400, 300))
STOPPED_S, LATE = 6.0, 8.0
"""Time from STOP to the end of the run [s], and its allowed factor on a busy computer."""
ANSWERED_S = 300.0
"""Time after which a page that does not respond counts as dead [s]; it includes compilation."""
LONGEST_DEED_S = 20.0
"""Longest allowed blocking of the event loop by one action, including other work [s]."""
TRACEBACK = "Traceback (most recent call last)"
DWELL = Dwell(amplitude_vpp=0.5, frequency_hz=180.0, settle_s=0.2, duration_s=600.0)


class Robot:
    """One window with a seed for random actions."""

    def __init__(self, seed, folder):
        self.random = Random(seed)
        self.seed, self.folder = seed, folder
        self.findings, self.done = [], Counter()
        self.errors = (folder / "stderr").open(errors="replace")
        self.recent = deque(maxlen=25)
        sys.excepthook = self._on_exception
        sys.unraisablehook = lambda told: self._on_exception(
            type(told.exc_value), told.exc_value, told.exc_traceback
        )
        qInstallMessageHandler(self._log_qt)
        self.app = application(["robot"])
        self.context = AppContext(Settings(folder / "window.ini"))
        self.context.choose_folder(folder / "recordings")
        self.window = Window(self.context, PAGES)
        self.window.close = lambda: False
        self.window.show()
        self._modals = QTimer(interval=300)
        # A separate single shot, since the timer would wait for a slot that itself opens a dialog.
        self._modals.timeout.connect(lambda: QTimer.singleShot(0, self._close_modal))
        self._modals.start()
        self.deeds = {
            self.press_key: 8, self.press_chord: 4, self.click: 8, self.type_value: 6, self.choose: 3,
            self.point_at_plot: 3, self.drop_file: 1, self.harm_files: 1, self.resize: 0.5,
            self.open_bench: 1.5, self.arm_and_start: 2, self.stop: 1.5,
            self.kill_engine: 0.15, self.pause_engine: 0.3, self.visit: 2, self.wait: 3,
        }  # fmt: skip

    def work(self, duration_s):
        """Do random things for a duration; every two minutes check that each page responds."""
        until_s = time.monotonic() + duration_s
        answered_s = time.monotonic() + 60.0
        while time.monotonic() < until_s and len(self.findings) < 5:
            deed = self.random.choices(list(self.deeds), list(self.deeds.values()))[0]
            self.do(deed)
            if time.monotonic() > answered_s:
                self.every_page_answers()
                answered_s = time.monotonic() + 120.0
        self.every_page_answers()

    def do(self, deed):
        """Do one thing, process events, and check the window."""
        begun_s = time.monotonic()
        self.recent.append(deed.__name__)
        self.done[deed.__name__] += 1
        try:
            deed()
        except RuntimeError as error:  # the widget was deleted while it was being clicked
            if "deleted" not in str(error):
                raise
        self.live(20)
        self.read_errors()
        if (
            deed not in (self.stop, self.wait, self.pause_engine)
            and time.monotonic() - begun_s > LONGEST_DEED_S
        ):
            self.find(f"the window was held up for {time.monotonic() - begun_s:.1f} s")
        self.look()

    def read_errors(self):
        """Report unexpected errors of any process, also of engines and worker processes."""
        said = self.errors.read()
        if TRACEBACK in said:
            self.find(said[said.index(TRACEBACK) :][-1500:])

    def look(self):
        """Report results that belong to other inputs."""
        for name, page in self.window.pages.items():
            for shown in page.displayed_results:
                for widget in wrongly_enabled(shown):
                    self.find(
                        f"{name}: {widget.accessibleName() or type(widget).__name__} shows "
                        f"{str(shown.inputs)[:300]} while {str(shown.wanted())[:300]} is asked for"
                    )

    def find(self, what):
        """Record a finding."""
        if not any(what.partition(" shows ")[0] in each for each in self.findings):
            self.findings.append(f"{what}\n    after {', '.join(self.recent)}")
            print(f"FOUND: {self.findings[-1]}", flush=True)

    def close(self):
        """Close the window and return the findings as text."""
        self._modals.stop()
        self.context.bridge.close()
        self.context.background.close()
        for each in self.app.topLevelWidgets():
            each.hide()
        count = sum(self.done.values())
        said = [
            f"seed {self.seed}: {count} deeds ({', '.join(f'{n} {k}' for k, n in self.done.most_common())})"
        ]
        return "\n".join([*said, *(f"  FOUND: {each}" for each in self.findings or ["nothing"])])

    def live(self, duration_ms):
        """Process events for a duration."""
        loop = QEventLoop()
        QTimer.singleShot(duration_ms, loop.quit)
        loop.exec()

    # Actions

    def press_key(self):
        self._press(self.random.choice(KEYS), Qt.KeyboardModifier.NoModifier)

    def press_chord(self):
        self._press(self.random.choice(CHORDS), Qt.KeyboardModifier.ControlModifier)

    def click(self):
        buttons = [each for each in self._visible(QAbstractButton) if each.isEnabled()]
        tabs = [each for each in self._visible(QTabBar) if each.count()]
        if tabs and self.random.random() < 0.2:
            bar = self.random.choice(tabs)
            bar.setCurrentIndex(self.random.randrange(bar.count()))
        elif buttons:
            button = self.random.choice(buttons)
            self.recent.append(f"[{button.text()}]")
            QTest.mouseClick(button, Qt.MouseButton.LeftButton)

    def type_value(self):
        fields = [each for each in self._visible(QLineEdit) if each.isEnabled() and not each.isReadOnly()]
        if fields:
            field, text = self.random.choice(fields), self.random.choice(NASTY)
            self.recent.append(f"[{(field.parentWidget() or field).accessibleName()}={text[:20]!r}]")
            field.setFocus()
            field.selectAll()
            field.insert(text)
            QTest.keyClick(field, self.random.choice((Qt.Key.Key_Return, Qt.Key.Key_Tab)))

    def choose(self):
        boxes = [each for each in self._visible(QComboBox) if each.isEnabled() and each.count()]
        if boxes:
            box = self.random.choice(boxes)
            row = self.random.randrange(box.count())
            self.recent.append(f"[{box.accessibleName()}={box.itemText(row)}]")
            box.setCurrentIndex(row)
            box.activated.emit(row)
        tables = [each for each in self._visible(QTableView) if each.model() and each.model().rowCount()]
        if tables:
            table = self.random.choice(tables)
            table.selectRow(self.random.randrange(table.model().rowCount()))

    def point_at_plot(self):
        plots = self._visible(Plot)
        if plots:
            plot = self.random.choice(plots)
            at = QPoint(self.random.randrange(plot.width() + 1), self.random.randrange(plot.height() + 1))
            QTest.mouseMove(plot.viewport(), at)
            button = self.random.choice((Qt.MouseButton.LeftButton, Qt.MouseButton.MiddleButton))
            QTest.mouseClick(plot.viewport(), button, Qt.KeyboardModifier.NoModifier, at)
            for action in self.random.sample(plot.actions(), 2):
                action.trigger()

    def drop_file(self):
        files = [*self.context.folder.rglob("*.*"), shipped("campaigns/quick.toml"), self.folder]
        data = QMimeData()
        data.setUrls([QUrl.fromLocalFile(str(self.random.choice(files)))])
        event = QDropEvent(
            QPointF(9, 9),
            Qt.DropAction.CopyAction,
            data,
            Qt.MouseButton.LeftButton,
            Qt.KeyboardModifier.NoModifier,
        )
        self.window.dropEvent(event)

    def harm_files(self):
        folder = self.context.folder
        folder.mkdir(parents=True, exist_ok=True)
        found = sorted(each for each in folder.rglob("*") if each.is_file())
        if found and self.random.random() < 0.5:
            self.random.choice(found).unlink(missing_ok=True)
        else:
            ending = self.random.choice(("h5", "h5.part", "toml", "txt"))
            (folder / f"junk_{self.random.randrange(9)}.{ending}").write_bytes(self.random.randbytes(200))

    def resize(self):
        self.window.resize(*self.random.choice(SIZES))

    def visit(self):
        self.window.show_page(self.random.choice(list(self.window.pages)))

    def wait(self):
        self.live(self.random.choice((100, 500, 2000)))

    def open_bench(self):
        if self.context.bridge.state in (EngineState.CLOSED, EngineState.FAULT):
            rig = self.window.pages["Rig"]
            rig.choice.choose(shipped("hardware_configs/virtual_rig.toml"))
            rig.open_bench()

    def arm_and_start(self):
        if self.context.bridge.state is EngineState.READY:
            self.context.selection.choose_measurement(Measurement(name="robot", ramp_s=0.3, excitation=DWELL))
            self.window.user_actions.arm_test()
            self.window.pages[TEST].form.show_value(Measurement(name="robot", ramp_s=0.3, excitation=DWELL))
        elif self.context.bridge.state is EngineState.ARMED:
            self.window.user_actions.start()

    def stop(self):
        """Press STOP or Esc, and require the end of the run in time."""
        bridge = self.context.bridge
        if bridge.state not in (EngineState.RUNNING, EngineState.HELD):
            return
        begun_s, ramp_s = time.monotonic(), 10.0
        if self.random.random() < 0.5:
            QTest.keyClick(self._target(), Qt.Key.Key_Escape)
            ramp_s = 0.5
        else:
            self.window.banner.stop_requested.emit()
        late = LATE if os.getloadavg()[0] > (os.cpu_count() or 1) else 1.0
        while bridge.state in DRIVING and time.monotonic() - begun_s < late * STOPPED_S + ramp_s:
            self.live(20)
        if bridge.state in DRIVING:
            self.find(f"still {bridge.state} {time.monotonic() - begun_s:.1f} s after STOP")

    def kill_engine(self):
        if self.context.bridge.engine_pid is not None:
            os.kill(self.context.bridge.engine_pid, signal.SIGKILL)

    def pause_engine(self):
        pid = self.context.bridge.engine_pid
        if pid is not None:
            os.kill(pid, signal.SIGSTOP)
            self.live(self.random.choice((300, 1500)))
            with suppress(ProcessLookupError):  # the keep-alive process may have ended the engine meanwhile
                os.kill(pid, signal.SIGCONT)

    # Requirements of every page

    def every_page_answers(self):
        """Require that the Test page shows a preview, the Queue page a summary, and a bench opens."""
        self.recent.append("every_page_answers")
        page, before = self.window.pages[TEST], self.context.bridge.state
        self.window.pages["Rig"].choice.choose(shipped("hardware_configs/virtual_rig.toml"))
        level = 0.1 + 0.001 * sum(self.done.values())
        page.form.show_value(
            Measurement(
                name="alive", excitation=DWELL.model_copy(update={"amplitude_vpp": level, "duration_s": 2.0})
            )
        )
        self._until(lambda: page.is_done, f"the Test page does not answer: {page.summary.text()}")
        self.window.pages["Queue"].open_file(shipped("campaigns/quick.toml"))
        queue = self.window.pages["Queue"]
        self._until(lambda: not queue.summary.text().endswith("…"), "the Queue page does not answer")
        if before in (EngineState.CLOSED, EngineState.FAULT):
            self.open_bench()
            self._until(lambda: self.context.bridge.state is EngineState.READY, "no bench opens any more")

    def _until(self, is_so, what):
        begun_s = time.monotonic()
        while not is_so():
            self.live(50)
            if time.monotonic() - begun_s > ANSWERED_S:
                self.find(what)
                return

    # Tools

    def _visible(self, kind):
        top = QApplication.activeModalWidget() or self.window
        return [each for each in top.findChildren(kind) if each.isVisible()]

    def _target(self):
        return QApplication.activePopupWidget() or QApplication.focusWidget() or self.window

    def _press(self, key, modifier):
        self.recent.append(f"[{key.name}]")
        QTest.keyClick(self._target(), key, modifier)

    def _close_modal(self):
        """Close popups and dialogs; file dialogs sometimes get a value first."""
        popup = QApplication.activePopupWidget()
        if popup is not None:
            popup.close()
        dialog = QApplication.activeModalWidget()
        if not isinstance(dialog, QDialog):
            return
        if isinstance(dialog, QFileDialog) and self.random.random() < 0.5:
            for line in dialog.findChildren(QLineEdit)[:1]:
                line.setText(str(self.folder / f"chosen_{self.random.randrange(5)}"))
            dialog.accept()
        if dialog.isVisible():
            dialog.reject()

    def _on_exception(self, kind, error, trace):
        if issubclass(kind, KeyboardInterrupt):
            sys.__excepthook__(kind, error, trace)
            os._exit(2)
        self.find("".join(traceback.format_exception(kind, error, trace))[-1500:])

    def _log_qt(self, kind, _where, text):
        if kind in (QtMsgType.QtCriticalMsg, QtMsgType.QtFatalMsg):
            self.find(f"Qt: {text}")
