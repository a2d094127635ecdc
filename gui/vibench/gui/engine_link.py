"""The connection between the window and the engine's process.

`Bridge` requests status and samples at every tick, keeps the newest and sends commands. A thread without
Qt waits for the answers, so that the window does not block. An `Attendant` reports that the window is alive;
without these reports the engine ramps down (docs/engine.md). A `LiveView` holds the newest samples of a run.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum
from itertools import count
from pathlib import Path
from queue import Empty, PriorityQueue, SimpleQueue
from typing import Any, Concatenate, ParamSpec

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from vibench.acquisition import AcquisitionError, StopLevel
from vibench.acquisition.engine import (
    DRIVING,
    AdoptedEngine,
    Announcement,
    ArmedPlan,
    Attendant,
    BenchFacts,
    CampaignRequest,
    EngineClient,
    EngineGone,
    EngineProcess,
    EngineSilent,
    EngineState,
    EngineStatus,
    SampleSlice,
    Supervision,
    start_engine,
)
from vibench.acquisition.plan import Campaign, Measurement, lead_in_s
from vibench.acquisition.rig import KnobSheet, Rig
from vibench.analysis.live import LiveChannel, LiveView
from vibench.sim.background import ignore
from vibench.stop_files import SWITCH_OFF

from .background import in_next_pass
from .widgets.notice import Notice, NoticeKind, notice_of

WHOLE_BAND_HZ = (20.0, 2000.0)
"""Frequency band of the plots if this window does not know the plan, because another window armed it."""
WARM_RATE_HZ, WARM_S, WARM_HZ = 51200.0, 3.0, 200.0


def live_view(bench: BenchFacts, rig: Rig | None, campaign: Campaign | None, name: str) -> LiveView:
    """Return an empty live view for the run of the recording ``name``."""
    measurement = find_measurement(campaign, name)
    band_hz = WHOLE_BAND_HZ if measurement is None else measurement.excitation.band_hz
    channels = [
        LiveChannel(each.role, each.unit, each.units_per_volt, each.full_scale_v) for each in bench.channels
    ]
    sensor = None if rig is None or rig.response is None else rig.sensor(rig.response)
    delay_s = 0.0 if sensor is None else sensor.delay_s
    begins_s = 0.0 if measurement is None else lead_in_s(measurement)
    return LiveView(channels, bench.sample_rate_hz, band_hz=band_hz, delay_s=delay_s, lead_in_s=begins_s)


def warm_up() -> None:
    """Process a test signal of 3 s in advance, so that the first plot of a run need not load libraries."""
    roles = ("drive_voltage", "base_acceleration", "m0_velocity")
    channels = [LiveChannel(role, "V", 1.0, 1.0) for role in roles]
    view = LiveView(channels, WARM_RATE_HZ, band_hz=WHOLE_BAND_HZ)
    time_s = np.arange(round(WARM_S * WARM_RATE_HZ)) / WARM_RATE_HZ
    sine = np.sin(2 * np.pi * WARM_HZ * time_s)
    view.add(0, np.tile(sine, (len(roles), 1)).astype(np.float32))
    view.time_histories(1.0, 100)
    view.spectrum()
    view.frequency_response()
    view.portrait()


def find_measurement(campaign: Campaign | None, name: str) -> Measurement | None:
    """Return the campaign's measurement that is recorded as ``name``; None if it does not exist."""
    if campaign is None:
        return None
    return next((each for recording, each in campaign.recordings() if recording == name), None)


Starter = Callable[[], EngineProcess | AdoptedEngine]
Question = Callable[[EngineClient], Any]
Listener = Callable[[Any], None]


class Urgency(IntEnum):
    """Priority of waiting requests to the engine; the request with the smallest number is sent first."""

    STOP = 0
    ORDER = 1
    LOOK = 2
    END = 3
    LEAVE = 4


@dataclass(order=True)
class _Call:
    urgency: Urgency
    number: int
    question: Question = field(compare=False)
    on_answer: Listener = field(compare=False)
    on_refusal: Callable[[AcquisitionError], None] = field(compare=False)


class EngineLine:
    """Thread without Qt that starts an engine and sends requests; `drain` delivers the answers.

    The thread sends only requests that the window has just made, so the engine notices if the window freezes.
    """

    def __init__(self, start: Starter = start_engine) -> None:
        self._start = start
        self._calls: PriorityQueue[_Call] = PriorityQueue()
        self._answers: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._numbers = count()
        self._engine: EngineProcess | AdoptedEngine | None = None
        self.attendant: Attendant | None = None
        """Process that reports to the engine that the window is alive; None before an engine exists."""
        self._thread = threading.Thread(target=self._run, name="engine line", daemon=True)
        self._thread.start()

    @property
    def pid(self) -> int | None:
        """Process id of the engine; None before an engine exists."""
        return None if self._engine is None else self._engine.pid

    def ask(
        self,
        urgency: Urgency,
        question: Question,
        on_answer: Listener,
        on_refusal: Callable[[AcquisitionError], None],
    ) -> None:
        """Queue a request by its priority; `drain` later calls the listener for its result or its error."""
        self._calls.put(_Call(urgency, next(self._numbers), question, on_answer, on_refusal))

    def drain(self) -> None:
        """Call, in the window's thread, the listeners of all replies received so far."""
        while True:
            try:
                tell = self._answers.get_nowait()
            except Empty:
                return
            tell()

    def leave(self, how: Urgency = Urgency.END) -> None:
        """End the engine after a ramp-down, or leave the engine running; return without waiting."""
        self._calls.put(_Call(how, next(self._numbers), ignore, ignore, ignore))

    def close(self, how: Urgency = Urgency.END) -> None:
        """End the engine after a ramp-down, or leave the engine running; wait until this is done."""
        self.leave(how)
        self._thread.join()

    def _run(self) -> None:
        while (call := self._calls.get()).urgency not in (Urgency.END, Urgency.LEAVE):
            self._answer(call)
        if self.attendant is not None:
            self.attendant.close()
        if self._engine is None:
            return
        if call.urgency is Urgency.LEAVE:
            self._engine.leave()
        else:
            self._engine.close()

    def _answer(self, call: _Call) -> None:
        try:
            if self._engine is None:
                self._engine = self._start()
                self.attendant = Attendant(self._engine.address)
            answer = call.question(self._engine.client)
        except AcquisitionError as error:
            refusal = error
            self._answers.put(lambda: call.on_refusal(refusal))
        else:
            self._answers.put(lambda: call.on_answer(answer))


CATCH_UP_S = 2.0
"""Longest stretch of samples fetched from the engine after a pause [s]; older samples are in the file."""

PIECE_S = 0.2
"""Duration of samples processed in one pass [s]: four times the duration that arrives between two frames."""

P = ParamSpec("P")
Snapshot = tuple[EngineStatus, SampleSlice | None]


class Bridge(QObject):
    """The only connection between the window and the engine.

    It stores only values that the engine reported last. The window's timer calls `tick`, which delivers
    answers and sends new requests. These requests show the engine that the window is alive.
    """

    noticed = Signal(object)
    armed = Signal(object)
    adopted = Signal(object)
    """Plan of a running engine that this window took over from another window."""
    advanced = Signal()
    """Emitted when a requested step is done: bench opened, plan armed, or run started."""
    recording_ended = Signal(object)
    """Path of a recording that has just ended."""

    def __init__(self, start: Starter = start_engine, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._start = start
        self._line: EngineLine | None = None
        self.status: EngineStatus | None = None
        """Newest status of the engine; None if there is no engine."""
        self.view: LiveView | None = None
        """Newest samples of the run; None before the first run, and after another plan was armed."""
        self._view_run = 0
        self.rig: Rig | None = None
        self.campaign: Campaign | None = None
        self._last_message = 0
        self._ended: frozenset[str] = frozenset()
        self._is_looking = False
        self._orders = 0
        self._attendance = Supervision.ATTENDED

    @property
    def state(self) -> EngineState:
        """State of the engine; `CLOSED` if there is no engine."""
        return EngineState.CLOSED if self.status is None else self.status.state

    @property
    def is_ordering(self) -> bool:
        """Whether a command is still running; checking a campaign against the limits may take seconds."""
        return self._orders > 0

    @property
    def is_driving(self) -> bool:
        """Whether the generator may be driving the shaker."""
        return self.state in DRIVING

    @property
    def engine_pid(self) -> int | None:
        """Process id of the engine; None if there is no engine."""
        return None if self._line is None else self._line.pid

    def tick(self) -> None:
        """Deliver the engine's replies, then request the next status and samples."""
        if self._line is None:
            return
        self.heartbeat()
        self._line.drain()
        if not self._is_looking and self._line is not None:
            self._is_looking = True
            self._line.ask(Urgency.LOOK, self._look_question(), self._take_snapshot, self._end_look)

    def heartbeat(self) -> None:
        """Report that the window's thread is alive; a separate process passes the report to the engine."""
        attendant = None if self._line is None else self._line.attendant
        if attendant is not None:
            attendant.live()

    def open(self, rig: Rig, confirmations: KnobSheet | None) -> None:
        """Open the bench of a rig; if there is no engine, start one first."""
        if self._line is None:
            self._line = EngineLine(self._start)
        self.rig = rig
        self._order(lambda client: _open(client, rig, confirmations))

    def adopt(self, announcement: Announcement | None) -> None:
        """Take over an engine and its campaign that another window left running; then emit `adopted`."""
        if announcement is None or self._line is not None:
            return
        self._line = EngineLine(lambda: AdoptedEngine(announcement))

        def keep(found: tuple[Rig, CampaignRequest, EngineStatus]) -> None:
            self.rig, request, self.status = found
            self.campaign, self._attendance = request.campaign, Supervision.UNATTENDED
            self._emit_news(self.status)  # show messages before the next tick
            self.adopted.emit(request)

        self._order(_adopt, keep)

    def order(
        self, verb: Callable[Concatenate[EngineClient, P], object], *args: P.args, **kwargs: P.kwargs
    ) -> None:
        """Call a method of the engine's client, such as ``EngineClient.start``, in the engine thread."""
        self._order(lambda client: verb(client, *args, **kwargs))

    def arm(self, request: CampaignRequest) -> None:
        """Arm a campaign; when the engine answers, emit `armed` or a notice."""

        def keep(plan: ArmedPlan) -> None:
            self.campaign, self._attendance = request.campaign, plan.attendance
            self.view = None
            self.armed.emit(plan)

        self._order(lambda client: client.arm_request(request), keep)

    def stop(self, level: StopLevel, reason: str) -> None:
        """Hold or end the run; the engine receives this request before all waiting requests."""
        if self._line is not None:
            self._line.ask(Urgency.STOP, lambda client: client.stop(level, reason), ignore, self._report)

    @property
    def may_leave(self) -> bool:
        """Whether the plan was armed for a run that continues after the window is closed."""
        return self.is_driving and self._attendance is Supervision.UNATTENDED

    def close(self, how: Urgency = Urgency.END) -> None:
        """End the engine after a ramp-down, or leave it running with its campaign."""
        line, self._line = self._line, None
        if line is not None:
            line.close(how)
        self.status = None

    def _order(
        self, question: Callable[[EngineClient], Any], on_answer: Callable[[Any], None] | None = None
    ) -> None:
        if self._line is None:
            self.noticed.emit(
                Notice(NoticeKind.WARNING, "No bench is open.", next_step="Open it on the Rig page (Ctrl+1).")
            )
            return
        self._orders += 1
        line = self._line

        def end_order() -> None:
            if self._line is line:  # commands to an earlier engine do not count
                self._orders -= 1

        def take_answer(answer: Any) -> None:
            end_order()
            (on_answer or ignore)(answer)

        def take_refusal(error: AcquisitionError) -> None:
            end_order()
            self._report(error)

        line.ask(Urgency.ORDER, question, take_answer, take_refusal)

    def _look_question(self) -> Callable[[EngineClient], Snapshot]:
        view, run, status = self.view, self._view_run, self.status
        rate_hz = 0.0 if status is None or status.bench is None else status.bench.sample_rate_hz

        def look(client: EngineClient) -> Snapshot:
            now = client.status()
            since = 0 if now.run_id != run else now.samples if view is None else view.next_sample
            if now.samples <= since or rate_hz == 0.0:
                return now, None
            return now, client.look(since, most=round(CATCH_UP_S * rate_hz))

        return look

    def _take_snapshot(self, snapshot: Snapshot) -> None:
        before, (self.status, newest_samples) = self.state, snapshot
        if (before, self.state) in _ADVANCES:
            self.advanced.emit()
        if newest_samples is None or self.status.bench is None or newest_samples.volts.shape[1] == 0:
            self._is_looking = False
        else:
            self._begin_taking(self.status, self.status.bench, newest_samples)
        self._emit_news(self.status)

    def _begin_taking(self, status: EngineStatus, bench: BenchFacts, newest_samples: SampleSlice) -> None:
        if self.view is None or newest_samples.run_id != self._view_run:
            name = "" if status.run is None else status.run.name
            self.view = live_view(bench, self.rig, self.campaign, name)
            self._view_run = newest_samples.run_id
        size = max(1, round(PIECE_S * bench.sample_rate_hz))
        self._take(self.view, newest_samples.first_sample, newest_samples.volts, size)

    def _take(self, view: LiveView, first_sample: int, volts: NDArray[np.float32], size: int) -> None:
        """Process one batch of samples and schedule the next one; all at once would block the window."""
        view.add(first_sample, volts[:, :size])
        rest = volts[:, size:]
        if rest.shape[1] == 0:
            self._is_looking = False
        else:
            self.heartbeat()
            in_next_pass(self, lambda: self._take(view, first_sample + size, rest, size))

    def _emit_news(self, status: EngineStatus) -> None:
        for message in status.messages:
            if message.number > self._last_message:
                self._last_message = message.number
                kind = NoticeKind(message.kind.value)
                self.noticed.emit(Notice(kind, message.what, message.done, message.next_step, message.code))
        ended = frozenset(
            row.file for row in status.rows if row.file and row.state not in ("queued", "running")
        )
        for file in sorted(ended - self._ended):
            self.recording_ended.emit(Path(file))
        self._ended = ended

    def _report(self, error: AcquisitionError) -> None:
        if isinstance(error, EngineGone):
            self._drop_engine(error)
        else:
            self.noticed.emit(notice_of(error))

    def _end_look(self, error: AcquisitionError) -> None:
        self._is_looking = False
        self._report(error)

    def _drop_engine(self, error: EngineGone) -> None:
        if self._line is None:
            return
        line, self._line = self._line, None
        self.status, self._last_message, self._ended = None, 0, frozenset()
        self._orders = self._view_run = 0  # runs of the next engine start at 1
        line.leave()
        if isinstance(error, EngineSilent):
            self.noticed.emit(notice_of(error, "Then open the bench again on the Rig page."))
        else:
            code = type(error).__name__
            what, next_step = "The engine was killed.", f"{SWITCH_OFF}."
            self.noticed.emit(Notice(NoticeKind.FAULT, what, next_step=next_step, code=code))


_ADVANCES = frozenset(
    {
        (EngineState.OPENING, EngineState.READY),
        (EngineState.CHECKING, EngineState.READY),
        (EngineState.READY, EngineState.ARMED),
        (EngineState.ARMED, EngineState.RUNNING),
    }
)
"""Changes of the engine's state after which an earlier error message no longer applies."""


def _open(client: EngineClient, rig: Rig, confirmations: KnobSheet | None) -> None:
    """Open a bench, and load the libraries that the first plot of a run needs."""
    client.open(rig, confirmations)
    warm_up()


def _adopt(client: EngineClient) -> tuple[Rig, CampaignRequest, EngineStatus]:
    warm_up()
    return client.open_rig(), client.last_request(), client.status()
