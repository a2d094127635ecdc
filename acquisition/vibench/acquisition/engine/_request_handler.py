"""The engine's desk: every request is answered at once, from any thread, and none touches an instrument."""

from pathlib import Path
from threading import Lock
from time import monotonic

from ..rig import KnobSheet, Rig
from ..stopping import Cause, StopLevel, StopRequest, StopSwitch
from ._arming import ARMED_S, armed_plan
from ._campaign_request import Orders
from ._engine import Engine
from ._errors import EngineError
from ._job_queue import Work
from ._sample_buffer import Glance
from ._sheet import confirmed_by
from ._state import DRIVING, SOUNDING, VIEWER_PATIENCE_S, Attendance, EngineState
from ._status import ArmedPlan, EngineStatus

STALL_S = 0.2
"""A look after this process's own viewers that comes so late tells of a stall of this process [s]."""


class Desk:
    """Takes what is asked of an engine.

    It answers from what is known, puts a job into the engine's queue or presses its switch. A method
    raises `EngineError` with one sentence when the engine's state does not allow what was asked.
    """

    def __init__(self, engine: Engine, work: Work) -> None:
        self._engine = engine
        self._work = work
        self._asking = Lock()
        self._orders: Orders | None = None
        self._armed_s = 0.0
        self._heard_s = self._looked_s = monotonic()

    def heard(self) -> None:
        """Note that somebody is there."""
        self._heard_s = monotonic()

    def status(self) -> EngineStatus:
        """Say where the engine stands."""
        return self._engine.shown.status()

    def look(self, since_sample: int, most: int) -> Glance:
        """Give the newest samples of the run."""
        return self._engine.shown.recent.since(since_sample, most)

    def open(self, rig: Rig, confirmations: KnobSheet | None = None) -> None:
        """Open the bench of a rig."""
        with self._asking:
            self._require("open a bench", EngineState.CLOSED, EngineState.FAULT)
            self._engine.shown.enter(EngineState.OPENING)
            confirm = None if rig.virtual is not None else confirmed_by(confirmations)
            self._work.put(lambda: self._engine.open(rig, confirm))

    def close(self) -> None:
        """Close the bench."""
        with self._asking:
            self._require(
                "close the bench", EngineState.READY, EngineState.ARMED, EngineState.FAULT, EngineState.CLOSED
            )
            self._disarm()
            self._work.put(self._engine.close)

    def check(self, folder: Path = Path()) -> None:
        """Check the bench with a small sine; ``folder`` is where recordings will go."""
        with self._asking:
            self._require("check the bench", EngineState.READY)
            self._engine.switch = StopSwitch()
            self._engine.shown.enter(EngineState.CHECKING)
            self._work.put(lambda: self._engine.check(folder))

    def arm(self, orders: Orders) -> ArmedPlan:
        """Get ready to carry out a campaign; raises AcquisitionError with the reasons when it cannot be."""
        with self._asking:
            self._require("arm", EngineState.READY, EngineState.ARMED)
            plan = armed_plan(self._engine.bench, orders)
            self._orders = orders
            self._armed_s = monotonic()
            self._engine.shown.arm(plan, orders.campaign)
            return plan

    def disarm(self) -> None:
        """Take back what was armed. Legal in every state."""
        with self._asking:
            self._disarm()

    def start(self) -> None:
        """Carry out what is armed."""
        with self._asking:
            self._require("start", EngineState.ARMED)
            assert self._orders is not None
            orders, self._orders = self._orders, None
            self._engine.switch = StopSwitch()
            self._engine.shown.enter(EngineState.RUNNING)
            self._work.put(lambda: self._engine.measure(orders))

    def stop(self, request: StopRequest) -> None:
        """Hold or end what runs, and disarm what is armed. Legal in every state, and never refused."""
        # Without the lock: whatever else is being asked, a stop gets through.
        self._engine.switch.ask(request)
        if request.level is not StopLevel.HOLD and self._engine.shown.state is EngineState.ARMED:
            self.disarm()

    def resume(self) -> None:
        """Go on after a hold. Legal in every state."""
        self._engine.switch.resume()

    def mark(self, text: str) -> None:
        """Note an event at the next sample of the recording."""
        if self._engine.shown.state not in DRIVING:
            raise EngineError("nothing is being recorded that could be marked; start a measurement first")
        self._engine.switch.mark(text)

    def shutdown(self, cause: Cause, reason: str) -> None:
        """End what runs, silence everything, and let the engine end. Legal in every state."""
        self.stop(StopRequest.by(cause, reason))
        self._work.leave()

    def look_after(self) -> None:
        """Do what time asks for: disarm what nobody starts, abort what nobody attends."""
        engine, now_s = self._engine, monotonic()
        since_s, self._looked_s = now_s - self._looked_s, now_s
        if since_s > STALL_S:  # whoever asked while this process did not run is not to blame
            self._heard_s += since_s
        if engine.shown.state is EngineState.ARMED and now_s - self._armed_s > ARMED_S:
            self.disarm()
            engine.shown.messages.warn(f"Armed for {ARMED_S:g} s and not started.", "Disarmed.", "Arm again.")
        alone_s = now_s - self._heard_s
        if engine.attendance is Attendance.ATTENDED and alone_s > VIEWER_PATIENCE_S:
            self._act_alone(f"nobody has looked for {alone_s:.1f} s")

    def is_forgotten(self, after_s: float) -> bool:
        """Whether nobody has asked for so long, and nothing was carried out that they may come back to."""
        status = self.status()
        is_idle = status.state in (EngineState.CLOSED, EngineState.READY)
        return (
            is_idle
            and all(row.state == "queued" for row in status.rows)
            and monotonic() - self._heard_s > after_s
        )

    def _act_alone(self, reason: str) -> None:
        engine = self._engine
        if engine.shown.state is EngineState.ARMED:
            self.disarm()
        elif engine.shown.state in SOUNDING and engine.switch.request is None:
            engine.switch.ask(StopRequest.by(Cause.VIEWER_GONE, reason))
            kept = "; the recording is kept" if engine.shown.state in DRIVING else ""
            engine.shown.messages.warn(f"The viewer is gone: {reason}.", f"Ramped down{kept}.")

    def _disarm(self) -> None:
        if self._engine.shown.state is EngineState.ARMED:
            self._orders = None
            self._engine.shown.enter(EngineState.READY)

    def _require(self, wanted: str, *allowed: EngineState) -> None:
        state = self._engine.shown.state
        if state not in allowed:
            raise EngineError(
                f"the engine is {state.value.replace('_', ' ')} and cannot {wanted} now; "
                f"it can when it is {' or '.join(each.value for each in allowed)}"
            )
