"""What a folder holds, as its catalogue says; called in another process, for many files take seconds."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from vibench.acquisition import RecordingError, open_recording
from vibench.acquisition.campaign import (
    UNREADABLE,
    CatalogueEntry,
    JournalPointState,
    list_recordings,
    read_journal,
)
from vibench.acquisition.recording import JOURNAL_SUFFIX, Recording
from vibench.analysis.live import OverviewLevel, Thumbnail, overview_levels, thumbnail

Levels = dict[str, tuple[OverviewLevel, ...]]

NOTE = "note"
"""Name of a result that holds a note; further ones have numbers."""


@dataclass(frozen=True)
class ListedRecording:
    """A row of the list."""

    path: Path
    said: CatalogueEntry

    @property
    def name(self) -> str:
        """Of the file below the folder, without its endings: attempts of one measurement differ in it."""
        return self.said.path.removesuffix(".part").removesuffix(".h5")

    @property
    def is_readable(self) -> bool:
        """Whether it can be opened."""
        return self.said.state != UNREADABLE

    @property
    def played(self) -> str:
        """``"sine sweep 150 to 350 Hz"``."""
        low, high = self.said.frequency_low_hz, self.said.frequency_high_hz
        band = "" if low is None else f"{low:g} Hz" if high in (None, low) else f"{low:g} to {high:g} Hz"
        return f"{self.said.kind.replace('_', ' ')} {band}".strip()


@dataclass(frozen=True)
class ListedCampaign:
    """A campaign as its journal knows it at the moment."""

    name: str
    states: tuple[JournalPointState, ...]
    """One a point."""
    files: frozenset[Path]
    """Recordings of the last attempts."""

    @property
    def text(self) -> str:
        """``"✔ night: 40 of 40 done"``, ``"▲ night: 3 of 40 done, 2 failed, 35 queued"``."""
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
    """What is in a folder."""

    recordings: tuple[ListedRecording, ...] = ()
    campaigns: tuple[ListedCampaign, ...] = ()


def listed(folder: Path) -> Listing:
    """List a folder; one that is not there yet is empty."""
    if not folder.is_dir():
        return Listing()
    recordings = tuple(ListedRecording(folder / each.path, each) for each in list_recordings(folder))
    return Listing(recordings, tuple(_campaigns(folder)))


def _campaigns(folder: Path) -> Iterator[ListedCampaign]:
    for path in sorted(folder.rglob(f"*{JOURNAL_SUFFIX}")):
        try:
            points = read_journal(path)
        except RecordingError:
            # Another program's file of that name is no campaign.
            continue
        files = frozenset(path.parent / each.file for each in points if each.file)
        name = path.name.removesuffix(JOURNAL_SUFFIX)
        yield ListedCampaign(name, tuple(each.state for each in points), files)


def exported(path: Path, target: Path) -> tuple[Path, ...]:
    """Write the samples of a recording as the ending of the target says; gives the files."""
    from vibench.analysis.exchange import Format, excerpt, export_samples  # noqa: PLC0415 - slow to load

    with open_recording(path) as recording:
        return export_samples(excerpt(recording), Format(target.suffix[1:].lower()), target)


def noted(path: Path, text: str) -> Path:
    """Keep a note in a recording, beside those that it has."""
    with open_recording(path) as recording:
        recording.save_results(NOTE, {}, {"text": text}, roles=())
    return path


def notes_of(recording: Recording) -> tuple[str, ...]:
    """Return the notes of the plan and those that were added, the oldest first."""
    plan = str(recording.plan.get("notes", ""))
    has_more = any(name.startswith(NOTE) for name in recording.result_names)
    added = sorted(recording.results.values(), key=lambda each: each.saved_utc) if has_more else []
    more = [str(each.settings.get("text", "")) for each in added if each.name.startswith(NOTE)]
    return tuple(filter(None, (plan, *more)))


def thumbnails(paths: tuple[Path, ...]) -> dict[Path, Thumbnail | None]:
    """Draw recordings small."""
    return {path: thumbnail(path) for path in paths}


def made_levels(path: Path) -> Levels:
    """Take the overview of a recording, or read all samples for it."""
    with open_recording(path) as recording:
        return overview_levels(recording)
