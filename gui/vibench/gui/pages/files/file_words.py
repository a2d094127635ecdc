"""How sizes, times and states of recordings are written in a list."""

from vibench.acquisition import printable
from vibench.acquisition.recording import Recording, RecordingState, SealDepth, SealState

from ...widgets.outcome_text import outcome_text
from .listing import notes_of

_STATE_SYMBOLS: dict[str, str] = {
    RecordingState.COMPLETE: "✔",
    RecordingState.STOPPED: "■",
    RecordingState.FAILED: "✖",
    RecordingState.INTERRUPTED: "▲",
    RecordingState.RECORDING: "●",
}


def state_text(state: str) -> str:
    """Symbol and word: never a colour alone."""
    return f"{_symbol(state)} {state}"


def _symbol(state: str) -> str:
    return _STATE_SYMBOLS.get(state, "✖")


def size_text(size: int) -> str:
    """``"344 MB"``."""
    step = 1000.0
    shown, units = float(size), ["B", "kB", "MB", "GB", "TB"]
    while shown >= step and len(units) > 1:
        shown, units = shown / step, units[1:]
    return f"{shown:.3g} {units[0]}" if shown < step else f"{shown:.0f} {units[0]}"


def duration_text(duration_s: float) -> str:
    """``"4.25 s"``, ``"3:20"``, ``"1:02:03"``."""
    minute = 60
    if duration_s < minute:
        return f"{duration_s:.3g} s"
    whole = round(duration_s)
    hours, minutes, seconds = whole // 3600, whole // minute % minute, whole % minute
    return f"{hours}:{minutes:02d}:{seconds:02d}" if hours else f"{minutes}:{seconds:02d}"


def role_text(role: str) -> str:
    """``"m0 velocity"``."""
    return printable(role.replace("_", " "))


def facts_text(recording: Recording) -> str:
    """Say in a line what a recording is."""
    parts = [
        f"{_symbol(recording.state)} {outcome_text(recording.state, recording.reason)}",
        recording.origin.value,
        duration_text(recording.duration_s),
        f"{recording.sample_rate_hz:g} samples/s, {len(recording.roles)} channels",
        f"bench {recording.bench.get('name', 'unnamed')}",
    ]
    seal = recording.check_seal(SealDepth.QUICK)
    if seal.state not in (SealState.INTACT, SealState.UNFINISHED):
        parts.insert(0, f"✖ {seal.state.value.replace('_', ' ')}: {seal.sentence}")
    if recording.overloads:
        parts.append(f"{len(recording.overloads)} overloads (red)")
    if recording.gaps:
        lost = sum(each.last_sample - each.first_sample + 1 for each in recording.gaps)
        parts.append(f"{lost} samples lost")
    parts += [f"note: {each}" for each in notes_of(recording)]
    return "  ·  ".join(parts)
