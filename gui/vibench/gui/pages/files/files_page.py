"""Files: the recordings of a folder, listed with state and thumbnail, and shown at any zoom."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from time import monotonic

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QFileDialog, QInputDialog, QVBoxLayout, QWidget

from vibench.acquisition import RecordingError, open_recording, printable
from vibench.acquisition.campaign import VerifiedRecording
from vibench.acquisition.recording import Recording, name_now
from vibench.analysis.live import RecordingOverview, has_overview, kept_levels
from vibench.sim.background import Job

from ...background import LatestRequest, in_next_pass
from ...forms.quantity_edit import LineField
from ...page.app_context import AppContext
from ...page.page import DisplayedResult, FileKind, Page, PageParts
from ...widgets.boxes import ElidedLabel, ScrollArea, column, fill_box, label_for, new_path, push_button, row
from ...widgets.notice import COMPARE, FILES, Notice, NoticeKind
from ...widgets.units import SentenceLabel
from .recording_table import (
    CampaignChoice,
    Levels,
    Listing,
    RecordingTable,
    add_note,
    export_recording,
    facts_text,
    read_levels,
    read_listing,
    thumbnails,
    whole_check,
)
from .spectrogram_view import Pictures

EXPORTS = "Universal file (*.uff);;MATLAB (*.mat);;Text (*.csv)"
LOOK_S = 2.0
"""Interval between checks for deleted files [s]."""
CHECK_WAIT_MS = 250
"""Delay from opening a recording to checking its samples against the seal [ms]."""
PAINTED_MS = 50
"""Delay before the facts of a recording are shown, so that the plots are painted first [ms]."""


class FilesPage(Page):
    """Page with the table of recordings above, and the open recording below."""

    def __init__(self, context: AppContext) -> None:
        super().__init__(context)
        self.table = RecordingTable(context.theme)
        self.pictures = Pictures(context.theme, context.background)
        self.time_histories = self.pictures.time_histories
        self.campaigns = CampaignChoice()
        self.campaigns.chosen.connect(self.table.shown_rows.show_only)
        self._opened: Recording | None = None
        self._pictured = DisplayedResult(lambda: self._opened and self._opened.path, self.pictures)
        views = self.pictures.spectrogram, self.pictures.hidden_motion
        self.displayed_results = (self._pictured, *(view.result for view in views))
        self._listing: Job | None = None
        self._making: Job | None = None
        self._check = LatestRequest(
            context.background, whole_check, self._show_facts, context.fail, CHECK_WAIT_MS, self
        )
        self._wanted: Path | None = None
        self._folder = context.folder
        self._looked_s = 0.0
        parts = PageParts(self.context, FILES, Qt.Orientation.Vertical)
        parts.setAccessibleName("List and recording")
        browser = ScrollArea("List of recordings", self._browser())
        parts.show_parts(browser, ScrollArea("Open recording", self._viewer()), (200, 600))
        fill_box(QVBoxLayout(self), parts)
        QWidget.setTabOrder(self._note, self.table)  # from the table, Tab moves to the time histories
        self.time_histories.range_changed.connect(self._say_view)
        self.time_histories.markers.moved.connect(self._say_view)
        self.table.selectionModel().selectionChanged.connect(lambda *_: self._open_chosen())
        context.recording_requested.connect(self.open_path)
        context.recording_made.connect(lambda _path: self.list_folder())
        context.folder_chosen.connect(self._go_to)

    @property
    def is_done(self) -> bool:
        """Whether a recording is open."""
        return self._opened is not None

    @property
    def opens(self) -> Mapping[FileKind, Callable[[Path], object]]:
        """Functions that open recordings and folders."""
        return {FileKind.RECORDING: self.open_path, FileKind.FOLDER: self._go_to}

    def enter(self) -> None:
        """List the folder again, because there may be new files, and focus the table."""
        self.list_folder()
        self.table.setFocus()

    def refresh(self) -> None:
        """List the folder again if a listed file was deleted."""
        now_s = monotonic()
        if now_s - self._looked_s > LOOK_S:
            self._looked_s = now_s
            if not all(each.path.exists() for each in self.table.recordings.entries):
                self.list_folder()

    def list_folder(self) -> None:
        """List the files of the folder, in the background."""
        folder = self._folder
        self._folder_line.setText(str(folder))
        elsewhere = folder != self.context.folder
        self._goes_to.setText(f"new recordings go to {self.context.folder}" if elsewhere else "")
        if self._listing is not None:
            self._listing.drop()
        self.table.is_listing = True
        self._listing = self.context.background.ask(read_listing, self._refill, self.context.fail, folder)

    def open_path(self, path: Path) -> None:
        """Show a recording from any folder."""
        self.context.page_requested.emit(FILES)
        self._wanted = path
        if path.parent != self._folder and self._folder not in path.parents:
            self._go_to(path.parent)
        # Show the page, then open the file: doing both at once would block the event loop too long.
        in_next_pass(self, lambda: self._choose(path))

    def _choose(self, path: Path) -> None:
        """Open a recording, even if it is already open; selecting a row of the table opens the row's file."""
        before = self._opened
        self.table.choose(path)
        if self._opened is before:
            self._open(path)

    def _refill(self, found: Listing) -> None:
        entries, shown = found.recordings, self.table.recordings
        self.table.is_listing = False
        self.campaigns.offer(found.campaigns)
        # A late list must not restore an older selection: use the newest.
        chosen = self.table.chosen_paths() if self._wanted is None else (self._wanted,)
        self._wanted = None
        shown.show_entries(entries)
        self._count.setText(f"{len(entries)} recording{'s' if len(entries) != 1 else ''}")
        missing = shown.missing_pictures()
        if missing:
            self.context.background.ask(thumbnails, shown.show_thumbnails, self.context.fail, missing)
        if chosen:
            # A recording that has ended since the last list has a new name.
            self.table.choose(*map(name_now, chosen))
        elif entries and self._opened is None:
            self.table.selectRow(0)

    def _open_chosen(self) -> None:
        paths = self.table.chosen_paths()
        if paths and paths != (self._wanted,):
            self._wanted = None  # the user has since selected others
        for button in (self._compare, self._export, self._note):
            button.setEnabled(bool(paths))
        if paths and (self._opened is None or self._opened.path != paths[0]):
            self._open(paths[0])

    def _open(self, path: Path) -> None:
        """Open a recording; if it has no overview, compute one in the background before showing it."""
        if self._making is not None:
            self._making.drop()
            self._making = None
        self._close()
        try:
            recording = open_recording(path)
        except RecordingError as error:
            self._title.setText(path.name)
            self._facts.setText(str(error))
            self.pictures.show_recording(None, printable(str(error)))
            self.context.fail(error)
            return
        self._opened = recording
        self._title.setText(recording.path.name)
        if recording.path != path:
            # The recording ended after the folder was listed, so its name has changed.
            self._wanted = recording.path
            self.list_folder()
        if recording.samples == 0:
            self._show({})
        elif has_overview(recording):
            self._take_next(recording, {})
        else:
            self._facts.setText("Reading all samples, because this file has no overview…")
            self._making = self.context.background.ask(read_levels, self._show, self.context.fail, path)

    def _take_next(self, recording: Recording, levels: Levels) -> None:
        """Read one channel per pass of the event loop; all channels at once would block the window."""
        if recording is not self._opened:
            return
        if len(levels) == len(recording.roles):
            self._show(levels)
            return
        role = recording.roles[len(levels)]
        levels[role] = kept_levels(recording, role)
        self.time_histories.prepare(recording.channel(role))
        in_next_pass(self, lambda: self._take_next(recording, levels))

    def _show(self, levels: Levels) -> None:
        self._making = None
        if self._opened is None:
            return
        # Draw the plots before checking the seal, which takes as long as drawing.
        QTimer.singleShot(PAINTED_MS, self, self._show_facts)
        if not self._opened.is_growing:
            self._check.ask(self._opened.path)
        hint = "Computing the plot…" if self._opened.samples else "This recording contains no samples."
        self.pictures.show_recording(RecordingOverview(self._opened, levels), hint)
        self._pictured.show(self._opened.path)
        self._say_view()

    def _show_facts(self, found: VerifiedRecording | None = None) -> None:
        if self._opened is not None:
            self._facts.setText(facts_text(self._opened, found))

    def _close(self) -> None:
        self._check.drop()
        self.pictures.show_recording(None, "Reading the recording…")
        self._pictured.show(None)
        if self._opened is not None:
            self._opened.close()
            self._opened = None

    def _say_view(self) -> None:
        if self._opened is None:
            return
        low_s, high_s = self.time_histories.view_s
        text = f"Shown: {low_s:.6g} to {high_s:.6g} s"
        if markers_s := self.time_histories.markers.values:
            early_s, late_s = markers_s
            between_s = late_s - early_s
            rate = f" = 1 / {1 / between_s:.5g} Hz" if between_s > 0 else ""
            text += f"      Markers: {early_s:.6g} s, {late_s:.6g} s, {between_s:.6g} s apart{rate}"
        self._view.setText(text)

    def _choose_folder(self) -> None:
        chosen = QFileDialog.getExistingDirectory(self, "Folder with recordings", str(self._folder))
        if chosen:
            self._go_to(Path(chosen))

    def _typed_folder(self) -> None:
        # Do not use pathlib, which raises errors for names that no operating system allows.
        folder = Path(os.path.expanduser(self._folder_line.text()))  # noqa: PTH111
        if folder == self._folder:
            return
        if os.path.isdir(folder):  # noqa: PTH112
            self._go_to(folder)
        else:
            self.context.warn(
                f"{folder} is not a folder.", "The list is unchanged.", "Type or choose another folder."
            )
            self._folder_line.setText(str(self._folder))

    def _go_to(self, folder: Path) -> None:
        """List another folder; the folder of new recordings does not change."""
        self._folder = folder
        self.table.recordings.show_entries(())
        self._count.setText("◌ reading…")
        self.list_folder()

    def _choose_export(self) -> None:
        path = self.table.chosen_paths()[0]
        if (target := new_path(self, "Export", path.with_suffix(".uff"), EXPORTS)) is not None:
            self.context.background.ask(export_recording, self._say_done, self.context.fail, path, target)

    def _say_done(self, files: tuple[Path, ...]) -> None:
        self.context.say(Notice(NoticeKind.INFO, f"Written: {', '.join(map(str, files))}"))

    def _write_note(self) -> None:
        text, is_given = QInputDialog.getMultiLineText(self, "Add a note", "The recording stores the note.")
        if is_given and text.strip():
            self.context.background.ask(
                add_note, self._choose, self.context.fail, self.table.chosen_paths()[0], text.strip()
            )

    def _hand_to_compare(self) -> None:
        paths = self.table.chosen_paths()
        if paths:
            self.context.comparison_requested.emit(paths)
            self.context.page_requested.emit(COMPARE)

    def _browser(self) -> QWidget:
        self._folder_line = LineField(str(self._folder))
        self._folder_line.editingFinished.connect(self._typed_folder)
        search = LineField()
        search.setPlaceholderText("name, state, excitation…")
        search.setClearButtonEnabled(True)
        search.textChanged.connect(self.table.shown_rows.setFilterFixedString)
        self._goes_to = ElidedLabel(rank="second")
        self._count = ElidedLabel(rank="second")
        bar = row(
            label_for("F&older", self._folder_line, "Folder of the recordings"),
            (self._folder_line, 3),
            push_button("&Choose…", "Choose another folder", self._choose_folder),
            (self.campaigns, 1),
            label_for("Sea&rch", search, "Search in the list"),
            (search, 1),
            self._count,
        )
        browser = column(bar, self._goes_to, self.table)
        browser.setAccessibleName("Browser")
        return browser

    def _viewer(self) -> QWidget:
        self._title = ElidedLabel("No recording is open", rank="title")
        self._compare = push_button(
            "Co&mpare", "Overlay the selected recordings on the Compare page", self._hand_to_compare
        )
        self._export = push_button("E&xport…", "Export the recording for other programs", self._choose_export)
        self._note = push_button("Add a &note…", "Store a note in the recording", self._write_note)
        for button in (self._compare, self._export, self._note):
            button.setEnabled(False)
        self._facts = SentenceLabel("Choose a recording in the list above.", rank="second")
        self._view = ElidedLabel()
        self._markers = push_button("Mar&kers", "Measure between two markers", lambda: None)
        self._markers.setCheckable(True)
        self._markers.toggled.connect(self.time_histories.markers.show)
        bar = row(
            (self._view, 1),
            self._markers,
            push_button("Show &all", "Show the whole recording (Home)", self.time_histories.show_all),
            push_button("Zoom &in", "Show a shorter time range (+)", lambda: self.time_histories.zoom(0.5)),
            push_button("Zoom o&ut", "Show a longer time range (-)", lambda: self.time_histories.zoom(2.0)),
        )
        heading = row((self._title, 1), self._compare, self._export, self._note)
        viewer = column(heading, self._facts, (self.pictures, 1), bar)
        viewer.setAccessibleName("Recording")
        return viewer
