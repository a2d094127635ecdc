"""What a catalogue says of one recording, read from the file itself."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import RecordingError
from ..recording import PART_SUFFIX, Recording, RecordingState, open_recording

UNREADABLE = "unreadable"
"""State of a file that is no recording, or damaged; its reason says what is wrong."""
GOOD = "good"
_FREQUENCIES = ("frequency_hz", "start_hz", "stop_hz", "low_hz", "high_hz", "band_start_hz", "band_stop_hz")


@dataclass(frozen=True)
class CatalogueEntry:
    """One recording of a folder. What it does not have is empty, or None."""

    path: str
    """Below the folder, with ``/``."""
    name: str
    """Of the measurement."""
    state: str
    """As in `recording.layout.RecordingState`, or ``unreadable``."""
    reason: str
    verdict: str
    """``good``, or what is to be minded: ended early, near full scale, samples lost."""
    started_utc: str
    origin: str
    kind: str
    """Of the excitation."""
    amplitude_vpp: float | None
    frequency_low_hz: float | None
    frequency_high_hz: float | None
    duration_s: float | None
    size_bytes: int
    bench_check: str
    """What the bench check before it found."""
    results: str
    """Names of what analyses have saved, separated by commas."""
    operator: str
    notes: str
    recording_id: str

    @property
    def is_finished(self) -> bool:
        """Whether the recording has its final name."""
        return not self.path.endswith(PART_SUFFIX)


def read_entry(folder: Path, path: Path, size_bytes: int) -> CatalogueEntry:
    """Read what a catalogue wants to know; a file that cannot be read becomes an entry that says why."""
    where = path.relative_to(folder).as_posix()
    try:
        with open_recording(path) as recording:
            return _entry(recording, where, size_bytes)
    except RecordingError as error:
        return _unreadable(where, str(error), size_bytes)


def _entry(recording: Recording, where: str, size_bytes: int) -> CatalogueEntry:
    excitation = recording.plan.get("excitation", {})
    low_hz, high_hz = _band(excitation)
    return CatalogueEntry(
        path=where,
        name=str(recording.plan.get("name", Path(where).name.split(".")[0])),
        state=recording.state.value,
        reason=recording.reason,
        verdict=_verdict(recording),
        started_utc=recording.started_utc,
        origin=recording.origin.value,
        kind=str(excitation.get("kind", "")),
        amplitude_vpp=excitation.get("amplitude_vpp"),
        frequency_low_hz=low_hz,
        frequency_high_hz=high_hz,
        duration_s=recording.duration_s,
        size_bytes=size_bytes,
        bench_check=recording.check_text,
        results=", ".join(recording.result_names),
        operator=str(recording.confirmations.get("operator", "")),
        notes=str(recording.plan.get("notes", "")),
        recording_id=recording.recording_id,
    )


def _unreadable(where: str, reason: str, size_bytes: int) -> CatalogueEntry:
    return CatalogueEntry(
        path=where,
        name=Path(where).name.split(".")[0],
        state=UNREADABLE,
        reason=reason,
        verdict="cannot be read",
        started_utc="",
        origin="",
        kind="",
        amplitude_vpp=None,
        frequency_low_hz=None,
        frequency_high_hz=None,
        duration_s=None,
        size_bytes=size_bytes,
        bench_check="",
        results="",
        operator="",
        notes="",
        recording_id="",
    )


def _band(excitation: dict[str, Any]) -> tuple[float | None, float | None]:
    """Lowest and highest frequency of an excitation, as its plan names them."""
    grid = excitation.get("grid") or {}
    named = [table.get(key) for table in (excitation, grid) for key in _FREQUENCIES]
    found = [
        each for each in (*named, *excitation.get("frequencies_hz", ())) if isinstance(each, int | float)
    ]
    return (min(found), max(found)) if found else (None, None)


def _verdict(recording: Recording) -> str:
    minded = [] if recording.state is RecordingState.COMPLETE else [recording.state.value]
    roles = ", ".join(dict.fromkeys(each.channel for each in recording.overloads))
    if roles:
        minded.append(f"near full scale: {roles}")
    lost = sum(each.last_sample - each.first_sample + 1 for each in recording.gaps)
    if lost:
        minded.append(f"{lost} samples lost")
    return "; ".join(minded) or GOOD
