"""The Test page: a form for the next test, with preview and predicted response."""

import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QFileDialog,
    QGridLayout,
    QGroupBox,
    QHBoxLayout,
    QSizePolicy,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from vibench.acquisition import (
    ConfigurationError,
    all_shipped,
    load_campaign,
    load_toml,
    printable,
    save_toml,
    toml_text,
    validate,
)
from vibench.acquisition.plan import (
    EXCITATION_KINDS,
    Family,
    LimitCheck,
    LimitSide,
    Measurement,
    MeasurementPreview,
    excitation_text,
    rows_by_kind,
)
from vibench.acquisition.rig import BaseQuantity, Rig
from vibench.analysis.live import outline, zigzag

from ...background import LatestRequest
from ...forms.editor import Choice
from ...forms.model_form import GroupEditor, ValidatedForm
from ...page.app_context import AppContext, SettingKey
from ...page.page import DisplayedResult, FileKind, History, Page, SideAndPicture
from ...page.user_actions import UserActions
from ...plots.axis import FREQUENCY, LOG_FREQUENCY, TIME, PlotAxis, Scale
from ...plots.line_style import PREDICTED, Dash, LineStyle, curve_style
from ...plots.plot import Plot, show_fields
from ...widgets.boxes import column, fill_box, push_button, row, titled_box
from ...widgets.notice import TEST, Notice, NoticeKind, clock
from ...widgets.read_table import SHARE_ROLE, BarDelegate, ReadTable
from ...widgets.theme import Theme
from ...widgets.units import SentenceLabel, prefixed_unit
from .test_preview import TestPrediction, predict_test, preview_test

if TYPE_CHECKING:
    from vibench.analysis import MeasurementPrediction

USUAL = {
    "amplitude_vpp": 1.0,
    "duration_s": 10.0,
    "frequency_hz": 260.0,
    "start_hz": 150.0,
    "stop_hz": 350.0,
    "low_hz": 80.0,
    "high_hz": 350.0,
    "band_start_hz": 40.0,
    "band_stop_hz": 600.0,
    "lowest_vpp": 0.2,
    "step_vpp": 0.2,
    "base_level": {"displacement_m": 5e-6},
    "response_m": 5e-6,
    "frequencies_hz": [240.0, 260.0, 280.0],
    "spectrum": [{"frequency_hz": 40.0, "density": 1e-3}, {"frequency_hz": 600.0, "density": 1e-3}],
    "accelerations_m_per_s2": [0.3, 0.6],
}
"""Starting values of required fields, the same for every kind of test."""

FRESH: Mapping[str, Mapping[str, float]] = rows_by_kind(
    {
        Family.NOISE: {"duration_s": 60.0},
        Family.SWEEP: {"duration_s": 60.0},
        Family.DWELL: {"duration_s": 10.0},
        Family.STEPPED: {},
    },
    {},
)
"""Starting values by kind of test; these values replace the values of the previous kind."""


class TestForm(ValidatedForm[Measurement]):
    """Form for a measurement; `value` is None if the input is not valid."""

    def __init__(self) -> None:
        super().__init__(Measurement, "test", frozenset({"repeats"}))
        limits = self.form.editors["limits"].widget
        assert isinstance(limits, QGroupBox)
        limits.setTitle("Limits  (1 = limit of the rig)")
        excitation = self.form.editors["excitation"]
        assert isinstance(excitation, GroupEditor)
        lines = {word: (each.group, each.about) for word, each in EXCITATION_KINDS.items()}
        excitation.set_starting_values(USUAL, FRESH, lines)
        choice = excitation.kind_choice
        assert choice is not None

        def rename(_place: int) -> None:
            """Rename the test after a change of kind, because the old name contains the former kind."""
            self.form.editors["name"].show_content(str(choice.currentData()))
            self.form.changed.emit()

        choice.activated.connect(rename)


FIRST = "quick"
"""Name of the campaign whose tests come first in the list."""
MOST_OF_ONE = 12
"""Largest number of tests listed from one campaign; a sweep may have hundreds."""


@dataclass(frozen=True)
class NamedTest:
    """Test in the list, with a label that names the test's origin."""

    label: str
    measurement: Measurement


def shipped_tests() -> tuple[NamedTest, ...]:
    """Return the tests of the campaigns that come with vibench; skip campaigns that cannot be loaded."""
    campaigns = [campaign for _, campaign in _readable(all_shipped("campaigns"), load_campaign)]
    return tuple(
        NamedTest(f"{campaign.name} / {each.name}", each)
        for campaign in sorted(campaigns, key=lambda each: (each.name != FIRST, each.name))
        for each in sorted(campaign.measurements[:MOST_OF_ONE], key=lambda each: each.name)
    )


def own_tests(folder: Path) -> tuple[NamedTest, ...]:
    """Return the tests saved in a folder; skip files that cannot be read."""
    found = _readable(sorted(folder.glob("*.toml")), lambda path: load_toml(path, Measurement))
    return tuple(NamedTest(f"own / {path.stem}", test) for path, test in found)


def _readable(paths: Iterable[Path], load: Callable[[Path], Any]) -> Iterator[tuple[Path, Any]]:
    for path in paths:
        with suppress(ConfigurationError):
            yield path, load(path)


COLLISION = LineStyle(lambda theme: theme.traces[3], fill_opacity=0.18)


class PredictionPlot(Plot):
    """Plot of the simulated response: dashed and dotted lines, with stripes where m1 hits its stops."""

    def __init__(self, theme: Theme) -> None:
        up = PlotAxis("Response", "x / A0", scale=Scale.LOGARITHMIC)
        super().__init__("Predicted response and collision regions", FREQUENCY, up, theme)
        self.with_legend()
        self.with_hint("The response of the specimen to this test is being simulated.")
        self._curves = {
            "response_i": self.curve(PREDICTED, "Response I, simulated"),
            "response_ii": self.curve(curve_style(0, Dash.DOTTED), "Response II, simulated"),
            "linear": self.curve(curve_style(2, Dash.DOTTED), "without contact"),
        }
        self._stripes = self.stripes(COLLISION)

    def show_prediction(self, seen: "MeasurementPrediction | None") -> None:
        """Draw a prediction; None clears the plot."""
        show_fields(self._curves, seen and seen.prediction)
        self._stripes.show_bands(() if seen is None else seen.collision_bands_hz)
        self.show_everything()


MOST_COLUMNS = 3000


class SignalCurve:
    """Curve of a long signal. Only the visible part is drawn; short impacts are visible at any zoom."""

    def __init__(self, plot: Plot, line_style: LineStyle, name: str = "") -> None:
        self._plot = plot
        self._curve = plot.curve(line_style, name)
        self._samples: NDArray[np.float64] = np.empty(0)
        self._rate_hz = 1.0
        self._drawn: tuple[int, int, int] | None = None
        plot.getViewBox().sigXRangeChanged.connect(self._redraw)

    def set_samples(self, samples: NDArray[np.floating], sample_rate_hz: float) -> None:
        """Set the samples of the signal, shape (samples,)."""
        self._samples = np.asarray(samples)
        self._rate_hz = sample_rate_hz
        self._drawn = None
        self._draw(0, len(self._samples))

    def _redraw(self, *_: object) -> None:
        (low_s, high_s), _range = self._plot.getViewBox().viewRange()
        first = int(np.floor(low_s * self._rate_hz)) - 1
        last = int(np.ceil(high_s * self._rate_hz)) + 2
        count = len(self._samples)
        if self._plot.getViewBox().autoRangeEnabled()[0]:
            # The axis follows the drawn data, so draw the whole signal.
            first, last = 0, count
        self._draw(min(max(first, 0), count), min(max(last, 0), count))

    def _draw(self, first: int, last: int) -> None:
        columns = min(max(self._plot.columns, 200), MOST_COLUMNS)
        if (first, last, columns) == self._drawn:
            return
        self._drawn = (first, last, columns)
        visible = self._samples[first:last]
        if len(visible) <= 2 * columns:
            self._curve.setData(np.arange(first, last) / self._rate_hz, visible)
            return
        low, high = outline(visible, columns)
        edges = np.arange(columns) * len(visible) // columns
        time_s = (first + np.repeat(edges, 2)) / self._rate_hz
        self._curve.setData(time_s, zigzag(np.asarray(low, float), np.asarray(high, float)))


_FLOOR = 1e-5
"""Ratio to the strongest spectral line below which a line counts as rounding error."""
_LEAST_HZ = 1.0
"""Lower end of the displayed spectrum [Hz]; shakers do not move at lower frequencies."""
_LEAST_LINES = 9
"""Smallest useful height of a plot, in lines of text."""


class PreviewPlots(QWidget):
    """Two plots of the signal side by side, over time and over frequency; zooming in time shows samples."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.time = Plot("Signal of the generator over time", TIME, PlotAxis("Generator", "V"), theme)
        self.spectrum = Plot(
            "Spectrum of the signal",
            LOG_FREQUENCY,
            PlotAxis("Amplitude", "V", scale=Scale.LOGARITHMIC),
            theme,
        )
        for plot in (self.time, self.spectrum):
            plot.setMinimumHeight(_LEAST_LINES * self.fontMetrics().height())
        self._signal = SignalCurve(self.time, curve_style(0))
        self._lines = self.spectrum.curve(curve_style(0))
        fill_box(QHBoxLayout(self), (self.time, 1), (self.spectrum, 1), margin=0)

    def show_preview(self, seen: MeasurementPreview) -> None:
        """Draw the preview of a test."""
        self.time.show_everything()
        self._signal.set_samples(seen.volts, seen.sample_rate_hz)
        floor_v = _FLOOR * float(np.max(seen.spectrum_v))
        self.spectrum.show_everything()
        shown = seen.spectrum_hz >= min(_LEAST_HZ, float(seen.spectrum_hz[-1]))
        self._lines.setData(seen.spectrum_hz[shown], np.maximum(seen.spectrum_v[shown], floor_v))


_USED = 0
_SIGNS = {LimitSide.AT_MOST: "≤", LimitSide.AT_LEAST: "≥"}


class LimitTable(ReadTable):
    """Table with one row per limit of the rig; a bar shows the used fraction of the limit."""

    def __init__(self) -> None:
        super().__init__("Predicted loads and limits", ("used", "quantity", "predicted", "limit"), wide=1)
        self.setItemDelegateForColumn(_USED, BarDelegate(self))

    def show_checks(self, checks: tuple[LimitCheck, ...]) -> None:
        """Show the predicted loads of the rig beside their limits."""
        units = [prefixed_unit(check.unit, check.limit) for check in checks]
        self.show_rows(
            [
                (
                    f"{100 * check.use:.1f} %",
                    f"{_mark(check)}{_short(check.what)}",
                    unit.text(check.value),
                    f"{_SIGNS[check.side]} {unit.text(check.limit)}",
                )
                for check, unit in zip(checks, units, strict=True)
            ],
            [
                f"{check.what}\nLimit from: {check.source}"
                + ("" if check.is_kept else f"\nTo do: {check.remedy}")
                for check in checks
            ],
        )
        for place, check in enumerate(checks):
            item = self.item(place, _USED)
            if isinstance(item, QTableWidgetItem):
                item.setData(SHARE_ROLE, float(check.use))
                item.setTextAlignment(Qt.AlignmentFlag.AlignCenter)


def _mark(check: LimitCheck) -> str:
    if check.is_kept:
        return ""
    return "✖ " if check.forbids else "⚠ "


def _short(what: str) -> str:
    return what.removeprefix("the ").replace("(at ", "(").replace("_", " ")


_SHOWN = {
    BaseQuantity.STROKE: "stroke",
    BaseQuantity.ACCELERATION: "acceleration",
    BaseQuantity.FORCE: "force",
    BaseQuantity.AMPLIFIER_VOLTAGE: "amplifier's voltage",
}


def summary_text(seen: MeasurementPreview, refusal: str = "") -> str:
    """Return a summary in words: excitation, loads with their limits, duration and file size.

    ``refusal`` is the reason why feedback control cannot stabilise the motion, or empty.
    """
    parts = [excitation_text(seen.measurement.excitation)]
    parts += [
        _load(check, name) for load, name in _SHOWN.items() for check in seen.checks if check.load is load
    ]
    parts.append(f"generator {seen.peak_v:.3g} V peak, crest {seen.peak_v / seen.rms_v:.2f}")
    parts.append(f"takes {clock(seen.duration_s)}")
    parts.append(f"file {seen.size_bytes / 1e6:.0f} MB")
    if seen.least_growth_time_s is not None:
        parts.append(
            f"can hold motions whose deviations take {seen.least_growth_time_s:.3g} s or more to grow e-fold"
        )
    passed = [check for check in seen.checks if not check.is_kept]
    broken = sorted(passed, key=lambda check: not check.forbids)
    summary = "   ·   ".join(parts)
    if refusal:
        return f"✖ {refusal}   ·   {summary}"
    if not broken:
        return f"✔ within all limits   ·   {summary}"
    sign = "✖" if broken[0].forbids else "⚠"
    reasons = "   ·   ".join(check.complaint() for check in broken)
    return f"{sign} {reasons}   ·   {summary}"


def _load(check: LimitCheck, name: str) -> str:
    unit = prefixed_unit(check.unit, check.limit)
    return f"{name} {unit.text(check.value)} of {unit.text(check.limit)}"


Asked = tuple[Measurement | None, Rig | None] | None
NAMELESS = {"name": "test", "notes": ""}
"""Fixed name and notes of predicted tests; tests that differ only in name or notes share a prediction."""
LOOK_MS, PREDICT_MS = 200, 900
"""Delays from the last edit to the preview, and to the simulation [ms]."""


class TestPage(Page):
    """Page that edits the next test; its Arm button arms the test."""

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self._actions = UserActions(context, self)
        self._preview: MeasurementPreview | None = None
        self._refusal = ""
        self._requested_inputs: Asked = None
        self._tests: tuple[NamedTest, ...] = ()
        self.choice = Choice()
        self.form = TestForm()
        self.edits = History(self.form.show_value)
        self.summary = SentenceLabel(name="Summary of the test")
        self.plots = PreviewPlots(context.theme)
        self.limits = LimitTable()
        self.prediction = PredictionPlot(context.theme)
        self.prediction_note = SentenceLabel(rank="second")
        self.expectation = SentenceLabel(rank="second")
        self._summed, self._previewed, self._predicted = self.displayed_results = (
            DisplayedResult(lambda: self._inputs, self.summary),
            DisplayedResult(lambda: self._inputs, self.plots, self.limits),
            DisplayedResult(lambda: self._inputs, self.prediction, self.prediction_note),
        )
        self.arm_button = push_button(
            "A&rm the test…  (Ctrl+Return)",
            "Arm, and describe what will be played; no signal is played before Start",
            self._actions.arm_test,
            "first",
        )
        self._looking = LatestRequest(
            context.looks, preview_test, self._show_preview, self._show_look_error, LOOK_MS, self
        )
        self._predicting = LatestRequest(
            context.background, predict_test, self._on_result, self._on_failure, PREDICT_MS, self
        )
        self._lay_out()
        self.choice.activated.connect(self._take)
        self.form.changed.connect(self._on_change)
        self.context.selection.rig_changed.connect(self._on_change)
        self._list_tests()
        self._restore()

    @property
    def is_done(self) -> bool:
        """Whether the test is valid and within all limits, and its motion can be stabilised by feedback."""
        return self._preview is not None and self._preview.is_allowed and not self._refusal

    @property
    def is_busy(self) -> bool:
        """Whether a preview or a prediction is being computed."""
        return self._looking.is_busy or self._predicting.is_busy

    @property
    def opens(self) -> Mapping[FileKind, Callable[[Path], object]]:
        """Function that opens files of tests."""
        return {FileKind.TEST: self.open_file}

    @property
    def _inputs(self) -> tuple[Measurement | None, Rig | None]:
        value = self.form.value
        nameless = None if value is None else value.model_copy(update=NAMELESS)
        return nameless, self.context.selection.rig

    def leave(self) -> None:
        """Store the edited test in the settings."""
        measurement = self.form.value
        if measurement is not None:
            self.context.settings.keep_text(SettingKey.TEST, toml_text(measurement))

    def _on_change(self) -> None:
        measurement, inputs = self.form.value, self._inputs
        seen = self.context.selection.prediction
        self.context.selection.choose_measurement(measurement)
        if measurement is not None:
            self.edits.note(measurement)
            if inputs == self._requested_inputs:
                # Only the name or notes have changed: the prediction is still valid.
                self.context.selection.prediction = seen
                return
        self._preview, self._refusal = None, ""
        self._requested_inputs = inputs
        self._summed.show(inputs)
        for result in (self._previewed, self._predicted):
            result.mark()
        measurement, rig = inputs
        if measurement is None or rig is None:
            self._looking.drop()
            self._predicting.drop()
            what = self.form.complaint or "Choose a rig first (Ctrl+1)."
            self.summary.setText(f"✖ {what}")
            return
        self.summary.setText("…")
        self._looking.ask((measurement, rig))
        self.prediction_note.setText("◌ simulating")
        self._predicting.ask((measurement, rig))

    def _show_preview(self, seen: MeasurementPreview) -> None:
        self._preview = seen
        self.summary.setText(summary_text(seen, self._refusal))
        self.plots.show_preview(seen)
        self.limits.show_checks(seen.checks)
        self._previewed.show(self._requested_inputs)

    def _show_look_error(self, error: BaseException) -> None:
        self.summary.setText(f"✖ {error}")

    def _on_result(self, prediction: TestPrediction) -> None:
        seen = prediction.motion
        self.context.selection.prediction = seen
        self._predicted.show(self._requested_inputs)
        self._refusal = prediction.refusal
        if self._preview is not None:
            self.summary.setText(summary_text(self._preview, self._refusal))
        self.prediction.show_prediction(seen)
        bands = ", ".join(f"{low:.0f}–{high:.0f} Hz" for low, high in seen.collision_bands_hz)
        collides = f"Collisions at {bands}." if bands else "No collision is predicted."
        self.prediction_note.setText(
            f"Simulated ({seen.model}), {seen.approach.value}, base amplitude {seen.base_text} from "
            f"{seen.basis}. {collides}"
        )
        sentences = [each.sentence for each in prediction.expected]
        known = [each.sentence for each in prediction.expected if each.scatter is not None]
        text = f"Expected uncertainty: {known[0]} …" if known and sentences[1:] else "".join(sentences[:1])
        if prediction.recorded_s is not None:
            text = f"Records until the targets are met, about {prediction.recorded_s:.3g} s. {text}"
        self.expectation.setText(text)
        self.expectation.setToolTip("\n".join(sentences))

    def _on_failure(self, error: BaseException) -> None:
        self.prediction.show_prediction(None)
        self._predicted.show(self._requested_inputs)
        self.prediction_note.setText(f"No prediction: {error}")
        self.expectation.setText("")

    def _list_tests(self) -> None:
        self._tests = (*own_tests(self._own_folder), *shipped_tests())
        self.choice.replace_items(["load a test…", *(printable(test.label) for test in self._tests)])

    @property
    def _own_folder(self) -> Path:
        return self.context.folder / "tests"

    def _take(self, row: int) -> None:
        if row > 0:
            self.form.show_value(self._tests[row - 1].measurement)

    def _restore(self) -> None:
        kept = self.context.settings.text(SettingKey.TEST)
        self.form.show_value(_stored_test(kept) or self._tests[0].measurement)

    def _save(self) -> None:
        measurement = self.form.value
        if measurement is None:
            self.context.warn("The test is not complete.", next_step=self.form.complaint)
            return
        wish = str(self._own_folder / f"{measurement.name}.toml")
        given, _ = QFileDialog.getSaveFileName(self, "Save the test", wish, "Tests (*.toml)")
        if not given:
            return
        path = Path(given)
        try:
            save_toml(measurement, path)
        except ConfigurationError as error:
            self.context.fail(error)
        else:
            self.context.note_file(path)
            self.context.say(Notice(NoticeKind.INFO, f"The test was saved as {path}."))
            self._list_tests()  # the file may be in the folder of tests

    def _open(self) -> None:
        given, _ = QFileDialog.getOpenFileName(self, "Open a test", str(self._own_folder), "Tests (*.toml)")
        if given:
            self.open_file(Path(given))

    def open_file(self, path: Path) -> None:
        """Load the test of a file for editing."""
        try:
            self.form.show_value(load_toml(path, Measurement))
            self.context.note_file(path)
        except ConfigurationError as error:
            self.context.fail(error)

    def _lay_out(self) -> None:
        self.choice.setAccessibleName("Known tests")
        self.choice.setToolTip("Tests that come with vibench, and your own")
        files = row(
            push_button("Open…", "Open a test from a TOML file", self._open),
            push_button("Save as…", "Save this test as a TOML file", self._save),
        )
        left = column(self.choice, files, self.form, 1)
        grid = QWidget()
        cells = QGridLayout(grid)
        cells.addWidget(self.summary, 0, 0, 1, 2)
        cells.addWidget(titled_box("Planned drive signal", (self.plots, 1)), 1, 0, 1, 2)
        cells.addWidget(titled_box("Loads and limits", (self.limits, 1)), 2, 0)
        cells.addWidget(
            titled_box(
                "Predicted response of the specimen",
                (self.prediction, 1),
                self.prediction_note,
                self.expectation,
            ),
            2,
            1,
        )
        # The lower parts of the page share the remaining height.
        cells.setRowStretch(1, 2)
        cells.setRowStretch(2, 3)
        for table in (self.limits, self.prediction):
            # If preferred heights are ignored, the preview gets enough height.
            table.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Ignored)
        fill_box(QVBoxLayout(self), SideAndPicture(self.context, TEST, left, grid, self.arm_button))


def _stored_test(text: str) -> Measurement | None:
    """Return the test that is stored in the settings as text; None if this version does not allow it."""
    try:
        return validate(tomllib.loads(text), Measurement, "the last test")
    except (ConfigurationError, tomllib.TOMLDecodeError):
        return None
