"""The bridge between window and engine: what the engine says comes in, what a person wants goes out."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Concatenate, ParamSpec

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QTimer, Signal

from vibench.acquisition import AcquisitionError, StopLevel
from vibench.acquisition.engine import (
    DRIVING,
    AdoptedEngine,
    Announcement,
    ArmedPlan,
    BenchFacts,
    CampaignRequest,
    EngineClient,
    EngineGone,
    EngineMessage,
    EngineSilent,
    EngineState,
    EngineStatus,
    SampleSlice,
    Supervision,
    start_engine,
)
from vibench.acquisition.plan import Campaign
from vibench.acquisition.rig import KnobSheet, Rig
from vibench.analysis.live import LiveView
from vibench.stop_files import SWITCH_OFF

from ..widgets.notice import Notice, NoticeKind, notice_of
from .engine_line import EngineLine, Starter, Urgency
from .live_run import live_view, warm_up

CATCH_UP_S = 2.0
"""Older samples than this are not asked for after a pause: the picture shows now, the file holds all."""

PIECE_S = 0.2
"""Samples that are taken in at once; a frame of a real instrument's brings a quarter of that."""

P = ParamSpec("P")
Snapshot = tuple[EngineStatus, SampleSlice | None]


class Bridge(QObject):
    """The one place where the window and the engine meet.

    Everything known is what the engine said last. `tick`, called by the window's timer, fetches
    answers and asks again: this is also how the engine knows that the window is alive.
    """

    noticed = Signal(object)
    """A `Notice` from the engine, or about it."""
    armed = Signal(object)
    """The `ArmedPlan` after `arm` was granted."""
    adopted = Signal(object)
    """The `CampaignRequest` that an engine carries out which another window has left alone."""
    advanced = Signal()
    """What was wanted has come about: a bench is open, a plan armed, a run begun."""
    recording_ended = Signal(object)
    """Path of a recording that has just come to its end."""

    def __init__(self, start: Starter = start_engine, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._start = start
        self._line: EngineLine | None = None
        self._status: EngineStatus | None = None
        self._view: LiveView | None = None
        self._view_run = 0
        self._rig: Rig | None = None
        self._campaign: Campaign | None = None
        self._last_message = 0
        self._ended: frozenset[str] = frozenset()
        self._is_looking = False
        self._orders = 0
        self._attendance = Supervision.ATTENDED

    @property
    def status(self) -> EngineStatus | None:
        """What the engine said last; None while there is none."""
        return self._status

    @property
    def state(self) -> EngineState:
        """Where the engine stands; closed while there is none."""
        return EngineState.CLOSED if self._status is None else self._status.state

    @property
    def is_ordering(self) -> bool:
        """Whether an order is on its way: a campaign may take seconds to be held against the limits."""
        return self._orders > 0

    @property
    def is_driving(self) -> bool:
        """Whether the drive may be on."""
        return self.state in DRIVING

    @property
    def view(self) -> LiveView | None:
        """The newest samples of the run; None before the first one, and since another plan was armed."""
        return self._view

    @property
    def rig(self) -> Rig | None:
        """The rig whose bench was opened last."""
        return self._rig

    @property
    def campaign(self) -> Campaign | None:
        """What was armed last."""
        return self._campaign

    @property
    def engine_pid(self) -> int | None:
        """The engine's process."""
        return None if self._line is None else self._line.pid

    def tick(self) -> None:
        """Fetch what has come, and ask again."""
        if self._line is None:
            return
        self.beat()
        self._line.drain()
        if not self._is_looking and self._line is not None:
            self._is_looking = True
            self._line.ask(Urgency.LOOK, self._look_question(), self._looked, self._look_refused)

    def beat(self) -> None:
        """Note that the window's own thread is alive; a process of its own tells the engine."""
        attendant = None if self._line is None else self._line.attendant
        if attendant is not None:
            attendant.live()

    def open(self, rig: Rig, confirmations: KnobSheet | None) -> None:
        """Open the bench of a rig, with an engine of its own if there is none yet."""
        if self._line is None:
            self._line = EngineLine(self._start)
        self._rig = rig
        self._order(lambda client: _open(client, rig, confirmations))

    def adopt(self, announcement: Announcement) -> None:
        """Take over an engine that was left alone, with what it carries out; `adopted` follows."""
        if self._line is not None:
            return
        self._line = EngineLine(lambda: AdoptedEngine(announcement))

        def keep(found: tuple[Rig, CampaignRequest, EngineStatus]) -> None:
            self._rig, request, self._status = found
            self._campaign, self._attendance = request.campaign, Supervision.UNATTENDED
            self._tell(self._status)  # what happened before anybody looked again
            self.adopted.emit(request)

        self._order(_taken_over, keep)

    def order(
        self, verb: Callable[Concatenate[EngineClient, P], object], *args: P.args, **kwargs: P.kwargs
    ) -> None:
        """Have the engine carry out a verb of its client, such as ``EngineClient.start``."""
        self._order(lambda client: verb(client, *args, **kwargs))

    def arm(self, request: CampaignRequest) -> None:
        """Get ready to carry out a campaign; `armed` or a notice follows."""

        def keep(plan: ArmedPlan) -> None:
            self._campaign, self._attendance = request.campaign, plan.attendance
            self._view = None
            self.armed.emit(plan)

        self._order(lambda client: client.arm_request(request), keep)

    def stop(self, level: StopLevel, reason: str) -> None:
        """Hold or end what runs; goes before everything else that waits."""
        if self._line is not None:
            self._line.ask(Urgency.STOP, lambda client: client.stop(level, reason), _done, self._refused)

    @property
    def may_leave(self) -> bool:
        """Whether what runs was meant to be left alone."""
        return self.is_driving and self._attendance is Supervision.UNATTENDED

    def close(self, how: Urgency = Urgency.END) -> None:
        """Let the engine ramp down and end; or leave it alone with what it carries out."""
        line, self._line = self._line, None
        if line is not None:
            line.close(how)
        self._status = None

    def _order(
        self, question: Callable[[EngineClient], Any], on_answer: Callable[[Any], None] | None = None
    ) -> None:
        if self._line is None:
            self.noticed.emit(
                Notice(
                    NoticeKind.WARNING, "No bench is open.", next_step="Open one on the Rig page (Ctrl+1)."
                )
            )
            return
        self._orders += 1
        line = self._line

        def over() -> None:
            if self._line is line:  # or it has been forgotten, with all its orders
                self._orders -= 1

        def answered(answer: Any) -> None:
            over()
            (on_answer or _done)(answer)

        def refused(error: AcquisitionError) -> None:
            over()
            self._refused(error)

        line.ask(Urgency.ORDER, question, answered, refused)

    def _look_question(self) -> Callable[[EngineClient], Snapshot]:
        view, run, status = self._view, self._view_run, self._status
        rate_hz = 0.0 if status is None or status.bench is None else status.bench.sample_rate_hz

        def look(client: EngineClient) -> Snapshot:
            now = client.status()
            since = 0 if now.run_id != run else now.samples if view is None else view.next_sample
            if now.samples <= since or rate_hz == 0.0:
                return now, None
            return now, client.look(since, most=round(CATCH_UP_S * rate_hz))

        return look

    def _looked(self, snapshot: Snapshot) -> None:
        before, (self._status, newest_samples) = self.state, snapshot
        if (before, self.state) in _ADVANCES:
            self.advanced.emit()
        if newest_samples is None or self._status.bench is None or newest_samples.volts.shape[1] == 0:
            self._is_looking = False
        else:
            self._begin_taking(self._status, self._status.bench, newest_samples)
        self._tell(self._status)

    def _begin_taking(self, status: EngineStatus, bench: BenchFacts, newest_samples: SampleSlice) -> None:
        if self._view is None or newest_samples.run_id != self._view_run:
            name = "" if status.run is None else status.run.name
            self._view = live_view(bench, self._rig, self._campaign, name)
            self._view_run = newest_samples.run_id
        size = max(1, round(PIECE_S * bench.sample_rate_hz))
        self._take(self._view, newest_samples.first_sample, newest_samples.volts, size)

    def _take(self, view: LiveView, first_sample: int, volts: NDArray[np.float32], size: int) -> None:
        """Take in a piece: all that comes after a pause, or from a fast simulation, is too much at once."""
        view.add(first_sample, volts[:, :size])
        rest = volts[:, size:]
        if rest.shape[1] == 0:
            self._is_looking = False
        else:
            self.beat()
            QTimer.singleShot(0, self, lambda: self._take(view, first_sample + size, rest, size))

    def _tell(self, status: EngineStatus) -> None:
        for message in status.messages:
            if message.number > self._last_message:
                self._last_message = message.number
                self.noticed.emit(_notice(message))
        ended = frozenset(
            row.file for row in status.rows if row.file and row.state not in ("queued", "running")
        )
        for file in sorted(ended - self._ended):
            self.recording_ended.emit(Path(file))
        self._ended = ended

    def _refused(self, error: AcquisitionError) -> None:
        if isinstance(error, EngineGone):
            self._gone(error)
        else:
            self.noticed.emit(notice_of(error))

    def _look_refused(self, error: AcquisitionError) -> None:
        self._is_looking = False
        self._refused(error)

    def _gone(self, error: EngineGone) -> None:
        """Forget an engine that has ended: whatever is shown of it would be out of date."""
        if self._line is None:
            return
        line, self._line = self._line, None
        self._status, self._last_message, self._ended = None, 0, frozenset()
        self._orders = self._view_run = 0  # another engine counts its runs from 1 again
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
"""Steps after which a complaint about what was before would be out of date."""


def _open(client: EngineClient, rig: Rig, confirmations: KnobSheet | None) -> None:
    """Open a bench, and meanwhile load what the first picture of a run needs: no frame has time for that."""
    client.open(rig, confirmations)
    warm_up()


def _taken_over(client: EngineClient) -> tuple[Rig, CampaignRequest, EngineStatus]:
    warm_up()
    return client.open_rig(), client.carried_request(), client.status()


def _done(_: object) -> None:
    """Take note that an order was carried out: the status shows what it did."""


def _notice(message: EngineMessage) -> Notice:
    kind = NoticeKind(message.kind.value)
    return Notice(kind, message.what, message.done, message.next_step, message.code)
