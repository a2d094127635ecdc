"""What a folder holds, as its catalogue says; called in another process, for many files take seconds."""

from dataclasses import dataclass
from pathlib import Path

from acquisition.campaign.catalogue import catalogue
from acquisition.campaign.catalogue_entry import UNREADABLE, CatalogueEntry
from acquisition.recording import open_recording
from analysis.overview import Level, overview_levels
from analysis.thumbnail import Thumbnail, thumbnail

Levels = dict[str, tuple[Level, ...]]


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


def listed_recordings(folder: Path) -> tuple[ListedRecording, ...]:
    """List a folder; one that is not there yet is empty."""
    if not folder.is_dir():
        return ()
    return tuple(ListedRecording(folder / each.path, each) for each in catalogue(folder))


def thumbnails(paths: tuple[Path, ...]) -> dict[Path, Thumbnail | None]:
    """Draw recordings small."""
    return {path: thumbnail(path) for path in paths}


def made_levels(path: Path) -> Levels:
    """Take the overview of a recording, or read all samples for it."""
    with open_recording(path) as recording:
        return overview_levels(recording)
