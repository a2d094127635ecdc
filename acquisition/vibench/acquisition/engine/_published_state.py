"""State of an engine for its viewers. The engine's thread writes it; all others read it without waiting."""

import shutil
import threading
from collections import deque
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic

import numpy as np
from numpy.typing import NDArray

from ..bench import BenchReport
from ..campaign import CampaignProgress, PointOutcome, PointResult
from ..errors import AcquisitionError
from ..host.beside import Beside
from ..instruments import Block
from ..plan import Campaign, RunState, measuring_s
from ._status import (
    ArmedPlan,
    BenchFacts,
    ChannelLevel,
    EngineMessage,
    EngineState,
    EngineStatus,
    MessageKind,
    RowStatus,
    RunStatus,
    Supervision,
    TwinStatus,
)

HELD_S = 10.0
"""Duration of the samples that are kept for viewers, counted back from the newest [s]."""


@dataclass(frozen=True, eq=False)
class SampleSlice:
    """Consecutive samples for a viewer."""

    run_id: int
    first_sample: int
    sample_rate_hz: float
    volts: NDArray[np.float32]
    """Voltages at the converter's input, shape (channels, samples) [V]."""


class SampleBuffer:
    """Buffer of the newest samples, with bounded memory: written by the run, read by any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._blocks: deque[tuple[int, NDArray[np.float32]]] = deque()
        self.run_id = 0
        """Number of the run to which the samples belong."""
        self._channels = 0
        self._rate_hz = 1.0
        self.samples = 0
        """Number of samples per channel in the run so far."""
        self.gaps = 0
        """Number of places in the run at which samples are missing."""

    def begin(self, channels: int, sample_rate_hz: float) -> None:
        """Start a new run, and discard the samples of the last run."""
        with self._lock:
            self._blocks.clear()
            self.run_id += 1
            self._channels, self._rate_hz = channels, sample_rate_hz
            self.samples = self.gaps = 0

    def add(self, block: Block) -> None:
        """Add a block of samples, and discard samples older than `HELD_S`."""
        volts = block.volts.astype(np.float32)
        with self._lock:
            if block.first_sample != self.samples:
                self.gaps += 1
                self._blocks.clear()
            self._blocks.append((block.first_sample, volts))
            self.samples = block.first_sample + volts.shape[1]
            oldest = self.samples - round(HELD_S * self._rate_hz)
            while self._blocks and self._blocks[0][0] + self._blocks[0][1].shape[1] <= oldest:
                self._blocks.popleft()

    def samples_since(self, sample: int, most: int) -> SampleSlice:
        """Return the samples from number ``sample`` on, but at most the newest ``most`` samples."""
        with self._lock:
            blocks = tuple(self._blocks)
            end, run_id, rate_hz, channels = self.samples, self.run_id, self._rate_hz, self._channels
        first = max(sample, end - most, blocks[0][0] if blocks else end)
        parts = [
            volts[:, max(0, first - begin) :] for begin, volts in blocks if begin + volts.shape[1] > first
        ]
        volts = np.concatenate(parts, axis=1) if parts else np.empty((channels, 0), np.float32)
        return SampleSlice(run_id, min(first, end), rate_hz, volts)


KEPT = 100


class Messages:
    """The newest messages of an engine."""

    def __init__(self) -> None:
        self._kept: deque[EngineMessage] = deque(maxlen=KEPT)
        self._count = 0

    @property
    def newest(self) -> tuple[EngineMessage, ...]:
        """Return the newest messages of the engine, from oldest to newest."""
        return tuple(self._kept)

    def info(self, what: str) -> None:
        """Add a message that requires no action by the operator."""
        self._add(MessageKind.INFO, what, "", "", "")

    def warn(self, what: str, done: str = "", next_step: str = "") -> None:
        """Add a warning to the messages."""
        self._add(MessageKind.WARNING, what, done, next_step, "")

    def alarm(self, what: str, done: str, next_step: str) -> None:
        """Report that the engine stopped the drive without a request by the operator."""
        self._add(MessageKind.FAULT, what, done, next_step, "")

    def fault(self, error: BaseException) -> None:
        """Add an error, split into what happened, what was done, and what to do next."""
        match error:
            case AcquisitionError():
                what, done, next_step = message_parts(str(error))
            case _:
                what = f"{type(error).__name__}: {error}"
                done, next_step = "The drive was silenced.", "This is a fault of the program: report it."
        self._add(MessageKind.FAULT, what, done, next_step, type(error).__name__)

    def _add(self, kind: MessageKind, what: str, done: str, next_step: str, code: str) -> None:
        self._count += 1
        utc = datetime.now(UTC).isoformat(timespec="seconds")
        self._kept.append(
            EngineMessage(
                number=self._count, utc=utc, kind=kind, what=what, done=done, next_step=next_step, code=code
            )
        )


def message_parts(text: str) -> tuple[str, str, str]:
    """Split "What happened. What was done; what to do next" into three parts; missing parts are empty."""
    what, _, rest = text.partition(". ")
    done, _, next_step = rest.partition("; ")
    return (f"{what.rstrip('.')}.", _sentence(done), _sentence(next_step))


def _sentence(clause: str) -> str:
    clause = clause.strip().rstrip(".")
    return f"{clause[0].upper()}{clause[1:]}." if clause else ""


DISK_INTERVAL_S = 2.0
"""Interval between two readings of the free disk space [s]."""
_STATES = {RunState.HELD: EngineState.HELD, RunState.RAMPING_DOWN: EngineState.RAMPING_DOWN}


class PublishedState:
    """Newest status of an engine. It is always replaced as a whole, so that no reader sees half a change."""

    def __init__(self, supervision: Supervision) -> None:
        self.sample_buffer = SampleBuffer()
        self.messages = Messages()
        self._lock = threading.Lock()
        self._status = EngineStatus(state=EngineState.CLOSED, attendance=supervision)
        self._armed_until_s = 0.0
        self._folder = Path()
        self._disk_due_s = 0.0
        self._beside = Beside("disk room")
        self._file = Path()
        self._done_s = 0.0
        self._campaign_s = 0.0
        self._planned_s: dict[str, float] = {}
        self._plans: dict[str, str] = {}
        self._overloads = 0

    @property
    def state(self) -> EngineState:
        """State of the engine."""
        return self._status.state

    def status(self) -> EngineStatus:
        """Return the newest status, without samples."""
        status = self._status
        armed = status.armed
        if armed is not None:
            left_s = max(0.0, self._armed_until_s - monotonic())
            armed = armed.model_copy(update={"expires_in_s": left_s})
        return status.model_copy(
            update={
                "armed": armed,
                "messages": self.messages.newest,
                "samples": self.sample_buffer.samples,
                "run_id": self.sample_buffer.run_id,
                "lost_blocks": self.sample_buffer.gaps,
            }
        )

    def enter(self, state: EngineState) -> None:
        """Change the state; clear run and plan if the new state has neither a run nor an armed plan."""
        keeps_plan = state is EngineState.ARMED or state in _STATES.values() or state is EngineState.RUNNING
        forgotten = {} if keeps_plan else {"armed": None, "run": None, "levels": ()}
        self._put(state=state, **forgotten)

    def bench(self, bench: BenchFacts | None) -> None:
        """Set the open bench; clear the report of the bench check and the list of recordings."""
        self._put(bench=bench, check=None, checked_utc="")
        self._put_rows(())

    def note_check(self, report: BenchReport, utc: str) -> None:
        """Set the report of the bench check."""
        self._put(check=report, checked_utc=utc)

    def arm(self, plan: ArmedPlan, campaign: Campaign) -> None:
        """Set the armed plan, which is the next to start."""
        self._armed_until_s = monotonic() + plan.expires_in_s
        self._put_rows(_queue_rows(campaign))
        self._put(state=EngineState.ARMED, armed=plan)

    def begin(self, campaign: Campaign, folder: Path) -> None:
        """Set the campaign that is running."""
        self._folder = folder
        self._campaign_s, self._done_s, self._file = campaign.duration_s, 0.0, Path()
        self._planned_s = {name: measuring_s(each) + campaign.rest_s for name, each in campaign.recordings()}
        self._plans = {
            name: f"{each.excitation.kind}, {each.excitation.highest_amplitude_vpp:g} Vpp"
            for name, each in campaign.recordings()
        }
        self._put_rows(_queue_rows(campaign))
        self._put(state=EngineState.RUNNING, armed=None, run=None)

    def note_progress(self, progress: CampaignProgress, bench: BenchFacts) -> None:
        """Update the status after a block of samples."""
        run = progress.run
        if progress.path != self._file:  # a new point or attempt has a new recording
            self._file = progress.path
            self._overloads = 0
            self.sample_buffer.begin(len(bench.channels), bench.sample_rate_hz)
            self._put(bench=bench)  # in a scan, the role of the vibrometer's channel changes
            self._row(progress.name, "running", "", str(progress.path))
        self.sample_buffer.add(run.block)
        self._overloads += len(run.block.overloads)
        peaks = np.max(np.abs(run.block.volts), axis=1)
        rms = np.sqrt(np.mean(run.block.volts**2, axis=1))
        self._put(
            state=_STATES.get(run.state, EngineState.RUNNING),
            run=self._run_status(progress),
            levels=tuple(
                ChannelLevel(
                    role=channel.role,
                    peak_share=peak / channel.full_scale_v,
                    rms_share=value / channel.full_scale_v,
                )
                for channel, peak, value in zip(bench.channels, peaks.tolist(), rms.tolist(), strict=True)
            ),
            overloads=self._overloads,
        )
        # Read the free disk space in another thread: an unresponsive folder must not delay a stop.
        if monotonic() < self._disk_due_s or self._beside.is_busy:
            return
        self._disk_due_s = monotonic() + DISK_INTERVAL_S
        folder = self._folder
        self._beside.do(lambda: self._put(disk_free_bytes=_free_bytes(folder)))

    def twin(self, status: TwinStatus | None) -> None:
        """Set the live twin's report; None if there is no twin."""
        buffer = self.sample_buffer
        if status is not None and status.run_id == buffer.run_id and self._status.bench is not None:
            late = max(0, buffer.samples - status.end_sample)
            status = status.model_copy(update={"behind_s": late / self._status.bench.sample_rate_hz})
        self._put(twin=status)

    def note_pause(self, rest_s: float, text: str) -> None:
        """Add the pause between two recordings [s] to the completed time, and publish ``text``."""
        self._done_s += rest_s
        self.messages.info(text)

    def note_result(self, point_result: PointResult) -> None:
        """Publish the result of a recording, and add its duration to the completed time."""
        if point_result.outcome is PointOutcome.KEPT:
            self._done_s += self._planned_s.get(point_result.name, 0.0)
        elif self._status.run is not None and point_result.name == self._status.run.name:
            self._done_s += self._status.run.total_s
        self._row(point_result.name, point_result.outcome.value, point_result.reason, str(point_result.path))

    def note_failure(self, reason: str) -> None:
        """Set the state of the running recording to failed."""
        for row in self._status.rows:
            if row.state == "running":
                self._row(row.name, "failed", reason, row.file)

    def _row(self, name: str, state: str, reason: str, file: str) -> None:
        status = RowStatus(name=name, state=state, reason=reason, file=file)
        self._put_rows(tuple(status if row.name == name else row for row in self._status.rows))

    def _run_status(self, progress: CampaignProgress) -> RunStatus:
        run = progress.run
        return RunStatus(
            name=progress.name,
            number=progress.number,
            count=progress.count,
            file=str(progress.path),
            run_state=run.state,
            segment="" if run.segment is None else run.segment.label,
            numbers={} if run.segment is None else run.segment.numbers,
            elapsed_s=run.elapsed_s,
            total_s=run.total_s,
            campaign_elapsed_s=self._done_s + run.elapsed_s,
            campaign_total_s=max(self._campaign_s, self._done_s + run.total_s),
            amplitude_vpp=run.amplitude_vpp,
            frequency_hz=run.frequency_hz,
            plan=self._plans.get(progress.name, ""),
            until=run.until,
        )

    def _put_rows(self, rows: tuple[RowStatus, ...]) -> None:
        self._put(rows=rows, rows_number=self._status.rows_number + 1)

    def _put(self, **changes: object) -> None:
        with self._lock:
            self._status = self._status.model_copy(update=changes)


def _free_bytes(folder: Path) -> int:
    try:
        return shutil.disk_usage(folder).free
    except OSError:  # only a display, which must not end a run; the recorder reports the missing folder
        return 0


def _queue_rows(campaign: Campaign) -> tuple[RowStatus, ...]:
    names = campaign.recording_names()
    return tuple(RowStatus(name=name, state="queued", reason="", file="") for name in names)
