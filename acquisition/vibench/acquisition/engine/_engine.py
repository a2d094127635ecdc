"""The engine, which owns a bench and publishes its state."""

from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from functools import cache, partial
from pathlib import Path
from queue import SimpleQueue

from vibench.stop_files import SWITCH_OFF

from ..bench import Bench
from ..campaign import (
    CampaignEvent,
    CampaignEventKind,
    CampaignListener,
    CampaignProgress,
    CommandMessenger,
    Messenger,
    PointOutcome,
    PointResult,
    ReconnectingBench,
    ignore_event,
    ignore_result,
    make_folder,
    require_all_within_limits,
    run_campaign,
)
from ..check.admission import check_bench, require_fresh
from ..errors import AcquisitionError, CheckStopped, InstrumentLost
from ..plan import OnChange
from ..rig import Confirm, Rig, Role, channels_of
from ..stopping.program import stop_on_signal
from ..stopping.stop import DRIVES_ON, Cause, StopSwitch
from ._published_state import PublishedState
from ._status import BenchFacts, ChannelFacts, EngineState, Supervision, TwinProcess, TwinStatus, TwinSwitch
from ._verbs import CampaignRequest


def bench_facts(bench: Bench, role: Role | None = None) -> BenchFacts:
    """Return the description of an open bench for viewers; ``role`` is the vibrometer's role in a scan."""
    return BenchFacts(
        rig_name=bench.rig.name,
        is_simulated=bench.rig.virtual is not None,
        identities={part: identity.reply for part, identity in bench.identities.items()},
        channels=tuple(
            ChannelFacts(
                role=channel.role.value,
                unit=channel.unit,
                units_per_volt=channel.units_per_volt,
                full_scale_v=channel.full_scale_v,
            )
            for channel in channels_of(bench.rig if role is None else bench.rig.with_beam_on(role))
        ),
        sample_rate_hz=bench.digitizer.sample_rate_hz,
    )


class Engine:
    """A bench and its jobs. A single thread calls the methods and uses the instruments.

    Other threads read `published` and use `switch`. If a method fails, it publishes the error and then raises
    it. Call `close` at the end: the bench is then silent and closed.
    """

    def __init__(self, supervision: Supervision) -> None:
        self.supervision = supervision
        self.published = PublishedState(supervision)
        self.switch = StopSwitch()
        """Switch that pauses or ends the running campaign; every campaign has a new switch."""
        self._reconnecting: ReconnectingBench | None = None
        self._twin = TwinProcess()

    @property
    def rig(self) -> Rig | None:
        """The configuration of the open bench; None if no bench is open."""
        reconnecting = self._reconnecting
        return None if reconnecting is None else reconnecting.bench.rig

    @property
    def bench(self) -> Bench:
        """The open bench; other threads may read its rig while the state says that the bench is open."""
        assert self._reconnecting is not None, f"no bench is open in the state {self.published.state}"
        return self._reconnecting.bench

    @property
    def stop_sentence(self) -> str:
        """Sentence on why the run was stopped and whether the output is off; empty if it was not stopped."""
        request = self.switch.request
        if request is None or request.cause is Cause.FAULT:
            return ""
        return f"{request.reason}. {SWITCH_OFF if DRIVES_ON else 'The output is off'}."

    @property
    def played_faults(self) -> tuple[str, ...]:
        """Faults that a script has injected into a virtual rig so far, in order."""
        return () if self._reconnecting is None else self._reconnecting.played_faults

    def open(self, rig: Rig, confirm: Confirm | None = None) -> None:
        """Open the bench of a rig; for ``confirm``, see `vibench.acquisition.open_bench`."""
        try:
            self._reconnecting = ReconnectingBench(rig, confirm)
            self._reconnecting.__enter__()
        except AcquisitionError as error:
            self._reconnecting = None
            self._fails(error, EngineState.FAULT)
            raise
        self.published.bench(bench_facts(self.bench))
        self.published.messages.info(f"{rig.name} is open")
        self.published.enter(EngineState.READY)

    def close(self) -> None:
        """Silence the bench and close it. May be called at any time.

        When an instrument fails, the error is published, then raised as AcquisitionError.
        """
        failure = self._release()
        self.published.enter(EngineState.CLOSED)
        if failure is not None:
            raise failure

    def check(self, folder: Path, *, new_reference: bool = False) -> None:
        """Check the bench with a small sine, and keep the report; see `check_bench`."""
        try:
            result = check_bench(self.bench, folder, switch=self.switch, new_reference=new_reference)
        except CheckStopped as stopped:
            self._check_ended(stopped)
            return
        except AcquisitionError as error:
            self._fails(error, EngineState.READY)
            raise
        self.published.note_check(result.report, result.checked.isoformat(timespec="seconds"))
        self.published.enter(EngineState.READY)

    def measure(
        self,
        request: CampaignRequest,
        on_result: Callable[[PointResult], None] = ignore_result,
        on_event: CampaignListener = ignore_event,
        messengers: tuple[Messenger, ...] = (),
        move_beam: CommandMessenger | None = None,
    ) -> tuple[PointResult, ...]:
        """Run a campaign and return its results; the given functions are called by `run_campaign`."""
        assert self._reconnecting is not None
        facts_at = cache(partial(bench_facts, self.bench))
        roles = {name: each.point and each.point.role for name, each in request.campaign.recordings()}

        def report_progress(progress: CampaignProgress) -> None:
            self.published.note_progress(progress, facts_at(roles.get(progress.name)))

        def on_end(point_result: PointResult) -> None:
            self.published.note_result(point_result)
            on_result(point_result)

        def on_campaign_event(event: CampaignEvent) -> None:
            if event.kind is CampaignEventKind.RESTING:
                self.published.note_pause(request.campaign.rest_s, event.text)
            if event.kind is CampaignEventKind.DAMAGED:
                self.published.messages.warn(event.text)
            if event.kind is CampaignEventKind.MOVE_BEAM:
                self.published.messages.warn(event.text)
                self.published.enter(EngineState.HELD)
            on_event(event)

        self.published.begin(request.campaign, request.folder)
        plans = (each for _, each in request.campaign.recordings())
        may_end_by_change = any(each.limits.on_changed_specimen is OnChange.STOP for each in plans)
        if request.twin is TwinSwitch.ON or may_end_by_change:
            self.turn_twin(TwinSwitch.ON)
        try:
            # Do this before the check of the bench, so that an invalid plan is refused before anything moves.
            require_all_within_limits(request.campaign.points(), self.bench)
            make_folder(request.folder)
            with stop_on_signal(self.switch):
                require_fresh(self.bench, request.folder, request.check, switch=self.switch)
            point_results = run_campaign(
                self.bench,
                request.campaign,
                request.folder,
                request.existing,
                request.after_failure,
                on_progress=report_progress,
                on_result=on_end,
                switch=self.switch,
                reopen=self._reconnecting.reopen,
                changed_bench=request.changed_bench,
                on_event=on_campaign_event,
                messengers=messengers,
                move_beam=move_beam,
            )
        except CheckStopped as stopped:
            self._check_ended(stopped)
            return ()
        except AcquisitionError as error:
            self.published.note_failure(str(error))
            self._fails(error, EngineState.READY)
            raise
        counts = Counter(point_result.outcome for point_result in point_results)
        text = ", ".join(f"{counts[each]} {each.value}" for each in PointOutcome if counts[each])
        self.published.messages.info(f"Campaign ended: {text or 'stopped before its first point'}")
        self.published.enter(EngineState.READY)
        return point_results

    def turn_twin(self, switch: TwinSwitch) -> None:
        """Start or end the live twin, a separate process for which the engine never waits."""
        self._twin.turn(switch)
        self.published.twin(TwinStatus() if self._twin.is_on else None)

    def look_after_twin(self) -> None:
        """Warn if the live twin has ended by itself: nothing then notices changes of the specimen."""
        if (words := self._twin.last_words()) is not None:
            self.published.twin(None)
            self.published.messages.warn(
                f"The live twin has ended ({words}).",
                "The measurement goes on.",
                "Changes of the specimen are no longer detected; turn the twin on again.",
            )

    def _check_ended(self, stopped: CheckStopped) -> None:
        """Publish that somebody stopped the check; this is not a fault."""
        self.published.messages.info(str(stopped))
        self.published.enter(EngineState.READY)

    def fault(self, error: Exception) -> None:
        """Publish an unexpected error, and close the bench."""
        self._fails(error, EngineState.FAULT)

    def _fails(self, error: Exception, otherwise: EngineState) -> None:
        """Publish an error; a bench that has lost an instrument is closed."""
        self.published.messages.fault(error)
        state = EngineState.FAULT if isinstance(error, InstrumentLost) else otherwise
        if state is EngineState.FAULT:
            self._release()
        self.published.enter(state)

    def _release(self) -> AcquisitionError | None:
        reconnecting, self._reconnecting = self._reconnecting, None
        try:
            if reconnecting is not None:
                reconnecting.close()
        except AcquisitionError as error:
            self.published.messages.fault(error)
            return error
        else:
            return None
        finally:
            self.published.bench(None)
            self.turn_twin(TwinSwitch.OFF)


Job = Callable[[], object]
ENDING_CAUSES = frozenset({Cause.TERMINATED, Cause.KEYBOARD, Cause.PARENT_GONE})
"""Causes of a stop that also end the process, after the end of the campaign."""


class JobQueue:
    """Queue of jobs for an engine; any thread may add jobs, and the thread that calls `run` executes them."""

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._jobs: SimpleQueue[Job | None] = SimpleQueue()

    def put(self, job: Job) -> None:
        """Add a job after all earlier jobs; any thread may call this."""
        self._jobs.put(job)

    def leave(self) -> None:
        """Let `run` end after all earlier jobs; any thread or signal handler may call this."""
        self._jobs.put(None)

    def run(self) -> None:
        """Carry out jobs until `leave` is called; always close the bench at the end."""
        try:
            while (job := self._jobs.get()) is not None:
                self._do(job)
        finally:
            with suppress(AcquisitionError):  # the engine has published the error
                self._engine.close()

    def _do(self, job: Job) -> None:
        try:
            job()
        except AcquisitionError:
            pass  # the engine has published the error
        except Exception as error:  # noqa: BLE001 - any error must silence the bench and be published
            self._engine.fault(error)
        request = self._engine.switch.request
        if request is not None and request.cause in ENDING_CAUSES:
            self.leave()
