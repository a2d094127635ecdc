"""Table of recordings: one row per file, with state, thumbnail and campaign."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import (
    QAbstractTableModel,
    QItemSelectionModel,
    QModelIndex,
    QPersistentModelIndex,
    QPointF,
    QSize,
    QSortFilterProxyModel,
    Qt,
    Signal,
)
from PySide6.QtGui import QColor, QGuiApplication, QPainter, QPaintEvent, QPen, QPixmap
from PySide6.QtWidgets import QAbstractItemView, QTableView

from vibench.acquisition import RecordingError, open_recording, printable
from vibench.acquisition.campaign import (
    UNREADABLE,
    CatalogueEntry,
    JournalPointState,
    VerifiedRecording,
    list_recordings,
    read_journal,
    verify_recordings,
)
from vibench.acquisition.recording import (
    JOURNAL_SUFFIX,
    Recording,
    RecordingState,
    SealDepth,
    SealState,
)
from vibench.analysis.live import THUMBNAIL_COLUMNS, OverviewLevel, Thumbnail, overview_levels, thumbnail
from vibench.sim import count_text

from ...forms.editor import Choice
from ...widgets.boxes import hint_in_list, plain_tip
from ...widgets.notice import clock, moment_text, outcome_text
from ...widgets.read_table import make_readable
from ...widgets.theme import Theme

Levels = dict[str, tuple[OverviewLevel, ...]]

NOTE = "note"
"""Name under which a recording stores a note of the user; further notes are numbered."""


@dataclass(frozen=True)
class ListedRecording:
    """One recording as a row of the table."""

    path: Path
    catalogue_entry: CatalogueEntry

    @property
    def name(self) -> str:
        """Path relative to the folder, without suffix; unique, even among attempts at a measurement."""
        return self.catalogue_entry.path.removesuffix(".part").removesuffix(".h5")

    @property
    def excitation_text(self) -> str:
        """Excitation and band: ``"sine sweep 150 to 350 Hz"``."""
        low, high = self.catalogue_entry.frequency_low_hz, self.catalogue_entry.frequency_high_hz
        band = "" if low is None else f"{low:g} Hz" if high in (None, low) else f"{low:g} to {high:g} Hz"
        return f"{self.catalogue_entry.kind.replace('_', ' ')} {band}".strip()


@dataclass(frozen=True)
class ListedCampaign:
    """State of a campaign, from its journal."""

    name: str
    states: tuple[JournalPointState, ...]
    """State of each measurement of the campaign."""
    files: frozenset[Path]
    """Recording of the last attempt at each measurement."""

    @property
    def text(self) -> str:
        """Summary: ``"✔ night: 40 of 40 done"``, ``"▲ night: 3 of 40 done, 2 failed, 35 queued"``."""
        done = self.states.count(JournalPointState.DONE)
        others = [
            f"{self.states.count(state)} {state.value}"
            for state in JournalPointState
            if state is not JournalPointState.DONE and state in self.states
        ]
        symbol = "✔" if done == len(self.states) else "▲"
        return ", ".join([f"{symbol} {self.name}: {done} of {len(self.states)} done", *others])


@dataclass(frozen=True)
class Listing:
    """Contents of a folder: its recordings and campaigns."""

    recordings: tuple[ListedRecording, ...] = ()
    campaigns: tuple[ListedCampaign, ...] = ()


def read_listing(folder: Path) -> Listing:
    """Return the recordings and campaigns in a folder; a missing folder counts as empty."""
    if not folder.is_dir():
        return Listing()
    recordings = tuple(ListedRecording(folder / each.path, each) for each in list_recordings(folder))
    return Listing(recordings, tuple(_campaigns(folder)))


def _campaigns(folder: Path) -> Iterator[ListedCampaign]:
    for path in sorted(folder.rglob(f"*{JOURNAL_SUFFIX}")):
        try:
            points = read_journal(path)
        except RecordingError:
            # The file may belong to another program.
            continue
        files = frozenset(path.parent / each.file for each in points if each.file)
        name = path.name.removesuffix(JOURNAL_SUFFIX)
        yield ListedCampaign(name, tuple(each.state for each in points), files)


def export_recording(path: Path, target: Path) -> tuple[Path, ...]:
    """Export a recording in the format of the target's suffix; return the paths written."""
    from vibench.analysis.exchange import Format, excerpt, export_samples  # noqa: PLC0415 - slow to load

    with open_recording(path) as recording:
        return export_samples(excerpt(recording), Format(target.suffix[1:].lower()), target)


def add_note(path: Path, text: str) -> Path:
    """Add a note to a recording."""
    with open_recording(path) as recording:
        recording.save_results(NOTE, {}, {"text": text}, roles=())
    return path


def notes_of(recording: Recording) -> tuple[str, ...]:
    """Return the plan's notes, then later notes, oldest first; if unreadable, an error text."""
    plan = str(recording.plan.get("notes", ""))
    has_more = any(name.startswith(NOTE) for name in recording.result_names)
    try:
        added = sorted(recording.results.values(), key=lambda each: each.saved_utc) if has_more else []
    except RecordingError as error:
        return tuple(filter(None, (plan, f"✖ {error}")))
    more = [str(each.settings.get("text", "")) for each in added if each.name.startswith(NOTE)]
    return tuple(filter(None, (plan, *more)))


def thumbnails(paths: tuple[Path, ...]) -> dict[Path, Thumbnail | None]:
    """Return the thumbnails of recordings; None for a file that cannot be read."""
    return {path: thumbnail(path) for path in paths}


def read_levels(path: Path) -> Levels:
    """Return the stored overview of a recording, or compute one from all samples."""
    with open_recording(path) as recording:
        return overview_levels(recording)


_STATE_SYMBOLS: dict[str, str] = {
    RecordingState.COMPLETE: "✔",
    RecordingState.STOPPED: "■",
    RecordingState.FAILED: "✖",
    RecordingState.INTERRUPTED: "▲",
    RecordingState.RECORDING: "●",
}


def _symbol(state: str) -> str:
    """Return the symbol of a recording's state, which is readable without colour."""
    return _STATE_SYMBOLS.get(state, "✖")


def size_text(size: int) -> str:
    """Return a file size: ``"344 MB"``."""
    step = 1000.0
    shown, units = float(size), ["B", "kB", "MB", "GB", "TB"]
    while shown >= step and len(units) > 1:
        shown, units = shown / step, units[1:]
    return f"{shown:.3g} {units[0]}" if shown < step else f"{shown:.0f} {units[0]}"


def duration_text(duration_s: float) -> str:
    """Return a duration: ``"4.25 s"``, ``"3:20"``, ``"1:02:03"``."""
    return f"{duration_s:.3g} s" if duration_s < 60 else clock(duration_s)


def role_text(role: str) -> str:
    """Return the label of a channel: ``"m0 velocity"``."""
    return printable(role.replace("_", " "))


def whole_check(path: Path) -> VerifiedRecording:
    """Check all samples and results against their seals; takes seconds for a long recording."""
    return verify_recordings(path)[0]


def facts_text(recording: Recording, found: VerifiedRecording | None) -> str:
    """Return a line about a recording; ``found`` is the result of `whole_check`, or None before the check."""
    parts = [
        f"{_symbol(recording.state)} {outcome_text(recording.state, recording.reason)}",
        recording.origin.value,
        duration_text(recording.duration_s),
        f"{recording.sample_rate_hz:g} samples/s, {count_text(len(recording.roles), 'channel')}",
        f"bench {recording.bench.get('name', 'unnamed')}",
    ]
    if found is None:
        quick = recording.check_seal(SealDepth.QUICK)
        found = VerifiedRecording("", quick.state.value, quick.sentence, quick.seal, {})
    if found.is_bad or found.verdict == SealState.UNSEALED:
        parts.insert(0, f"✖ {found.verdict.replace('_', ' ')}: {found.sentence}")
    elif found.verdict == SealState.INTACT:
        parts.append(found.sentence)
    if recording.overloads:
        parts.append(f"{count_text(len(recording.overloads), 'overload')} (red)")
    if recording.gaps:
        lost = sum(each.last_sample - each.first_sample + 1 for each in recording.gaps)
        parts.append(f"{count_text(lost, 'sample')} lost")
    parts += [f"note: {each}" for each in notes_of(recording)]
    return "  ·  ".join(parts)


ALL = "All recordings"


class CampaignChoice(Choice):
    """List to choose all recordings or one campaign's recordings; hidden in a folder without campaigns."""

    chosen = Signal(object)
    """Files of the selected campaign, as a set; None for all recordings."""

    def __init__(self) -> None:
        super().__init__("Campaign")
        self.setToolTip("Show only recordings of one campaign")
        self.setMinimumContentsLength(16)
        self._campaigns: tuple[ListedCampaign, ...] = ()
        self.currentIndexChanged.connect(lambda _index: self._choose())
        self.hide()

    def offer(self, campaigns: tuple[ListedCampaign, ...]) -> None:
        """Offer these campaigns for selection, and keep the present selection."""
        before = self.currentIndex()
        name = self._campaigns[before - 1].name if before > 0 else ""
        self._campaigns = campaigns
        texts = [printable(each.text) for each in campaigns]
        kept = (text for text, each in zip(texts, campaigns, strict=True) if each.name == name)
        self.replace_items([ALL, *texts], next(kept, ALL))
        self.setVisible(bool(campaigns))
        self._choose()

    def _choose(self) -> None:
        place = self.currentIndex()
        self.chosen.emit(self._campaigns[place - 1].files if place > 0 else None)


Index = QModelIndex | QPersistentModelIndex
_NOWHERE = QModelIndex()
HEADINGS = ("Response", "Name", "State", "Verdict", "Began", "Excitation", "Level", "Length", "Size")
PICTURE, NAME = 0, 1
_NUMBERS = tuple(HEADINGS.index(each) for each in ("Level", "Length", "Size"))
_THIS_ROW_ALONE = QItemSelectionModel.SelectionFlag.ClearAndSelect | QItemSelectionModel.SelectionFlag.Rows
_THIS_ROW_TOO = QItemSelectionModel.SelectionFlag.Select | QItemSelectionModel.SelectionFlag.Rows
PATH_ROLE = Qt.ItemDataRole.UserRole
SORT_ROLE = Qt.ItemDataRole.UserRole + 1
_MEASURED_ROWS = 24
"""Number of rows that determine the column widths: more than fit on a screen, but quick to measure."""
THUMBNAIL_SIZE = QSize(THUMBNAIL_COLUMNS, 30)


Cell = tuple[str, str | float]
"""Text of a table cell, and the value by which the column is sorted."""


class RecordingModel(QAbstractTableModel):
    """Table model of the recordings in a folder; thumbnails are added later."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self.entries: tuple[ListedRecording, ...] = ()
        self._rows: tuple[tuple[Cell, ...], ...] = ()
        self._thumbnails: dict[Path, Thumbnail | None] = {}
        self._pictures: dict[Path, QPixmap] = {}

    def show_entries(self, entries: tuple[ListedRecording, ...]) -> None:
        """Replace the list of recordings if it has changed; keep the thumbnails of files in both lists."""
        if entries == self.entries:
            return
        self.beginResetModel()
        self.entries = entries
        self._rows = tuple(_cells(entry) for entry in entries)
        kept = {entry.path for entry in entries}
        self._thumbnails = {path: each for path, each in self._thumbnails.items() if path in kept}
        self._pictures = {path: each for path, each in self._pictures.items() if path in kept}
        self.endResetModel()

    def missing_pictures(self) -> tuple[Path, ...]:
        """Return the readable files that have no thumbnail yet."""
        readable = (each.path for each in self.entries if each.catalogue_entry.state != UNREADABLE)
        return tuple(path for path in readable if path not in self._thumbnails)

    def show_thumbnails(self, found: dict[Path, Thumbnail | None]) -> None:
        """Add thumbnails to the rows of their recordings."""
        self._thumbnails |= found
        if self.entries:
            self.dataChanged.emit(self.index(0, PICTURE), self.index(len(self.entries) - 1, PICTURE))

    def retheme(self, theme: Theme) -> None:
        """Redraw the thumbnails in the colours of another theme."""
        self._theme = theme
        self._pictures.clear()
        self.show_thumbnails({})

    def rowCount(self, parent: Index = _NOWHERE) -> int:
        """Return the number of rows: one per recording."""
        return 0 if parent.isValid() else len(self.entries)

    def columnCount(self, parent: Index = _NOWHERE) -> int:
        """Return the number of columns."""
        return 0 if parent.isValid() else len(HEADINGS)

    def headerData(
        self, section: int, orientation: Qt.Orientation, role: int = Qt.ItemDataRole.DisplayRole
    ) -> Any:
        """Return the headings of columns; rows have no headings."""
        if orientation is Qt.Orientation.Horizontal and role == Qt.ItemDataRole.DisplayRole:
            return HEADINGS[section]
        return None

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """Return text, thumbnail, tooltip or sorting value of a cell, depending on the role."""
        entry, column = self.entries[index.row()], index.column()
        text, sorting = self._rows[index.row()][column]
        content: Any = None
        match role:
            case Qt.ItemDataRole.DisplayRole:
                content = text
            case Qt.ItemDataRole.DecorationRole if column == PICTURE:
                content = self._picture(entry.path)
            case Qt.ItemDataRole.ToolTipRole:
                facts = (str(entry.path), entry.catalogue_entry.reason, entry.catalogue_entry.notes)
                content = plain_tip("\n".join(map(printable, filter(None, facts))))
            case Qt.ItemDataRole.TextAlignmentRole if column in _NUMBERS:
                content = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
            case Qt.ItemDataRole.AccessibleTextRole:
                content = f"{HEADINGS[column]}: {text or 'picture'}"
            case Qt.ItemDataRole.UserRole:
                content = entry.path
            case _ if role == SORT_ROLE:
                content = sorting
        return content

    def _picture(self, path: Path) -> QPixmap | None:
        """Return the thumbnail of a row, drawn when first visible; drawing all rows would take too long."""
        found = self._thumbnails.get(path)
        if found is not None and path not in self._pictures:
            self._pictures[path] = _paint_thumbnail(found, self._theme)
        return self._pictures.get(path)


class ShownRows(QSortFilterProxyModel):
    """Sorted rows of the table that match the search text and belong to the selected campaign."""

    _only: frozenset[Path] | None = None

    def show_only(self, paths: frozenset[Path] | None) -> None:
        """Show only the rows of these files; None shows all rows."""
        self.beginFilterChange()
        self._only = paths
        self.endFilterChange()

    def filterAcceptsRow(self, row: int, parent: Index) -> bool:
        """Return whether a row matches both the search text and the selected campaign."""
        if not super().filterAcceptsRow(row, parent):
            return False
        return self._only is None or self.sourceModel().index(row, NAME).data(PATH_ROLE) in self._only


class RecordingTable(QTableView):
    """Sortable table; several rows can be selected."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        make_readable(self, "Recordings")
        self.is_listing = False
        self.recordings = RecordingModel(theme)
        self.shown_rows = ShownRows(self)
        self.shown_rows.setSourceModel(self.recordings)
        self.shown_rows.setSortRole(SORT_ROLE)
        self.shown_rows.setFilterKeyColumn(-1)
        self.shown_rows.setFilterCaseSensitivity(Qt.CaseSensitivity.CaseInsensitive)
        self.setModel(self.shown_rows)
        self.setSortingEnabled(True)
        self.sortByColumn(HEADINGS.index("Began"), Qt.SortOrder.DescendingOrder)
        self.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.setIconSize(THUMBNAIL_SIZE)
        self.verticalHeader().setDefaultSectionSize(THUMBNAIL_SIZE.height() + 6)
        self.horizontalHeader().setResizeContentsPrecision(_MEASURED_ROWS)
        self.horizontalHeader().setHighlightSections(False)
        self.horizontalHeader().setStretchLastSection(True)
        self.setColumnWidth(PICTURE, THUMBNAIL_SIZE.width() + 10)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw a hint while the table is empty."""
        super().paintEvent(event)
        if self.shown_rows.rowCount() == 0:
            words = "No recordings in this folder yet: choose another folder, or run a test (Ctrl+3)."
            if self.recordings.entries:
                words = "No recording matches the search and the selected campaign."
            elif self.is_listing:
                words = "The folder is being read."
            hint_in_list(self, words)

    def retheme(self, theme: Theme) -> None:
        """Redraw the thumbnails in the colours of another theme."""
        self.recordings.retheme(theme)

    def chosen_paths(self) -> tuple[Path, ...]:
        """Return the files of the selected rows, from top to bottom."""
        rows = sorted(self.selectionModel().selectedRows(NAME), key=lambda index: index.row())
        return tuple(index.data(PATH_ROLE) for index in rows)

    def choose(self, *paths: Path) -> None:
        """Select the rows of these files only; if none of these files is listed, keep the selection."""
        indices = [self.shown_rows.index(row, NAME) for row in range(self.shown_rows.rowCount())]
        wanted = [index for index in indices if index.data(PATH_ROLE) in paths]
        if not wanted:
            return
        # Do not use selectRow, which would extend the selection while Ctrl is pressed.
        self.selectionModel().setCurrentIndex(wanted[0], _THIS_ROW_ALONE)
        for index in wanted[1:]:
            self.selectionModel().select(index, _THIS_ROW_TOO)
        self.scrollTo(wanted[0])


def _cells(entry: ListedRecording) -> tuple[Cell, ...]:
    facts = entry.catalogue_entry
    level = "" if facts.amplitude_vpp is None else f"{facts.amplitude_vpp:g} Vpp"
    length = "" if facts.duration_s is None else duration_text(facts.duration_s)
    return (
        ("", entry.name),
        (printable(entry.name), entry.name),
        (f"{_symbol(facts.state)} {facts.state}", facts.state),
        (printable(facts.verdict), facts.verdict),
        (moment_text(facts.started_utc), facts.started_utc),
        (printable(entry.excitation_text), entry.excitation_text),
        (level, facts.amplitude_vpp or 0.0),
        (length, facts.duration_s or 0.0),
        (size_text(facts.size_bytes), float(facts.size_bytes)),
    )


def _paint_thumbnail(found: Thumbnail, theme: Theme) -> QPixmap:
    """Return a thumbnail: in each column a line from the lowest to the highest value."""
    ratio = QGuiApplication.primaryScreen().devicePixelRatio()
    picture = QPixmap(THUMBNAIL_SIZE * ratio)
    picture.setDevicePixelRatio(ratio)
    picture.fill(QColor(theme.base))
    painter = QPainter(picture)
    painter.setPen(QPen(QColor(theme.traces[0]), 1))
    middle, reach = 0.5 * THUMBNAIL_SIZE.height(), 0.5 * THUMBNAIL_SIZE.height() - 1
    for column, (low, high) in enumerate(zip(found.low, found.high, strict=True)):
        if np.isfinite(low) and np.isfinite(high):
            top, bottom = middle - reach * float(high), middle - reach * float(low)
            painter.drawLine(QPointF(column, top), QPointF(column, max(bottom, top + 1)))
    painter.end()
    return picture
