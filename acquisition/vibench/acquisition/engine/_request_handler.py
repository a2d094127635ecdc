"""The engine's request handler: it answers at once, in any thread, and uses no instrument itself."""

from collections.abc import Mapping
from datetime import timedelta
from functools import partial
from pathlib import Path
from threading import Lock
from time import monotonic
from typing import Annotated, Any

from pydantic import Field, NonNegativeFloat, NonNegativeInt, PositiveInt

from vibench.sim import count_text

from ..bench import Bench
from ..campaign import planned_recordings, require_all_within_limits
from ..check.admission import CheckRule, require_on_record
from ..rig import KnobSheet, Rig, confirm_knobs_of
from ..stopping.program import INTERVAL_S
from ..stopping.stop import Cause, StopLevel, StopRequest, StopSwitch
from ._engine import Engine, JobQueue
from ._published_state import SampleSlice
from ._status import (
    DRIVING,
    SOUNDING,
    VIEWER_PATIENCE_S,
    ArmedPlan,
    EngineState,
    EngineStatus,
    Supervision,
    TwinStatus,
    TwinSwitch,
    hung_patience_s,
    patience_s,
)
from ._verbs import ARMING_S, AbsolutePath, AbsoluteRequest, CampaignRequest, Verb, verb
from ._wire import EngineError

ARMED_S = 60.0
"""An armed engine disarms itself after this time [s]."""


def armed_plan(bench: Bench, request: CampaignRequest, supervision: Supervision) -> ArmedPlan:
    """Check a campaign for this bench and folder, and return its plan; play no signal, write no file.

    Raises AcquisitionError with every reason why the campaign cannot be run.
    """
    if request.check is CheckRule.FRESH:
        require_on_record(bench)
    campaign, folder = request.campaign, request.folder
    points = campaign.points()
    checks = require_all_within_limits(points, bench)
    planned = planned_recordings(campaign, folder, request.existing)
    missing = [each for each in planned if not each.is_complete]
    # Only loads can cause damage; it is harmless to reach a limit on waveform points or ramps.
    loads = [named for named in checks if named[1].load is not None]
    tightest, closest = max(loads or checks, key=lambda named: named[1].use)
    loudest = max(point.measurement.excitation.highest_amplitude_vpp for point in points)
    kinds = ", ".join(dict.fromkeys(point.measurement.excitation.kind for point in points))
    size_mb = campaign.size_bytes(bench.digitizer.sample_rate_hz, len(bench.channels)) / 1e6
    length = timedelta(seconds=round(campaign.duration_s))
    bound = f"{closest.limit:.4g} {closest.unit}"
    kept = f", {count} kept from before" if (count := len(planned) - len(missing)) else ""
    attendance = request.attendance or supervision
    granted_s = patience_s(request.longest_patience_s, closest.use)
    hung_s = hung_patience_s(granted_s)
    is_attended = attendance is Supervision.ATTENDED
    return ArmedPlan(
        campaign=campaign.name,
        folder=str(folder),
        lines=(
            f"What: {count_text(len(missing), 'recording')} ({kinds}){kept}",
            f"Level: at most {loudest:g} Vpp at the generator",
            f"Closest limit: {closest.what} is at {closest.use:.0%} of {bound} in {tightest}",
            f"Duration: {length} (h:min:s), ramps and checks included",
            f"Saved in: {folder}, at most {size_mb:.0f} MB while recording",
            "Without a viewer: "
            + (
                f"aborted after {granted_s:.1f} s, or after {hung_s:.1f} s if the window hangs"
                if is_attended
                else "continues, unattended"
            ),
        ),
        expires_in_s=ARMED_S,
        attendance=attendance,
        patience_s=granted_s,
    )


STALL_S = 0.2
"""This process counts as stalled if the time between two checks for viewers exceeds this value [s]."""
LATE_FACTOR = 4.0
"""Extra time without requests, as a multiple of this process's own delay: viewers may be delayed too."""
TAKEN_OVER_S = 2.0
"""A viewer attends an engine without a parent if the viewer's last request is newer than this [s]."""
FORGETTING = 0.995
"""Factor by which the stored largest delay is multiplied at each check; the stored delay halves in 7 s."""


class RequestHandler:
    """Handler of the requests to an engine.

    The handler answers from the published state, queues a job for the engine, or sets the engine's stop
    switch. `carry_out` accepts requests: it raises `EngineError` with one sentence when the engine's state
    does not permit a request. The client's methods have the names, parameters and descriptions of the verbs.
    """

    def __init__(self, engine: Engine, jobs: JobQueue) -> None:
        self._engine = engine
        self._jobs = jobs
        self._asking = Lock()
        self._request: CampaignRequest | None = None
        self._carried: CampaignRequest | None = None
        self._is_orphan = self._is_closing = self._is_ending = False
        self._armed_s = 0.0
        self._stops = 0
        self._last_request_s = self._last_round_s = monotonic()
        self._late_s = self._still_s = 0.0
        self._attendance, self._patience_s = engine.supervision, VIEWER_PATIENCE_S

    def carry_out(self, verb: Verb, arguments: Mapping[str, object]) -> Any:
        """Carry out a request, if the engine's state permits it, and return its answer."""
        if not verb.states:  # a stop must not wait for other requests
            return verb.call(self, **arguments)
        with self._asking:
            state = self._engine.published.state
            # Once the bench is published as closed, a viewer may open it, even if the request to close it has
            # not returned yet.
            if self._is_ending or (self._is_closing and state is not EngineState.CLOSED):
                raise EngineError(
                    f"the bench is being closed, so the engine cannot {verb.word} now; "
                    "try again when the bench is closed"
                )
            if state not in verb.states:
                now, *permitted = (each.value.replace("_", " ") for each in (state, *verb.states))
                allowed = " or ".join(permitted)
                raise EngineError(
                    f"the engine is {now} and cannot {verb.word} now; it must be {allowed} first"
                )
            return verb.call(self, **arguments)

    def note_presence(self) -> None:
        """Register that a viewer is present."""
        self._last_request_s = monotonic()

    @verb("beat")
    def heartbeat(self, still_s: NonNegativeFloat = 0.0) -> None:
        """Report that the viewer is present, and how long its window has been blocked (``still_s`` [s])."""
        self._still_s = still_s
        self.note_presence()

    def status(self) -> EngineStatus:
        """Return the status of the engine."""
        status = self._engine.published.status()
        is_left_alone = self._is_orphan and not self._is_looked_after
        return status.model_copy(update={"is_left_alone": is_left_alone}) if is_left_alone else status

    @verb("status")
    def status_since(self, known_rows: int = -1) -> EngineStatus:
        """Return the engine's status, without its ``rows`` if ``known_rows`` equals its ``rows_number``."""
        status = self.status()
        return status.model_copy(update={"rows": ()}) if status.rows_number == known_rows else status

    @verb("look")
    def look(self, since_sample: NonNegativeInt = 0, *, most: PositiveInt) -> SampleSlice:
        """Return the newest samples of the run: from ``since_sample`` on, at most ``most`` per channel."""
        return self._engine.published.sample_buffer.samples_since(since_sample, most)

    @verb("open", EngineState.CLOSED, EngineState.FAULT)
    def open(self, rig: Rig, confirmations: KnobSheet | None = None) -> None:
        """Open the bench of a rig; the status shows when it is open.

        ``confirmations`` lists the manual settings that the operator confirmed; a virtual rig needs none.
        """
        self._engine.published.enter(EngineState.OPENING)
        confirm = partial(confirm_knobs_of, confirmations, "the list of knobs set by hand")
        self._jobs.put(lambda: self._engine.open(rig, None if rig.virtual else confirm))

    @verb("close", EngineState.READY, EngineState.ARMED, EngineState.FAULT, EngineState.CLOSED)
    def close_bench(self) -> None:
        """Close the bench."""
        self._disarm()
        self._is_closing = True
        self._jobs.put(self._close)

    @verb("check", EngineState.READY)
    def check(self, folder: AbsolutePath = Path(), *, new_reference: bool = False) -> None:
        """Check the bench with a small sine, and the free disk space of ``folder``.

        ``new_reference``: do not compare with an earlier check, because the bench was changed on purpose.
        """
        self.heartbeat()
        self._engine.switch = StopSwitch()
        self._attendance, self._patience_s = self._engine.supervision, VIEWER_PATIENCE_S
        self._engine.published.enter(EngineState.CHECKING)
        self._jobs.put(lambda: self._engine.check(folder, new_reference=new_reference))

    @verb("arm", EngineState.READY, EngineState.ARMED, work_s=ARMING_S)
    def arm_request(self, campaign_request: AbsoluteRequest) -> ArmedPlan:
        """Prepare a campaign and return its plan, or refuse the campaign with the reasons."""
        # Checking the limits of a long campaign takes seconds. A stop during this time finds nothing to
        # disarm, so the campaign is armed only if no stop was counted meanwhile.
        stops = self._stops
        plan = armed_plan(self._engine.bench, campaign_request, self._engine.supervision)
        if stops != self._stops:
            raise EngineError(
                "a stop was requested while the campaign was being armed. Nothing was armed; arm it again"
            )
        self._attendance, self._patience_s = plan.attendance, plan.patience_s
        self._request = campaign_request
        self.heartbeat()
        self._armed_s = monotonic()
        self._engine.published.arm(plan, campaign_request.campaign)
        return plan

    @verb("disarm")
    def disarm(self) -> None:
        """Disarm the campaign, so that it cannot be started."""
        with self._asking:
            self._disarm()

    @verb("start", EngineState.ARMED)
    def start(self) -> None:
        """Start the armed campaign."""
        assert self._request is not None
        self.heartbeat()
        request, self._request = self._request, None
        self._carried = request
        self._engine.switch = StopSwitch()
        self._engine.published.enter(EngineState.RUNNING)
        self._jobs.put(lambda: self._engine.measure(request))

    @verb("stop")
    def stop(self, level: StopLevel, reason: str = "stopped by the operator") -> None:
        """Pause or end the run, and disarm an armed campaign; only a pause can be refused."""
        if level is StopLevel.HOLD and (refusal := self._engine.switch.refusal_to_hold()):
            raise EngineError(f"{refusal}. The run continues; stop it with ramp, abort or off")
        self._stop(StopRequest(Cause.OPERATOR, level, reason))

    @verb("resume")
    def resume(self) -> None:
        """Continue a paused run."""
        self._engine.switch.resume()

    @verb("mark", *sorted(DRIVING))
    def mark(self, text: Annotated[str, Field(min_length=1, max_length=200)]) -> None:
        """Write an event at the next sample of the recording."""
        self._engine.switch.mark(text)

    @verb("tell_change", *sorted(DRIVING))
    def note_change(self, text: Annotated[str, Field(min_length=1, max_length=400)]) -> None:
        """Report that the specimen has changed; a run with ``on_changed_specimen = "stop"`` ends."""
        self._engine.published.messages.warn(text)
        self._engine.switch.note_change(text)

    @verb("rig")
    def open_rig(self) -> Rig:
        """Return the configuration of the open bench."""
        rig = self._engine.rig
        if rig is None:
            raise EngineError(
                f"no bench is open while the engine is {self._engine.published.state.value}; open one first"
            )
        return rig

    @verb("request")
    def last_request(self) -> CampaignRequest:
        """Return the last started campaign with its options, for a viewer that did not arm it."""
        if self._carried is None:
            raise EngineError("no campaign was started in this engine yet; arm and start a campaign")
        return self._carried

    @verb("twin")
    def turn_twin(self, switch: TwinSwitch) -> None:
        """Start or end the live twin."""
        with self._asking:
            self._engine.turn_twin(switch)

    @verb("tell_twin")
    def publish_twin(self, told: TwinStatus) -> None:
        """Publish the live twin's report."""
        self._engine.published.twin(told)

    @verb("shutdown")
    def shutdown(self) -> None:
        """Ramp the drive down, silence all outputs, and end the process."""
        self.end(Cause.OPERATOR, "a request ended the engine")

    def end(self, cause: Cause, reason: str) -> None:
        """End the run, silence everything, and let the engine end. Allowed in every engine state."""
        self._stop(StopRequest.of(cause, reason))
        self._is_ending = True
        self._jobs.leave()

    def enforce_deadlines(self) -> None:
        """Apply the time limits: disarm a campaign that nobody starts, and abort a run that has no viewer."""
        engine, now_s = self._engine, monotonic()
        since_s, self._last_round_s = now_s - self._last_round_s, now_s
        self._late_s = max(FORGETTING * self._late_s, min(since_s, STALL_S) - INTERVAL_S)
        if since_s > STALL_S:  # this process was stalled and could not answer viewers
            self._last_request_s += since_s
        engine.look_after_twin()
        if engine.published.state is EngineState.ARMED and now_s - self._armed_s > ARMED_S:
            self.disarm()
            engine.published.messages.warn(
                f"Armed for {ARMED_S:g} s but not started.", "Disarmed.", "Arm again."
            )
        if self._attendance is Supervision.UNATTENDED:
            return
        granted_s = self._patience_s + LATE_FACTOR * max(0.0, self._late_s)
        alone_s = now_s - self._last_request_s
        if alone_s > granted_s:
            self._act_alone(f"no viewer has sent a request for {alone_s:.1f} s")
        elif self._still_s > hung_patience_s(granted_s):
            self._act_alone(f"no viewer has responded for {self._still_s:.1f} s: the window is blocked")

    @property
    def continues_unattended(self) -> bool:
        """Whether an unattended run is in progress."""
        return self._attendance is Supervision.UNATTENDED and self._engine.published.state in DRIVING

    @property
    def outlives_its_parent(self) -> bool:
        """Whether work remains after the parent program has ended.

        The work is an unattended campaign; after it, the engine continues while a viewer attends it.
        """
        if self.continues_unattended and not self._is_orphan:
            self._is_orphan = True
            self._last_request_s = monotonic() - TAKEN_OVER_S  # the requesting viewer has gone
        return self.continues_unattended or (self._is_orphan and self._is_looked_after)

    @property
    def _is_looked_after(self) -> bool:
        return monotonic() - self._last_request_s < TAKEN_OVER_S

    def is_forgotten(self, after_s: float) -> bool:
        """Whether the engine is idle, has started no recording, and had no request for ``after_s`` [s]."""
        status = self.status()
        is_idle = status.state in (EngineState.CLOSED, EngineState.READY)
        return (
            is_idle
            and all(row.state == "queued" for row in status.rows)
            and monotonic() - self._last_request_s > after_s
        )

    def _act_alone(self, reason: str) -> None:
        engine = self._engine
        if engine.published.state is EngineState.ARMED:
            self.disarm()
            engine.published.messages.warn(f"The viewer was lost: {reason}.", "Disarmed.", "Arm again.")
        elif engine.published.state in SOUNDING and engine.switch.request is None:
            engine.switch.ask(StopRequest.of(Cause.VIEWER_GONE, reason))
            kept = "; the recording is kept" if engine.published.state in DRIVING else ""
            engine.published.messages.alarm(
                f"The viewer was lost: {reason}.",
                f"Ramped down{kept}.",
                "If the computer was too busy, end other programs, allow a longer silence (Settings, "
                "patience), or run the campaign unattended (Queue page, or vibench measure).",
            )

    def _close(self) -> None:
        try:
            self._engine.close()
        finally:
            self._is_closing = False

    def _stop(self, request: StopRequest) -> None:
        self._stops += 1
        switch = None
        while switch is not self._engine.switch:  # a run that starts meanwhile has a new switch
            switch = self._engine.switch
            switch.ask(request)
            if request.level is not StopLevel.HOLD and self._engine.published.state is EngineState.ARMED:
                self.disarm()

    def _disarm(self) -> None:
        if self._engine.published.state is EngineState.ARMED:
            self._request = None
            self._engine.published.enter(EngineState.READY)
