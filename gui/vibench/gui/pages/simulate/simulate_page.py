"""The Simulate page: a form for the scene, its computing time, and curves drawn as they are computed."""

import json
import os
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

from PySide6.QtWidgets import QLayout, QTabWidget, QVBoxLayout, QWidget

from vibench.analysis import Curve
from vibench.analysis.dynamics import (
    BranchDiagram,
    BranchRequest,
    ChainAnswer,
    ChainRequest,
    ExponentSpectrum,
    SpectrumRequest,
)
from vibench.analysis.prediction.progress import (
    MOTION_COLUMNS,
    PartialResult,
    SimulationProgress,
    SimulationRequest,
    Trouble,
    cost_sentences,
)
from vibench.analysis.prediction.worker import Asked
from vibench.sim import count_text

from ...forms.model_form import ValidatedForm
from ...page.app_context import AppContext, SettingKey
from ...page.page import DisplayedResult, Page, SideAndPicture, Simulator
from ...widgets.boxes import TimedBar, column, fill_box, push_button, row, titled_box
from ...widgets.notice import COMPARE, SIMULATE
from ...widgets.read_table import ReadTable
from ...widgets.units import SentenceLabel
from .pictures import AnswerPlots, BranchPicture, ChainPicture, SpectrumPicture

Request = TypeVar("Request", bound=BranchRequest | SpectrumRequest | ChainRequest)
Answer = TypeVar("Answer", bound=BranchDiagram | ExponentSpectrum | ChainAnswer)
Shown_contra = TypeVar("Shown_contra", contravariant=True)


class AnswerPicture(Protocol[Shown_contra]):
    """Widget with plots that can draw a complete or partial result."""

    @property
    def widget(self) -> QWidget:
        """Widget that contains the plots."""

    def show_answer(self, answer: Shown_contra) -> None:
        """Draw a result."""


@dataclass(frozen=True)
class DynamicsKind(Generic[Request, Answer]):
    """Description of one kind of tab: type of the request, and functions that describe the result."""

    name: str
    request: type[Request]
    hidden: frozenset[str]
    """Fields of the request that the form does not show."""
    answer: Callable[..., Answer]
    """Class of the result, built from request, partial results and elapsed time [s]."""
    before: str
    """Text about computing time and error, shown until there is a result."""
    curves: Callable[[Answer], tuple[Curve, ...]] = lambda _: ()


@dataclass
class _Course:
    request: Asked
    began: float
    parts: list[PartialResult] = field(default_factory=list)
    troubles: list[str] = field(default_factory=list)


class DynamicsView(QWidget, Generic[Request, Answer]):
    """Form on the left; plots on the right, with computing time and error below the plots."""

    def __init__(
        self, context: AppContext, kind: DynamicsKind[Request, Answer], picture: AnswerPicture[Answer]
    ) -> None:
        super().__init__()
        self.context, self.kind, self.picture = context, kind, picture
        self.setAccessibleName(kind.name.capitalize())
        self.form: ValidatedForm[Request] = ValidatedForm(kind.request, kind.name, kind.hidden)
        self.simulator = Simulator(self, context, self._grow, self._end, self._show_text)
        self.answer: Answer | None = None
        self.result = DisplayedResult(lambda: self.form.value, picture.widget)
        self._course: _Course | None = None
        self._is_stale = False
        name = kind.name.capitalize()
        parts = SideAndPicture(context, name, self._side(), self._right(), self._buttons())
        fill_box(QVBoxLayout(self), parts)
        self.form.changed.connect(self._validate)
        self._validate()

    def refresh(self) -> None:
        """Draw the partial results that arrived since the last tick."""
        if self._is_stale and self.answer is not None:
            self._is_stale = False
            self.picture.show_answer(self.answer)

    def begin(self) -> None:
        """Start to compute the request that the form describes."""
        request = self.form.value
        if request is None:
            return
        self._course = _Course(request, time.perf_counter())
        self.result.show(request)
        self._take(())
        self.simulator.begin(request)

    def _grow(self, parts: tuple[PartialResult, ...]) -> None:
        self._take(parts)
        self._show_text("Looking…")

    def _take(self, parts: tuple[PartialResult, ...]) -> None:
        course = self._course
        if course is None:
            return
        course.troubles += [part.sentence for part in parts if isinstance(part, Trouble)]
        course.parts += [part for part in parts if not isinstance(part, Trouble)]
        elapsed_s = time.perf_counter() - course.began
        self.answer = self.kind.answer(course.request, tuple(course.parts), elapsed_s)
        self._is_stale = True

    def _end(self) -> None:
        self._take(())
        self._show_text("Complete.")
        if self._course is not None and self._course.troubles:
            self.context.warn(self._course.troubles[0])

    def _show_text(self, text: str) -> None:
        has_nothing = self.simulator.is_busy and (self._course is None or not self._course.parts)
        cost = "" if self.answer is None or has_nothing else self.answer.cost_sentence
        self.summary.setText(f"{text} {cost}")
        self._compare.setEnabled(self.answer is not None and bool(self.kind.curves(self.answer)))

    def _validate(self) -> None:
        self._begin.setEnabled(self.form.value is not None)
        self.result.mark()

    def _hand_to_compare(self) -> None:
        if self.answer is not None:
            self.context.prediction_made.emit(self.kind.curves(self.answer))
            self.context.page_requested.emit(COMPARE)

    def _side(self) -> QWidget:
        scene, before = titled_box("Scene", self.form), SentenceLabel(self.kind.before, rank="second")
        return column(scene, before, 1)

    def _buttons(self) -> QLayout:
        self._begin = push_button("Find", "Start the computation in a separate process", self.begin, "first")
        self.simulator.cancel_button.setText("Cancel")  # no shortcut Alt+C: another tab uses it
        return row((self._begin, 1), self.simulator.cancel_button)

    def _right(self) -> QWidget:
        self.summary = SentenceLabel("Nothing has been computed yet.")
        self.summary.setAccessibleName(f"State, cost and error of the {self.kind.name}")
        self._compare = push_button(
            "Overlay on recordings", "Show these curves on the Compare page", self._hand_to_compare
        )
        self._compare.setEnabled(False)
        return column((self.picture.widget, 1), row((self.summary, 1), self._compare))


BRANCHES = DynamicsKind(
    name="branches",
    request=BranchRequest,
    hidden=frozenset({"resonance_band_hz", "phase_of", "loop_time_s", "recorded_level", "described"}),
    answer=BranchDiagram,
    curves=BranchDiagram.curves,
    before=(
        "A search simulates every start for 300 drive periods. A branch takes one to several seconds. "
        "Each motion is shown with its error (docs/branches.md)."
    ),
)
SPECTRUM = DynamicsKind(
    name="exponents",
    request=SpectrumRequest,
    hidden=frozenset({"described"}),
    answer=ExponentSpectrum,
    before=(
        "At each point, six perturbations are integrated over the whole duration. The sum of the exponents "
        "is known from the damping and is used as a check (docs/branches.md)."
    ),
)
CHAIN = DynamicsKind(
    name="chain",
    request=ChainRequest,
    hidden=frozenset({"others", "described"}),
    answer=ChainAnswer,
    before=(
        "Waves are computed without a simulation. With contacts, one simulated second takes a few "
        "hundredths of a second for 8 cells and a third of a second for 64. The error of contacts follows "
        "the accuracy; energies have a standard error (docs/chains.md)."
    ),
)


_LINES = 6
"""Height of the table of motions, in lines of text including the heading."""


class SimulatePage(Page):
    """Form on the left, results on the right."""

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self.form: ValidatedForm[SimulationRequest] = ValidatedForm(
            SimulationRequest, "simulation", frozenset({"described"})
        )
        self.plots = AnswerPlots(context.theme)
        self.simulator = Simulator(self, context, self._grow, self._end, self._say_progress)
        self.progress: SimulationProgress | None = None
        self._is_stale = False
        self._undrawn: list[Callable[[], None]] = []
        self.branches = DynamicsView(context, BRANCHES, BranchPicture(context.theme))
        self.spectrum = DynamicsView(context, SPECTRUM, SpectrumPicture(context.theme))
        self.chain = DynamicsView(context, CHAIN, ChainPicture(context.theme))
        self._views = (self.branches, self.spectrum, self.chain)
        self._result = DisplayedResult(lambda: self.form.value, self.plots)
        self.displayed_results = (self._result, *(view.result for view in self._views))
        self._build()
        self.form.changed.connect(self._say_cost)
        context.scene_requested.connect(self.show_scene)
        with suppress(ValueError):  # the stored scene may be of another version, or edited by a user
            self.form.form.show_content(dict(json.loads(context.settings.text(SettingKey.SCENES))))
        if self.form.value is None:
            self.form.form.show_content({})
        self._say_cost()
        self._say_progress("Nothing has been simulated yet.")

    @property
    def is_done(self) -> bool:
        """Whether a simulation is complete."""
        return self.progress is not None and not self.simulator.is_busy and self.progress.done > 0

    def refresh(self) -> None:
        """Draw the results that arrived since the last tick, one plot per tick."""
        if self._is_stale and not self._undrawn:
            self._is_stale = False
            self._undrawn = self.plots.steps(self.progress)
            # The table lists points with several motions, and is hidden if there are none.
            rows = () if self.progress is None else self.progress.motion_rows
            self.motions.show_rows(rows)
            self.motions.setVisible(bool(rows))
        if self._undrawn:
            self._undrawn.pop(0)()
        for view in self._views:
            view.refresh()

    def leave(self) -> None:
        """Store the scene of the form in the settings."""
        self.context.settings.keep_text(SettingKey.SCENES, json.dumps(self.form.form.content()))

    @property
    def styled_parts(self) -> tuple[QWidget, ...]:
        """The tabs, which are restyled one by one, because each tab has as many widgets as a page."""
        return (self._parts, *self._views)

    def begin(self) -> None:
        """Simulate the scene described by the form."""
        request = self.form.value
        if request is None:
            return
        note = (
            f"{request.specimen_text}, A0 = {1e6 * request.amplitude_m:g} µm, "
            f"{request.duration_s:g} s from rest, {request.accuracy.value}"
        )
        self.progress = SimulationProgress(request.amplitude_m, request.points, note)
        self._is_stale = True
        self._result.show(request)
        self._bar.begin()
        self.simulator.begin(request)

    def show_scene(self, frequency_hz: float, amplitude_m: float) -> None:
        """Set the form to frequencies around a drive frequency [Hz], for which the time signal is shown."""
        content = {**self.form.form.content(), "amplitude_m": amplitude_m, "signal_hz": frequency_hz}
        content |= {"start_hz": 0.9 * frequency_hz, "stop_hz": 1.1 * frequency_hz}
        content["step_hz"] = 0.01 * frequency_hz
        self.form.form.show_content(content)
        self.tabs.setCurrentIndex(0)

    def _grow(self, parts: tuple[PartialResult, ...]) -> None:
        if self.progress is not None:
            self.progress.add(parts)
            self._is_stale = True
            self._say_progress("Simulating…")

    def _end(self) -> None:
        self._is_stale = True
        troubles = () if self.progress is None else self.progress.troubles
        text = "Complete." if not troubles else f"Complete except for {count_text(len(troubles), 'point')}."
        if self.progress is not None and self.progress.sensitive:
            sensitive = count_text(self.progress.sensitive, "point")
            text += f" At {sensitive} the motion depends sensitively on the start."
        self._say_progress(text)
        if troubles:
            self.context.warn(troubles[0], details="\n".join(troubles[1:]))

    def _say_cost(self) -> None:
        request = self.form.value
        self._begin.setEnabled(request is not None)
        self._result.mark()
        if request is None:
            self._cost.setText(f"✖ {self.form.complaint}")
            return
        self._cost.setText("\n".join(cost_sentences(request, os.cpu_count() or 1)))

    def _say_progress(self, text: str) -> None:
        done, total = (0, 0) if self.progress is None else (self.progress.done, self.progress.requested)
        self._bar.show_done(done, total)
        self._state.setText(text)
        self._compare.setEnabled(self.progress is not None and bool(self.progress.curves()))

    def _hand_to_compare(self) -> None:
        if self.progress is not None:
            self.context.prediction_made.emit(self.progress.curves())
            self.context.page_requested.emit(COMPARE)

    def _build(self) -> None:
        self._parts = SideAndPicture(self.context, SIMULATE, self._side(), self._answer(), self._buttons())
        self.tabs = QTabWidget()
        self.tabs.setAccessibleName("What is simulated")
        self._parts.setAccessibleName("Responses")
        self.tabs.addTab(self._parts, "Responses")
        self.tabs.addTab(self.branches, "Branches")
        self.tabs.addTab(self.spectrum, "Exponents")
        self.tabs.addTab(self.chain, "Chain")
        fill_box(QVBoxLayout(self), self.tabs)

    def _side(self) -> QWidget:
        scene = titled_box("Scene", self.form)
        self._cost = SentenceLabel(name="Cost and error of this accuracy")
        cost = titled_box("Cost and error of this accuracy", self._cost)
        return column(scene, cost, 1)

    def _buttons(self) -> QLayout:
        self._begin = push_button(
            "&Simulate", "Start the computation in a separate process", self.begin, "first"
        )
        return row((self._begin, 1), self.simulator.cancel_button)

    def _answer(self) -> QWidget:
        self._bar = TimedBar("Points simulated", "points")
        letters = "20000 of 20000 points, 0:00:00 left  "
        self._bar.setMinimumWidth(self._bar.fontMetrics().horizontalAdvance(letters))
        self._state = SentenceLabel()
        self._compare = push_button(
            "Over&lay on recordings", "Show these curves on the Compare page", self._hand_to_compare
        )
        self.motions = ReadTable(
            "Motions and their shares at points with sensitive dependence on the start", MOTION_COLUMNS
        )
        self.motions.setMaximumHeight(_LINES * self.motions.verticalHeader().defaultSectionSize())
        self.motions.hide()
        return column((self.plots, 1), self.motions, row((self._state, 1), self._bar, self._compare))
