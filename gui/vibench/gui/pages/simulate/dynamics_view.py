"""Tab of the Simulate page: a form, the result so far, and its computing time and error."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

from PySide6.QtWidgets import QLayout, QVBoxLayout, QWidget

from vibench.analysis import Curve
from vibench.analysis.dynamics import (
    BranchDiagram,
    BranchRequest,
    ChainAnswer,
    ChainRequest,
    ExponentSpectrum,
    SpectrumRequest,
)
from vibench.analysis.prediction.progress import PartialResult, Trouble
from vibench.analysis.prediction.worker import Asked

from ...forms.model_form import ValidatedForm
from ...page.app_context import AppContext
from ...page.page import DisplayedResult, SideAndPicture
from ...page.simulator import Simulator
from ...widgets.boxes import column, fill_box, push_button, row, titled_box
from ...widgets.notice import COMPARE
from ...widgets.units import SentenceLabel

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
