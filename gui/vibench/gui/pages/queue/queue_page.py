"""The Queue page: a campaign as a table, its estimated end, and the state of each recording."""

import tomllib
from collections.abc import Callable, Mapping
from datetime import datetime, timedelta
from functools import partial
from pathlib import Path

from pydantic import ValidationError
from PySide6.QtCore import Signal
from PySide6.QtWidgets import (
    QCheckBox,
    QFileDialog,
    QFormLayout,
    QGridLayout,
    QGroupBox,
    QVBoxLayout,
)

from vibench.acquisition import (
    ConfigurationError,
    all_shipped,
    load_campaign,
    save_toml,
    toml_text,
    validate,
)
from vibench.acquisition.campaign import ExistingRecordings
from vibench.acquisition.engine import EngineState, EngineStatus, Supervision
from vibench.acquisition.plan import Campaign, Range, RangeSpacing, SweepAxis
from vibench.acquisition.rig import Rig
from vibench.sim import count_text

from ...background import LatestRequest
from ...forms.editor import Choice
from ...forms.model_form import complaints_of
from ...forms.quantity_edit import QuantityEdit
from ...page.app_context import AppContext, SettingKey
from ...page.page import DisplayedResult, FileKind, History, Page, SideAndPicture
from ...page.user_actions import UserActions
from ...widgets.boxes import ProgressBar, column, fill_box, label_for, push_button, row, titled_box
from ...widgets.notice import QUEUE, clock, notice_of
from ...widgets.read_table import ReadTable
from ...widgets.units import SentenceLabel
from .draft import (
    CampaignPreview,
    move_up,
    point_rows,
    preview_campaign,
    remove_entry,
    with_measurement,
    with_sweep,
)

_AXES = {
    SweepAxis.LEVEL: ("level", "Vpp", 0.05, 10.0),
    SweepAxis.FREQUENCY: ("frequency", "Hz", 150.0, 350.0),
}


class SweepForm(QGroupBox):
    """Form that adds a sweep, which repeats the test of the Test page."""

    wanted = Signal(object, object)
    """`SweepAxis` and `Range` of the requested sweep."""
    refused = Signal(str)

    def __init__(self) -> None:
        super().__init__("Sweep the test over")
        self.axis = Choice(items=(name for name, *_ in _AXES.values()))
        self.spacing = Choice(items=RangeSpacing)
        self.start, self.stop = QuantityEdit("Vpp", float), QuantityEdit("Vpp", float)
        self.count = QuantityEdit("", int)
        self.count.show_content(5)
        layout = QFormLayout(self)
        for text, widget in (
            ("Axis", self.axis),
            ("From", self.start),
            ("To", self.stop),
            ("Points", self.count),
            ("Distances", self.spacing),
        ):
            layout.addRow(label_for(text, widget, f"{text} of the sweep"), widget)
        layout.addRow(push_button("Add &sweep", "Add a sweep of the test on the Test page", self._add))
        self.axis.currentIndexChanged.connect(self._turn)
        self._turn()

    def _turn(self, *_: object) -> None:
        """Show the unit and usual values of the selected axis."""
        _word, unit, low, high = list(_AXES.values())[self.axis.currentIndex()]
        for edit, value in ((self.start, low), (self.stop, high)):
            edit.show_unit(unit)
            edit.show_content(value)

    def _add(self) -> None:
        unit = list(_AXES.values())[self.axis.currentIndex()][1]
        fields = {
            "start": (f"From ({unit})", self.start),
            "stop": (f"To ({unit})", self.stop),
            "count": ("Points", self.count),
        }
        unread = [f"{name}: {edit.complaint}" for name, edit in fields.values() if edit.complaint]
        if unread:
            self.refused.emit("; ".join(unread))
            return
        given = {
            "start": self.start.content(),
            "stop": self.stop.content(),
            "count": self.count.content(),
            "spacing": self.spacing.currentText(),
        }
        try:
            values = Range.model_validate(given)
        except ValidationError as error:
            named = {loc: fields[str(loc[0])][0] if loc else "Range" for loc in complaints_of(error)}
            self.refused.emit(
                "; ".join(f"{named[loc]}: {text}" for loc, text in complaints_of(error).items())
            )
        else:
            self.wanted.emit(list(_AXES)[self.axis.currentIndex()], values)


LOOK_MS = 50
"""Delay from the last edit of the campaign to its preview [ms]."""


class QueuePage(Page):
    """Page that edits the next campaign and shows the running campaign."""

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self._actions = UserActions(context, self)
        self.edits = History(context.selection.choose_campaign)
        self._preview: CampaignPreview | None = None
        self.choice = Choice()
        self.entries = ReadTable(
            "Entries of the campaign",
            ("entry", "kind", "recordings", "duration"),
            "Load a campaign above, or add the test of the Test page, once or as a sweep.",
            wide=1,
        )
        # Without this, the remaining width for the second column would be only a few letters.
        self.entries.setMinimumWidth(25 * self.fontMetrics().height())
        self.rows = ReadTable(
            "Recordings of the campaign",
            ("", "recording", "level", "state"),
            "Each recording of the campaign is listed here, with its state.",
        )
        self.sweep = SweepForm()
        self.summary = SentenceLabel(name="Summary of the campaign")
        self._summed, self._listed = self.displayed_results = (
            DisplayedResult(lambda: self._inputs, self.summary),
            DisplayedResult(lambda: self._inputs, self.entries),
        )
        self.progress = ProgressBar("Progress of the campaign", "not running")
        self.arm_button = push_button(
            "Arm the ca&mpaign…",
            "Arm, and describe what will be played",
            partial(self._arm, ExistingRecordings.REFUSE),
            "first",
        )
        self.resume_button = push_button(
            "Resume: arm what is missin&g…",
            "Keep the complete recordings of the folder; record only the missing ones",
            partial(self._arm, ExistingRecordings.RESUME),
        )
        self.unattended = QCheckBox("Unattended")
        self.unattended.setToolTip(
            "Ticked: the engine records and enforces all limits without the window; use 'vibench watch' "
            "and 'vibench stop'.\nNot ticked: the drive ramps down when the window does not respond."
        )
        self.unattended.setChecked(True)
        self.hold_button = push_button(
            "Hold (drive on)", "Hold the run; the drive stays on", self._actions.hold_or_resume
        )
        self._looking = LatestRequest(
            context.looks, preview_campaign, self._show_preview, context.fail, LOOK_MS, self
        )
        self._lay_out()
        self.context.selection.campaign_changed.connect(self._show_campaign)
        self.context.selection.rig_changed.connect(self._show_campaign)
        self.context.folder_chosen.connect(lambda _folder: self._show_campaign())
        self.context.recording_made.connect(lambda _path: self._show_campaign())
        self.choice.activated.connect(self._take)
        self.sweep.wanted.connect(self._add_sweep)
        self.sweep.refused.connect(lambda text: self.context.warn(text, next_step="Correct the sweep."))
        self._restore()

    @property
    def is_done(self) -> bool:
        """Whether every recording of the campaign exists."""
        status = self.context.bridge.status
        rows = () if status is None else status.rows
        return len(rows) > 1 and all(row.state in ("recorded", "kept") for row in rows)

    def refresh(self) -> None:
        """Update the states of the recordings and the progress."""
        status = self.context.bridge.status
        state = self.context.bridge.state
        campaign = self.context.selection.campaign
        for button in (self.arm_button, self.resume_button):
            button.setEnabled(state is EngineState.READY and campaign is not None)
        self.hold_button.setEnabled(state in (EngineState.RUNNING, EngineState.HELD))
        self.hold_button.setText("Go on" if state is EngineState.HELD else "Hold (drive on)")
        self.rows.show_rows(point_rows(self._preview, () if status is None else status.rows, state))
        if campaign is not None and self._preview is not None:
            self._say_summary(campaign, self._preview)  # update the estimated end
        self._show_progress(status)

    @property
    def opens(self) -> Mapping[FileKind, Callable[[Path], object]]:
        """Function that opens campaigns."""
        return {FileKind.CAMPAIGN: self.open_file}

    @property
    def _inputs(self) -> tuple[Campaign | None, Rig | None]:
        return self.context.selection.campaign, self.context.selection.rig

    def leave(self) -> None:
        """Store the edited campaign in the settings."""
        campaign = self.context.selection.campaign
        self.context.settings.keep_text(SettingKey.CAMPAIGN, "" if campaign is None else toml_text(campaign))

    def open_file(self, path: Path) -> None:
        """Load the campaign of a file for editing."""
        try:
            self.context.selection.choose_campaign(load_campaign(path))
            self.context.note_file(path)
        except ConfigurationError as error:
            self.context.fail(error)

    def _show_progress(self, status: EngineStatus | None) -> None:
        run = None if status is None else status.run
        if run is None:
            self.progress.show_share(0.0, "not running")
            return
        left_s = max(0.0, run.campaign_total_s - run.campaign_elapsed_s)
        end = datetime.now().astimezone() + timedelta(seconds=left_s)
        self.progress.show_share(
            run.campaign_elapsed_s / max(run.campaign_total_s, 1e-9),
            f"{run.number} of {run.count}, {clock(left_s)} left, ends about {end:%H:%M}",
        )

    def _show_campaign(self) -> None:
        campaign, rig = self._inputs
        if campaign is None:
            self._looking.drop()
            self._preview = None
            self.entries.show_rows(())
            for result in self.displayed_results:
                result.show(None)
            self.summary.setText("No campaign yet: open a campaign, or add the test of the Test page.")
            return
        self.edits.note(campaign)
        self.summary.setText(f"{campaign.name}: …")
        self._preview = None
        self._summed.show(None)
        self._listed.mark()
        self._looking.ask((campaign, rig, self.context.folder / campaign.name))

    def _show_preview(self, preview: CampaignPreview) -> None:
        campaign = self.context.selection.campaign
        if campaign is None:
            return
        self._preview = preview
        for result in self.displayed_results:
            result.show(self._inputs)
        row = self.entries.currentRow()
        self.entries.show_rows(preview.rows)
        self.entries.selectRow(min(row, len(preview.rows) - 1))
        self._say_summary(campaign, preview)

    def _say_summary(self, campaign: Campaign, preview: CampaignPreview) -> None:
        size = "" if preview.size_bytes is None else f"   ·   {preview.size_bytes / 1e9:.2f} GB"
        end = datetime.now().astimezone() + timedelta(seconds=preview.duration_s)
        self.summary.setText(
            f"{campaign.name}: {count_text(len(preview.levels), 'recording')}   ·   "
            f"takes {clock(preview.duration_s)}   ·   "
            f"if started now, it ends about {end:%H:%M}{size}   ·   in {self.context.folder / campaign.name}"
        )

    def _add_test(self) -> None:
        measurement = self._actions.complete_test()
        if measurement is not None:
            chosen = self.context.selection
            chosen.choose_campaign(with_measurement(chosen.campaign, measurement))

    def _add_sweep(self, axis: SweepAxis, values: Range) -> None:
        chosen, measurement = self.context.selection, self._actions.complete_test()
        if measurement is None:
            return
        try:
            campaign = with_sweep(chosen.campaign, measurement, axis, values, chosen.rig)
        except ConfigurationError as error:
            self.context.fail(error)
        else:
            chosen.choose_campaign(campaign)

    @property
    def _chosen_entry(self) -> int:
        """Row number of the selected test or sweep; -1 if no row is selected, or if the table is outdated."""
        return self.entries.currentRow() if self.entries.isEnabled() else -1

    def _remove(self) -> None:
        campaign, number = self.context.selection.campaign, self._chosen_entry
        if campaign is not None and number >= 0:
            self.context.selection.choose_campaign(remove_entry(campaign, number))

    def _move_up(self) -> None:
        campaign, number = self.context.selection.campaign, self._chosen_entry
        if campaign is not None and number > 0:
            self.context.selection.choose_campaign(move_up(campaign, number))
            self.entries.setCurrentCell(number - 1, 0)

    def _arm(self, existing: ExistingRecordings) -> None:
        is_unattended = self.unattended.isChecked()
        self._actions.arm_campaign(
            existing, Supervision.UNATTENDED if is_unattended else Supervision.ATTENDED
        )

    def _open(self) -> None:
        given, _ = QFileDialog.getOpenFileName(
            self, "Open a campaign", str(self.context.folder), "Campaigns (*.toml)"
        )
        if given:
            self.open_file(Path(given))

    def _save(self) -> None:
        campaign = self.context.selection.campaign
        if campaign is None:
            self.context.warn("There is no campaign to save.", next_step="Add a test first.")
            return
        wish = str(self.context.folder / f"{campaign.name}.toml")
        given, _ = QFileDialog.getSaveFileName(self, "Save the campaign", wish, "Campaigns (*.toml)")
        if given:
            try:
                save_toml(campaign, Path(given))
            except ConfigurationError as error:
                self.context.fail(error)

    def _take(self, row: int) -> None:
        if row > 0:
            self.open_file(all_shipped("campaigns")[row - 1])

    def _restore(self) -> None:
        kept = self.context.settings.text(SettingKey.CAMPAIGN)
        if kept:
            try:
                campaign = validate(tomllib.loads(kept), Campaign, "the last campaign")
            except (ConfigurationError, tomllib.TOMLDecodeError) as error:
                self.context.say(notice_of(error, "It was ignored; open or create another campaign."))
            else:
                self.context.selection.choose_campaign(campaign)
        self._show_campaign()

    def _lay_out(self) -> None:
        self.choice.setAccessibleName("Known campaigns")
        self.choice.setToolTip("Campaigns that come with vibench")
        self.choice.addItem("load a campaign…")
        for path in all_shipped("campaigns"):
            self.choice.addItem(path.stem.replace("_", " "))
        files = QGridLayout()
        files.addWidget(push_button("Open…", "Open a campaign from a TOML file", self._open), 0, 0)
        files.addWidget(push_button("Save as…", "Save the campaign as a TOML file", self._save), 0, 1)
        edits = row(
            push_button("&Add the test", "Add the test of the Test page", self._add_test),
            push_button("Move &up", "Move the chosen entry up", self._move_up),
            push_button("&Remove", "Remove the chosen entry", self._remove),
        )
        campaign = titled_box("Campaign", self.entries, edits)
        attended = SentenceLabel("The campaign continues if the window freezes or is closed", rank="second")
        left = column(self.choice, files, (campaign, 1), self.sweep)
        right = column(
            self.summary,
            self.arm_button,
            self.resume_button,
            self.hold_button,
            row(self.unattended, (attended, 1)),
            self.progress,
            (titled_box("Recordings", self.rows), 1),
        )
        fill_box(QVBoxLayout(self), SideAndPicture(self.context, QUEUE, left, right))
