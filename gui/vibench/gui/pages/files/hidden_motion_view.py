"""p of m1 between its stops in the stretch in sight, told from base acceleration and m0's velocity."""

from math import nan
from pathlib import Path

from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QCheckBox, QFileDialog, QLabel, QVBoxLayout, QWidget

from vibench.acquisition.recording import Recording
from vibench.analysis.hidden_motion import (
    LONGEST_VIEW_S,
    HiddenView,
    HiddenViewRequest,
    Numbers,
    hidden_view,
)
from vibench.sim import shipped_specimens

from ...background.background import Background, LatestRequest
from ...forms.editor import Choice
from ...page.page import Shown
from ...plots.axis import TIME, PlotAxis
from ...plots.line_style import LIMIT, Dash, curve_style
from ...plots.plot import Plot
from ...widgets.boxes import filled, row
from ...widgets.theme import Theme
from ...widgets.units import SentenceLabel

_WAIT_MS = 250
"""How long a view stands still before it is worked out."""
_RELATIVE = PlotAxis("p = y - z", "m", short="p")
_ANOTHER = "another file…"
CHOOSE = "Choose a recording in the list above."


class HiddenMotionView(QWidget):
    """Tracked, and without a contact model, between the stops."""

    def __init__(self, theme: Theme, background: Background) -> None:
        super().__init__()
        self.setAccessibleName("Hidden motion")
        self.plot = Plot("Hidden motion", TIME, _RELATIVE, theme).with_legend()
        self.tracked = self.plot.curve(curve_style(0), "tracked")
        self.free = self.plot.curve(curve_style(1, Dash.DOTTED), "without a contact model")
        self._stops = [self.plot.level(LIMIT, nan, "stop") for _ in range(2)]
        self.said = SentenceLabel(rank="second")
        self.specimen = Choice()
        self.specimen.setAccessibleName("Specimen of the hidden motion")
        self.specimen.setToolTip("Whose springs, masses and stops the motion is told with")
        self.specimen.addItem("as the recording describes it", "")
        for name in shipped_specimens():
            self.specimen.addItem(name, name)
        self.specimen.addItem(_ANOTHER, "")
        self.specimen.activated.connect(self._choose_specimen)
        self.find_numbers = QCheckBox("Find its numbers")
        self.find_numbers.setToolTip("Gaps, m1, springs, dampers and law from the collisions in sight")
        self.find_numbers.toggled.connect(self._ask_otherwise)
        self._recording: Recording | None = None
        self._view_s = (0.0, 0.0)
        self._asked: HiddenViewRequest | None = None
        self._of: HiddenViewRequest | None = None
        """What the picture is of; None while there is none."""
        self._latest_request = LatestRequest(background, hidden_view, self._show, self._fail, _WAIT_MS, self)
        chosen = row(QLabel("Specimen"), self.specimen, self.find_numbers, 1)
        filled(QVBoxLayout(self), chosen, self.said, (self.plot, 1)).setContentsMargins(0, 4, 0, 0)
        self._clear(CHOOSE)

    @property
    def is_busy(self) -> bool:
        """Whether a picture is still to come."""
        return self._latest_request.is_busy

    @property
    def shown(self) -> Shown:
        """The picture, of the stretch in sight and what is chosen above it."""
        return Shown(self.plot, self._of, self._asked)

    def show_recording(self, recording: Recording | None, hint: str) -> None:
        """Picture another recording from now on, or none; until then the hint is shown."""
        self._recording = recording
        self._latest_request.drop()
        self._clear(hint)

    def show_view(self, low_s: float, high_s: float) -> None:
        """Picture this stretch, when the picture is in sight."""
        self._view_s = (low_s, high_s)
        self._ask()

    def showEvent(self, event: QShowEvent) -> None:
        """Work out what nobody wanted while it was out of sight."""
        super().showEvent(event)
        self._ask()

    def _ask(self) -> None:
        low_s, high_s = self._view_s
        if not self.isVisible() or self._recording is None or not high_s > low_s:
            return
        if high_s - low_s > LONGEST_VIEW_S:
            self._latest_request.drop()
            self._clear(f"Zoom in to {LONGEST_VIEW_S:g} s or less: p swings a thousand times a second.")
            return
        self.said.setText("working it out…")
        numbers = Numbers.FOUND if self.find_numbers.isChecked() else Numbers.AS_DESCRIBED
        specimen = self.specimen.currentData()
        self._asked = HiddenViewRequest(Path(self._recording.path), low_s, high_s, specimen, numbers)
        self.plot.setEnabled(self._of in (None, self._asked))
        self._latest_request.ask(self._asked)

    def _ask_otherwise(self, _is_on: bool) -> None:  # noqa: FBT001 - a signal's
        self._ask()

    def _choose_specimen(self, place: int) -> None:
        """Take another specimen; the last entry asks for a file, and becomes it."""
        if self.specimen.itemText(place) == _ANOTHER:
            given, _ = QFileDialog.getOpenFileName(self, "Specimen", "", "Specimens (*.toml)")
            if given:
                self.specimen.insertItem(place, Path(given).name, given)
            self.specimen.setCurrentIndex(place if given else 0)
        self._ask()

    def _show(self, found: HiddenView) -> None:
        self._of = found.request
        self.plot.setEnabled(self._of == self._asked)
        self.plot.with_hint("")
        self.tracked.setData(found.time_s, found.p, connect="finite")
        self.free.setData(found.time_s, found.free_p, connect="finite")
        for line, place in zip(self._stops, found.stops_m, strict=True):
            self.plot.move_level(line, place)
        self.said.setText(found.sentence)
        self.plot.setXRange(found.request.low_s, found.request.high_s, padding=0.0)

    def _fail(self, error: BaseException) -> None:
        self._clear(str(error))

    def _clear(self, hint: str) -> None:
        self._of = None
        self.plot.setEnabled(True)
        for curve in (self.tracked, self.free):
            curve.setData([], [])
        for line in self._stops:
            self.plot.move_level(line, nan)
        self.said.setText("")
        self.plot.with_hint(hint)
        self.plot.viewport().update()
