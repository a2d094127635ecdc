"""The Rig page: select, open and check a bench.

Select the hardware configuration, confirm the settings that instruments cannot report, open the bench and
check it. Findings of the check are shown in units with prefixes, such as µV.
"""

import warnings
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from math import isfinite
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QCheckBox,
    QFileDialog,
    QFormLayout,
    QGroupBox,
    QLabel,
    QVBoxLayout,
    QWidget,
)

from vibench.acquisition import (
    BenchReport,
    ConfigurationError,
    Finding,
    InstrumentList,
    Verdict,
    all_shipped,
    list_rig_instruments,
    printable,
    shipped,
)
from vibench.acquisition.engine import EngineClient, EngineState, EngineStatus
from vibench.acquisition.instruments import Knob
from vibench.acquisition.rig import KnobSheet, Rig, load_rig
from vibench.sim import SpecimenWarning

from ..forms.editor import Choice
from ..forms.quantity_edit import LineField
from ..page.app_context import AppContext, SettingKey
from ..page.page import FileKind, Page, SideAndPicture
from ..page.user_actions import UserActions
from ..widgets.boxes import column, fill_box, label_for, plain_tip, push_button, tick_box, titled_box
from ..widgets.notice import RIG, moment_text
from ..widgets.read_table import ReadTable
from ..widgets.units import SentenceLabel, prefixed_unit

PACES = {"wall": "in real time, like a real bench", "free": "as fast as this computer can"}


class RigChoice(QWidget):
    """Choice of a hardware configuration; an unreadable file is reported and not selected."""

    chosen = Signal()
    refused = Signal(object)
    """`ConfigurationError` of a file that cannot be read."""

    def __init__(self) -> None:
        super().__init__()
        self._paths: list[Path] = []
        self._rig: Rig | None = None
        self.complaint = self.warning = ""
        """Error and warnings about the selected file, as text; empty if there are no errors and warnings."""
        self._box, self.pace = Choice(), Choice(items=PACES.values())
        self._box.setToolTip("A real bench needs its instruments; a simulated rig needs none")
        self.pace.setToolTip("Speed of the simulated instruments; a real bench runs in real time")
        self._form = QFormLayout(self)
        self._form.setContentsMargins(0, 0, 0, 0)
        self._form.addRow(label_for("Configuration", self._box, "Hardware configuration"), self._box)
        self._form.addRow(label_for("Runs", self.pace, "Pace of the simulated rig"), self.pace)
        self._form.addRow(push_button("Own file…", "Open a hardware configuration of your own", self._ask))
        for path in sorted(all_shipped("hardware_configs"), key=lambda each: "virtual" not in each.stem):
            self._add(path)
        self._box.currentIndexChanged.connect(self._load)
        self.pace.currentIndexChanged.connect(self.chosen)

    @property
    def path(self) -> Path | None:
        """Path of the selected hardware configuration."""
        row = self._box.currentIndex()
        return self._paths[row] if 0 <= row < len(self._paths) else None

    @property
    def rig(self) -> Rig | None:
        """The selected rig; a simulated rig runs at the selected speed."""
        if self._rig is None or self._rig.virtual is None:
            return self._rig
        pace = list(PACES)[self.pace.currentIndex()]
        return self._rig.model_copy(update={"virtual": self._rig.virtual.model_copy(update={"pace": pace})})

    def choose(self, path: Path) -> None:
        """Select a file in the list; if the file is missing, add it."""
        if path not in self._paths:
            self._add(path)
        row = self._paths.index(path)
        if row == self._box.currentIndex():
            self._load()
        else:
            self._box.setCurrentIndex(row)

    def _add(self, path: Path) -> None:
        self._paths.append(path)
        self._box.addItem(printable(path.stem.replace("_", " ")))
        self._box.setItemData(self._box.count() - 1, plain_tip(str(path)), Qt.ItemDataRole.ToolTipRole)

    def _ask(self) -> None:
        given, _ = QFileDialog.getOpenFileName(self, "Hardware configuration", "", "Configurations (*.toml)")
        if given:
            self.choose(Path(given))

    def _load(self) -> None:
        path = self.path
        self._rig, self.complaint, self.warning = None, "", ""
        if path is not None:
            with warnings.catch_warnings(record=True, action="always", category=SpecimenWarning) as warned:
                try:
                    self._rig = load_rig(path)
                except ConfigurationError as error:
                    self.complaint = str(error)
                    self.refused.emit(error)
            self.warning = "; ".join(str(each.message) for each in warned)
        is_simulated = self._rig is not None and self._rig.virtual is not None
        self._form.setRowVisible(1, is_simulated)
        self.chosen.emit()


class KnobSheetForm(QGroupBox):
    """Form with the operator's name, and a check box for each knob that the user must confirm."""

    changed = Signal()

    def __init__(self) -> None:
        super().__init__("Settings made by hand")
        self._note = QLabel("Check each knob, then tick it. Instruments cannot report these settings.")
        self._note.setWordWrap(True)
        self._note.setProperty("rank", "second")
        self.operator_field = LineField()
        self.operator_field.setToolTip("Your name; it is stored in every recording")
        self.operator_field.textChanged.connect(self.changed)
        self._ticks: dict[Knob, QCheckBox] = {}
        self._layout = QVBoxLayout(self)
        self._layout.addWidget(self._note)
        form = QFormLayout()
        form.addRow(label_for("Checked by", self.operator_field, "Operator"), self.operator_field)
        self._layout.addLayout(form)

    @property
    def ticks(self) -> tuple[QCheckBox, ...]:
        """Check boxes with which the user confirms the knobs."""
        return tuple(self._ticks.values())

    def show_rig(self, rig: Rig | None) -> None:
        """Show the knobs of a rig; at first, no knob is confirmed."""
        for tick in self._ticks.values():
            self._layout.removeWidget(tick)
            tick.deleteLater()
        knobs = () if rig is None or rig.virtual is not None else rig.knobs
        self._ticks = {knob: self._tick(knob) for knob in knobs}
        self.setVisible(bool(knobs))

    def sheet(self) -> KnobSheet | None:
        """Return the confirmations; None if a knob is not confirmed or the name is missing."""
        operator = self.operator_field.text().strip()
        if not self._ticks or not operator or not all(tick.isChecked() for tick in self.ticks):
            return None
        return KnobSheet(operator=operator, confirmed=datetime.now(UTC), knobs=tuple(self._ticks))

    def _tick(self, knob: Knob) -> QCheckBox:
        text = f"{knob.instrument}: {knob.setting} at {knob.value}"
        tick = tick_box(text, "Tick when you have checked this setting", lambda _: self.changed.emit())
        tick.setAccessibleName(f"{knob.instrument}: {knob.setting} is at {knob.value}")
        # Insert the check boxes above the field for the operator's name.
        self._layout.insertWidget(self._layout.count() - 1, tick)
        return tick


def finding_name(finding: Finding) -> str:
    """Return the name of a finding as text: ``"noise of drive voltage"``."""
    return finding.name.replace("_", " ")


def measured_text(finding: Finding) -> str:
    """Return a finding's measured value with a unit prefix: ``"20 µV"`` for 1.997e-05 V."""
    number = finding.number
    if number is None or not isfinite(number):
        return finding.value
    unit = prefixed_unit(finding.unit, number)
    if unit.per_si == 1.0:
        return finding.value
    spread = "" if finding.uncertainty is None else f" ± {finding.uncertainty * unit.per_si:.1g}"
    return f"{number * unit.per_si:.3g}{spread} {unit.name}"


def expected_text(finding: Finding) -> str:
    """Return a finding's expected value, with advice for the case that the measured value differs."""
    advice = finding.advice
    return f"{finding.expected}. {advice[0].upper()}{advice[1:]}" if advice else finding.expected


FIRST_STEPS = (
    "A first measurement needs three keys: Alt+O opens this bench, Ctrl+Return arms the test of the Test "
    "page and describes what will happen, F5 starts the test. The test ends by itself; the Files and Compare "
    "pages show the recording. F1 lists all keys."
)
VERDICTS = {Verdict.OK: "✔ ok", Verdict.WARN: "⚠ look", Verdict.FAIL: "✖ fail"}


class RigPage(Page):
    """First page: select a configuration, open the bench and check it."""

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self._actions = UserActions(context, self)
        self.choice = RigChoice()
        self.knobs = KnobSheetForm()
        self.about = SentenceLabel(rank="second")
        self.open_button = push_button(
            "&Open bench", "Open every instrument; the generator stays silent", self.open_bench, "first"
        )
        self.close_button = push_button(
            "Close bench", "Silence all outputs and close the instruments", self._close
        )
        self.check_button = push_button(
            "Check bench  (F6)", "Play a small sine; check noise, gains and clocks", self._actions.check
        )
        self.find_button = push_button("Find instruments", "List all instruments found", self._find)
        self.instruments = ReadTable(
            "Instruments",
            ("part", "instrument"),
            "The instruments are listed here once a bench is open.",
        )
        self.findings = ReadTable(
            "Findings of the check",
            ("", "finding", "measured", "expected"),
            "Noise, gains, clocks and the response to a small sine, each with its expected value.",
        )
        self.verdict = SentenceLabel()
        self.first_steps = SentenceLabel(FIRST_STEPS, rank="second")
        buttons = self.open_button, self.check_button, self.find_button, self.close_button
        side = QWidget()
        left = fill_box(QVBoxLayout(side), self.choice, self.about, self.knobs, *buttons)
        left.addSpacing(self.fontMetrics().height())
        fill_box(left, self.first_steps, 1)
        right = column(
            (titled_box("Instruments", self.instruments), 1),
            (titled_box("Check", self.verdict, self.findings), 3),
        )
        fill_box(QVBoxLayout(self), SideAndPicture(self.context, RIG, side, right))
        self.choice.chosen.connect(self._show_choice)
        self.choice.refused.connect(self.context.fail)
        otherwise = str(shipped("hardware_configs/virtual_rig.toml"))
        remembered = Path(self.context.settings.text(SettingKey.BENCH, otherwise))
        self.choice.choose(self.context.first_bench or remembered)

    @property
    def is_done(self) -> bool:
        """Whether the bench is open and no check has failed."""
        status = self.context.bridge.status
        if status is None or status.bench is None:
            return False
        return status.check is None or status.check.verdict is not Verdict.FAIL

    def refresh(self) -> None:
        """Show instruments and findings of the open bench."""
        status = self.context.bridge.status
        state = self.context.bridge.state
        may_open = state in (EngineState.CLOSED, EngineState.FAULT)
        rig = self.choice.rig
        is_complete = rig is not None and (rig.virtual is not None or self.knobs.sheet() is not None)
        self.open_button.setEnabled(may_open and is_complete)
        self.close_button.setEnabled(state in (EngineState.READY, EngineState.ARMED, EngineState.FAULT))
        self.check_button.setEnabled(state is EngineState.READY)
        self.choice.setEnabled(may_open)
        self.knobs.setEnabled(may_open)
        if status is not None and status.bench is not None:
            self.instruments.show_rows([(part, reply) for part, reply in status.bench.identities.items()])
        self._show_check(status)

    def enter(self) -> None:
        """Focus the button for the next step."""
        if self.open_button.isEnabled():
            self.open_button.setFocus()

    @property
    def opens(self) -> Mapping[FileKind, Callable[[Path], object]]:
        """Function that opens a hardware configuration; while a bench is open, it shows a message instead."""
        return {FileKind.RIG: self._choose}

    def _choose(self, path: Path) -> None:
        if self.choice.isEnabled():
            self.choice.choose(path.resolve())
        else:
            self.context.warn("A bench is open.", "It was kept.", "Close this bench, then choose another.")

    def open_bench(self) -> None:
        """Open the bench of the selected rig."""
        rig = self.choice.rig
        if rig is not None:
            self.instruments.show_rows([])
            self.context.selection.choose_rig(rig)  # another rig may have been taken over
            self.context.bridge.open(rig, self.knobs.sheet())

    def _show_check(self, status: EngineStatus | None) -> None:
        report: BenchReport | None = None if status is None else status.check
        if status is not None and status.state is EngineState.CHECKING:
            self.verdict.setText("◍ Checking: a small sine plays for some seconds")
        elif report is None:
            self.verdict.setText(
                "Not checked yet. F6 plays a sine at two per cent of the allowed level for some seconds."
            )
            self.findings.show_rows([])
        else:
            worst = VERDICTS[report.verdict]
            assert status is not None
            at = moment_text(status.checked_utc)
            self.verdict.setText(f"{worst}   ·   {len(report.findings)} findings   ·   {at}")
            order = (Verdict.FAIL, Verdict.WARN, Verdict.OK)
            found = sorted(report.findings, key=lambda each: order.index(each.verdict))
            self.findings.show_rows(
                [
                    (VERDICTS[each.verdict], finding_name(each), measured_text(each), expected_text(each))
                    for each in found
                ]
            )

    def _show_choice(self) -> None:
        rig = self.choice.rig
        self.knobs.show_rig(rig)
        if rig is None:
            self.about.setText(f"✖ {self.choice.complaint}. Choose another configuration.")
        else:
            sensor = None if rig.response is None else rig.sensor(rig.response)
            shown = "no sensor on m0" if sensor is None else sensor.model
            chain = (rig.generator.resource, rig.amplifier.model, rig.shaker.model, shown)
            kind = "Every instrument is simulated." if rig.virtual is not None else "Real instruments."
            warning = f"\n⚠ {self.choice.warning}" if self.choice.warning else ""
            self.about.setText(f"{rig.name}. {kind} {' → '.join(chain)} → {rig.daq.product}{warning}")
            self.context.settings.keep_text(SettingKey.BENCH, str(self.choice.path))
        self.context.selection.choose_rig(rig)

    def _find(self) -> None:
        rig = self.choice.rig
        if rig is None:
            return
        self.find_button.setEnabled(False)
        self.instruments.show_rows([("looking", "opening takes seconds; a simulated rig is started first")])
        self.context.background.ask(list_rig_instruments, self._list_found, self._fail_search, rig)

    def _list_found(self, found: InstrumentList) -> None:
        self.find_button.setEnabled(True)
        rows = [("VISA", resource) for resource in found.visa_resources]
        rows += [("DAQ", f"{each.name}: {each.product}, serial {each.serial}") for each in found.daq_devices]
        rows += [("remark", remark) for remark in found.remarks]
        self.instruments.show_rows(rows or [("none", "no instrument answers: check cables and power")])

    def _fail_search(self, error: BaseException) -> None:
        self.find_button.setEnabled(True)
        self.instruments.show_rows([])
        self.context.fail(error)

    def _close(self) -> None:
        self.context.bridge.order(EngineClient.close_bench)
        self.instruments.show_rows([])
