"""What the banner and the status line show of what the engine says."""

from dataclasses import replace
from pathlib import Path

from vibench.acquisition.engine import EngineState, EngineStatus, RunStatus

from ..widgets.clock import clock
from ..widgets.theme import Tone
from .banner import CLOSED, StateIndicator
from .status_line import StatusField

OPENING = StateIndicator("◌", "OPENING", Tone.CALM, "Looking for the instruments")
_INDICATORS = {
    EngineState.CLOSED: CLOSED,
    EngineState.OPENING: OPENING,
    EngineState.READY: StateIndicator("●", "READY", Tone.GOOD),
    EngineState.ARMED: StateIndicator("▲", "ARMED", Tone.CAUTION),
    EngineState.RUNNING: StateIndicator("▶", "RUNNING", Tone.ACTIVE),
    EngineState.HELD: StateIndicator("❚❚", "HELD", Tone.CAUTION),
    EngineState.RAMPING_DOWN: StateIndicator("▼", "RAMPING DOWN", Tone.CAUTION, is_ramping=True),
    EngineState.CHECKING: StateIndicator("◍", "CHECKING", Tone.ACTIVE, "A small sine plays for some seconds"),
    EngineState.FAULT: StateIndicator(
        "✖", "FAULT", Tone.DANGER, "Silent; open the bench again on the Rig page"
    ),
}
NEXT_STEPS = {
    EngineState.CLOSED: "Next: Alt+O on the Rig page opens the bench chosen there. F1 lists all keys.",
    EngineState.OPENING: "The bench is being opened.",
    EngineState.READY: "Next: Ctrl+Return arms the test of the Test page (Ctrl+2). F6 checks the bench.",
    EngineState.CHECKING: "The bench is being checked.",
    EngineState.ARMED: "Next: F5 starts what the Run page says. Cancel there disarms.",
    EngineState.RUNNING: "STOP ramps down as planned; Esc aborts, from anywhere.",
    EngineState.HELD: "The drive is on. Go on from the Run page; STOP ramps down, Esc aborts.",
    EngineState.RAMPING_DOWN: "Ramping down; Esc aborts.",
    EngineState.FAULT: "Details say what happened. Open the bench again on the Rig page (Ctrl+1).",
}
_BYTES_PER_SAMPLE = 4
_LITTLE_ROOM_S = 3600.0


ORDERED = "The last order is being carried out: limits, folder and instruments are looked at"


def indicator_of(status: EngineStatus | None, is_ordering: bool) -> StateIndicator:  # noqa: FBT001 - a fact
    """Give the state a symbol, a word and what changes in it."""
    if status is None:
        return OPENING if is_ordering else CLOSED
    if is_ordering and status.state in (EngineState.READY, EngineState.ARMED):
        return replace(_INDICATORS[status.state], symbol="◌", detail=ORDERED)
    return replace(_INDICATORS[status.state], detail=_detail(status))


def _detail(status: EngineStatus) -> str:
    """Say what changes while the state stays."""
    match status.state:
        case EngineState.READY if status.bench is not None:
            return (
                f"{status.bench.rig_name}, simulated" if status.bench.is_simulated else status.bench.rig_name
            )
        case EngineState.ARMED if status.armed is not None:
            return f"F5 starts the drive; disarms itself in {status.armed.expires_in_s:.0f} s"
        case EngineState.HELD:
            return f"The drive stays on   ·   {run_text(status.run)}"
        case EngineState.RUNNING | EngineState.RAMPING_DOWN:
            return run_text(status.run)
        case state:
            return _INDICATORS[state].detail


def run_text(run: RunStatus | None) -> str:
    """Say where a run stands."""
    if run is None:
        return "Beginning"
    parts = [f"{run.name} ({run.number} of {run.count})" if run.count > 1 else run.name]
    parts.append(run.run_state.value.replace("_", " "))
    parts.append(f"{clock(run.elapsed_s)} of {clock(run.total_s)}")
    parts.append(f"{run.amplitude_vpp:.3g} Vpp")
    if run.frequency_hz is not None:
        parts.append(f"{run.frequency_hz:.2f} Hz")
    return "   ·   ".join(parts)


def status_fields(
    status: EngineStatus | None, frames_per_s: float, longest_wait_s: float
) -> tuple[dict[StatusField, str], frozenset[StatusField]]:
    """Fill the status line, and say which fields ask for a look."""
    frames = f"{frames_per_s:.0f} fps, latency {1e3 * longest_wait_s:.0f} ms"
    if status is None or status.bench is None:
        return {StatusField.RIG: "no bench", StatusField.FRAMES: frames}, frozenset()
    bench = status.bench
    marked = set()
    if status.lost_blocks:
        marked.add(StatusField.OVERRUNS)
    if status.overloads:
        marked.add(StatusField.CLIPPED)
    room_s = status.disk_free_bytes / (bench.sample_rate_hz * len(bench.channels) * _BYTES_PER_SAMPLE)
    disk = ""
    if status.disk_free_bytes:
        disk = f"disk {status.disk_free_bytes / 1e9:.0f} GB = {room_s / 3600:.0f} h"
        if room_s < _LITTLE_ROOM_S:
            marked.add(StatusField.DISK)
    texts = {
        StatusField.RIG: f"{bench.rig_name}, {bench.sample_rate_hz / 1e3:g} kS/s × {len(bench.channels)}",
        StatusField.OVERRUNS: f"overruns {status.lost_blocks}",
        StatusField.CLIPPED: f"clipped {status.overloads}",
        StatusField.DISK: disk,
        StatusField.FILE: "" if status.run is None else f"file {Path(status.run.file).name}",
        StatusField.FRAMES: frames,
    }
    return texts, frozenset(marked)
