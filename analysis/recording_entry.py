"""One line of a list of recordings: what a file is, without reading its samples."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from acquisition.errors import RecordingError
from acquisition.recording import Origin, Recording, RecordingState, open_recording

from .overview import has_overview, overview_of
from .recorded_channels import RESPONSE

THUMBNAIL_COLUMNS = 120
READ_WHOLE_SAMPLES = 50_000_000
"""Values that are read for the thumbnail of a file without an overview: about a second."""
_SUFFIXES = (".h5", ".h5.part")


@dataclass(frozen=True)
class RecordingEntry:
    """What is said of a recording before it is opened."""

    path: Path
    bytes: int
    name: str
    problem: str = ""
    """Why it cannot be read; empty when it can."""
    state: RecordingState | None = None
    reason: str = ""
    origin: Origin | None = None
    started_utc: str = ""
    duration_s: float = 0.0
    kind: str = ""
    """``"sine_sweep"``, ``"dwell"`` ..."""
    what: str = ""
    """``"150 to 350 Hz"``."""
    amplitude_vpp: float | None = None


@dataclass(frozen=True, eq=False)
class Thumbnail:
    """The response of a whole recording, in few columns; each between -1 and 1."""

    low: NDArray[np.float32]
    high: NDArray[np.float32]


def recording_paths(folder: Path) -> tuple[Path, ...]:
    """List the recordings of a folder and of the folders in it, finished or not, the newest first."""
    found = [each for suffix in _SUFFIXES for each in folder.rglob(f"*{suffix}") if each.is_file()]
    return tuple(sorted(found, key=lambda each: (-each.stat().st_mtime, each.name)))


def recording_entry(path: Path) -> RecordingEntry:
    """Look at one file; one that cannot be read says why."""
    size = path.stat().st_size if path.exists() else 0
    name = path.name.removesuffix(".part").removesuffix(".h5")
    try:
        with open_recording(path) as recording:
            return _entry(recording, size, name)
    except RecordingError as error:
        return RecordingEntry(path, size, name, problem=str(error))


def recording_entries(folder: Path) -> tuple[RecordingEntry, ...]:
    """Look at every recording of a folder, as `recording_paths` lists them."""
    return tuple(recording_entry(path) for path in recording_paths(folder))


def thumbnail(path: Path) -> Thumbnail | None:
    """Draw a recording small; None where there is nothing to draw, or it would take too long."""
    try:
        with open_recording(path) as recording:
            if recording.samples == 0 or not _is_quickly_seen(recording):
                return None
            role = RESPONSE if RESPONSE in recording.roles else recording.roles[-1]
            picture = overview_of(recording).picture((role,), 0, recording.samples, THUMBNAIL_COLUMNS)
    except RecordingError:
        return None
    known = np.isfinite(picture.low[0]) & np.isfinite(picture.high[0])
    if not known.any():
        return None
    low, high = (np.asarray(each[0], dtype=np.float32) for each in (picture.low, picture.high))
    largest = max(float(np.max(np.abs(low[known]))), float(np.max(np.abs(high[known]))))
    return Thumbnail(low / largest, high / largest) if largest > 0 else None


def _is_quickly_seen(recording: Recording) -> bool:
    return has_overview(recording) or recording.samples * len(recording.roles) <= READ_WHOLE_SAMPLES


def _entry(recording: Recording, size: int, name: str) -> RecordingEntry:
    excitation = recording.plan.get("excitation", {})
    amplitude = excitation.get("amplitude_vpp")
    return RecordingEntry(
        path=recording.path,
        bytes=size,
        name=name,
        state=recording.state,
        reason=recording.reason,
        origin=recording.origin,
        started_utc=recording.started_utc,
        duration_s=recording.duration_s,
        kind=str(excitation.get("kind", "")),
        what=_what(excitation),
        amplitude_vpp=float(amplitude) if isinstance(amplitude, int | float) else None,
    )


def _what(excitation: Mapping[str, Any]) -> str:
    """Say which frequencies were played."""
    match excitation:
        case {"frequency_hz": frequency}:
            return f"{frequency:g} Hz"
        case {"start_hz": low, "stop_hz": high} | {"band_start_hz": low, "band_stop_hz": high}:
            return f"{low:g} to {high:g} Hz"
        case {"frequencies_hz": [first, *_, last]}:
            return f"{first:g} to {last:g} Hz"
        case _:
            return ""
