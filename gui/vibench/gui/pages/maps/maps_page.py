"""Maps: what is asked on the left; on the right the map as far as it has come, and the motion at a point."""

from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QLayout, QSplitter, QVBoxLayout, QWidget

from vibench.analysis import recorded_response
from vibench.analysis.dynamics import MOTION_CLASSES, RecordedLevel
from vibench.analysis.simulation.map_request import (
    MapPicture,
    MapRequest,
    MotionRequest,
    SettledMotion,
    settled_motion,
)
from vibench.analysis.simulation.progress import PartialResult, Trouble
from vibench.sim.background import Job

from ...forms.editor import Choice
from ...forms.model_form import JudgedForm
from ...page.app_context import AppContext
from ...page.page import Page, Shown, SideAndPicture
from ...page.simulator import Simulator
from ...widgets.boxes import boxed, column, row
from ...widgets.notice import Notice, NoticeKind
from ...widgets.page_names import MAPS, SIMULATE
from ...widgets.push_button import push_button
from ...widgets.units import SentenceLabel
from .map_plot import COLOURINGS, MapPlot, MotionView

MAP_SHARE = 640
"""Of 1000, of the height; the rest is for the motion at a point."""
DIGITS = 5
"""Of numbers that a zoom puts into the form."""


class MapsPage(Page):
    """One map at a time; what nobody wants any more is dropped."""

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self.form: JudgedForm[MapRequest] = JudgedForm(MapRequest, "map", frozenset({"described"}))
        self.map = MapPlot(context.theme)
        self.motion = MotionView(context.theme)
        self.simulator = Simulator(self, self._grow, self._end, self._die)
        self.picture: MapPicture | None = None
        self._asked: MapRequest | None = None
        self._point: tuple[float, float] | None = None
        self._job: Job | None = None
        self._motion_of: MotionRequest | None = None
        """What the motion that is shown was computed from."""
        self._levels: list[RecordedLevel] = []
        self._is_stale = False
        self._build()
        self.form.changed.connect(self._judge)
        self.map.picked.connect(self.pick)
        context.comparison_wanted.connect(self.add_recordings)
        self._judge()

    @property
    def is_done(self) -> bool:
        """Ticked once there is a whole map."""
        return self.picture is not None and not self.simulator.is_busy

    @property
    def said(self) -> str:
        """What stands below the map."""
        return self._state.text()

    @property
    def shown(self) -> tuple[Shown, ...]:
        """The map, of what was asked; the motion, of the point that was clicked."""
        return (
            Shown(self.map, self._asked, self.form.value),
            Shown(self.motion, self._motion_of, self._motion_wanted),
        )

    @property
    def _motion_wanted(self) -> MotionRequest | None:
        request = self.form.value
        if request is None or self._point is None:
            return None
        frequency_hz, amplitude_m = self._point
        return MotionRequest(
            **request.model_dump(include={"specimen", "model", "damping_time_s", "gap_m", "periods"}),
            described=request.described,
            frequency_hz=frequency_hz,
            amplitude_m=amplitude_m,
        )

    def refresh(self) -> None:
        """Draw what has come since the last time."""
        if self._is_stale and self.picture is not None:
            self._is_stale = False
            self.map.show_picture(self.picture, self.quantity.currentText())

    def left(self) -> None:
        """Keep how the page is divided."""
        self._parts.keep()

    def begin(self) -> None:
        """Compute what the form says."""
        request = self.form.value
        if request is None:
            return
        self._asked, self.picture = request, None
        self.map.clear()
        self._judge()
        self.simulator.begin(request)
        self._say("Computing; the first picture waits for the program to be made ready…")

    def begin_in_sight(self) -> None:
        """Compute the part that the axes show, with as many points as the whole had."""
        asked = self.form.value
        if asked is None:
            return
        (left, right), (low, high) = self.map.in_sight
        edges = {"start_hz": max(left, 1e-3), "stop_hz": right, "lowest_m": low, "highest_m": high}
        rounded = {name: float(f"{value:.{DIGITS}g}") for name, value in edges.items()}
        self.form.form.show_content({**self.form.form.content(), **rounded})
        self.begin()

    def cancel(self) -> None:
        """Stop at once; what has been found stays."""
        self.simulator.cancel()
        self._say("Cancelled; what had been found is shown.")

    def pick(self, frequency_hz: float, amplitude_m: float) -> None:
        """Show the motion at a point of the map."""
        if self.form.value is None or frequency_hz <= 0.0:
            return
        self._point = (frequency_hz, amplitude_m)
        asked = self._motion_wanted
        assert asked is not None
        self.map.mark(frequency_hz, amplitude_m)
        self.motion.said.setText("Following the motion…")
        self._open.setEnabled(True)
        self._judge()
        if self._job is not None:
            self._job.drop()
        self._job = self.context.background.ask(
            settled_motion, partial(self._show_motion, asked), self._fail, asked
        )

    def add_recordings(self, paths: object) -> None:
        """Lay the levels of recordings over the map, where they have one over frequency."""
        for path in paths if isinstance(paths, (list, tuple)) else ():
            self.context.background.ask(recorded_response, self._show_level, _let_pass, Path(path))

    def _grow(self, parts: tuple[PartialResult, ...]) -> None:
        for part in parts:
            match part:
                case MapPicture():
                    self.picture, self._is_stale = part, True
                    self._say(part.said)
                case Trouble():
                    self.context.say(Notice(NoticeKind.WARNING, part.sentence))
                case _:
                    pass

    def _end(self) -> None:
        self._say(self.said)

    def _die(self, what: str) -> None:
        self.context.say(
            Notice(NoticeKind.FAULT, what, "What had been found is shown.", "Compute again.", "SIMULATOR")
        )
        self._say("It broke off.")

    def _show_motion(self, asked: MotionRequest, motion: SettledMotion) -> None:
        self._motion_of = asked
        self.motion.show_motion(motion)
        self._judge()

    def _fail(self, error: BaseException) -> None:
        self._motion_of = None
        self.motion.show_nothing(str(error))
        self._judge()

    def _show_level(self, level: RecordedLevel) -> None:
        self._levels.append(level)
        self.map.show_level(level, len(self._levels) - 1)

    def _say(self, text: str) -> None:
        self._state.setText(text)
        self._cancel.setEnabled(self.simulator.is_busy)

    def _judge(self) -> None:
        wanted = self.form.value
        for button in (self._begin, self._finer):
            button.setEnabled(wanted is not None)
        if wanted is not None and self.picture is None:
            self.map.show_range((wanted.start_hz, wanted.stop_hz), (wanted.lowest_m, wanted.highest_m))
        self.map.setEnabled(self._asked in (None, wanted))
        self.motion.setEnabled(self._motion_of in (None, self._motion_wanted))

    def _recolour(self, *_: object) -> None:
        self._is_stale = True

    def _open_in_simulate(self) -> None:
        if self._point is not None:
            self.context.scene_wanted.emit(*self._point)
            self.context.page_wanted.emit(SIMULATE)

    def _build(self) -> None:
        self._parts = SideAndPicture(
            self.context, MAPS, boxed("Map", self.form), self._answer(), self._buttons()
        )
        QVBoxLayout(self).addWidget(self._parts)

    def _buttons(self) -> QLayout:
        self._begin = push_button("&Map", "Compute what the form says, in another process", self.begin)
        self._begin.setProperty("rank", "first")
        self._finer = push_button("Fi&ner", "Compute only what the axes show now", self.begin_in_sight)
        self._cancel = push_button("&Cancel", "Stop at once; what has been found stays", self.cancel)
        self._cancel.setEnabled(False)
        return row((self._begin, 1), (self._finer, 1), (self._cancel, 1))

    def _answer(self) -> QWidget:
        self.quantity = Choice()
        self.quantity.addItems(list(COLOURINGS))
        self.quantity.setAccessibleName("What the colours of the map say")
        self.quantity.currentIndexChanged.connect(self._recolour)
        self._state = SentenceLabel("Nothing has been computed yet.")
        self._state.setAccessibleName("How far the map is")
        self._open = push_button(
            "&Open in Simulate",
            "Simulate the surroundings of this point, with errors",
            self._open_in_simulate,
        )
        self._open.setEnabled(False)
        legend = QLabel(" ".join(_legend_entry(*each) for each in MOTION_CLASSES))
        legend.setWordWrap(True)
        legend.setAccessibleName("Colours of the kinds of motion")
        below = row(self.quantity, (self._state, 1), self._open)
        answer = QSplitter(Qt.Orientation.Vertical)
        answer.setAccessibleName("Map and motion")
        answer.addWidget(column(legend, (self.map, 1), below))
        answer.addWidget(self.motion)
        answer.setSizes([MAP_SHARE, 1000 - MAP_SHARE])
        answer.setChildrenCollapsible(False)
        return answer


def _legend_entry(name: str, colour: str) -> str:
    """Give a framed square, for some colours are those of the page, and a name that is never broken."""
    unbroken = name.replace(" ", "&nbsp;").replace("-", "&#8209;")
    return f'<span style="background:{colour}; color:#808080">☐</span>&nbsp;{unbroken}&nbsp;&nbsp;'


def _let_pass(_error: BaseException) -> None:
    """Say nothing: noise and dwells have no level over frequency, and Compare tells what cannot be read."""
