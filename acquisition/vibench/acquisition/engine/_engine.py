"""The engine: it owns a bench, and shows everybody what it does with it.

An open bench in the words of the protocol.
"""

from collections.abc import Callable
from pathlib import Path

from ..bench import Bench
from ..campaign import (
    PointResult,
    CampaignProgress,
    CampaignEventKind,
    CampaignEvent,
    PointOutcome,
    ReconnectingBench,
    CampaignListener,
    Messenger,
    ignore_event,
    ignore_result,
    make_folder,
    run_campaign,
)
from ..check import check_and_keep, require_fresh
from ..errors import AcquisitionError, CheckStopped, InstrumentLost
from ..rig import Confirm, Rig
from ..stopping import StopSwitch, stop_on_signal
from ._lock import BenchLock
from ._published_state import PublishedState
from ._requests import CampaignRequest
from ._state import Supervision, EngineState
from ._status import BenchFacts, ChannelFacts


def bench_facts(bench: Bench) -> BenchFacts:
    """Say which bench is open."""
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
            for channel in bench.channels
        ),
        sample_rate_hz=bench.digitizer.sample_rate_hz,
    )


class Engine:
    """A bench and what is done with it; one thread calls its methods, and only that one touches instruments.

    Everybody else looks at `shown` and presses `switch`. A method raises what goes wrong, after it has
    shown it; leave the engine through a ``with``, and the bench is silent and closed.
    """

    def __init__(self, attendance: Supervision) -> None:
        self.attendance = attendance
        self.shown = PublishedState(attendance)
        self.switch = StopSwitch()
        """Holds or ends what runs; a new one for every campaign."""
        self._kept: ReconnectingBench | None = None
        self._lock: BenchLock | None = None

    @property
    def bench(self) -> Bench:
        """The open bench; others may look at its rig, where the state says that there is one."""
        assert self._kept is not None, f"no bench is open while {self.shown.state}"
        return self._kept.bench

    @property
    def played_faults(self) -> tuple[str, ...]:
        """What a script of faults has done to a virtual rig so far, in order."""
        return () if self._kept is None else self._kept.played_faults

    def open(self, rig: Rig, confirm: Confirm | None = None) -> None:
        """Open the bench of a rig; ``confirm`` as `vibench.acquisition.bench.open_bench` takes it."""
        try:
            self._lock = BenchLock.of(rig)
            self._kept = ReconnectingBench(rig, confirm)
            self._kept.__enter__()
        except AcquisitionError as error:
            self._kept = None
            self._fails(error, EngineState.FAULT)
            raise
        self.shown.bench(bench_facts(self.bench))
        self.shown.messages.info(f"{rig.name} is open")
        self.shown.enter(EngineState.READY)

    def close(self) -> None:
        """Silence the bench and close it. Legal at any time."""
        self._release()
        self.shown.enter(EngineState.CLOSED)

    def check(self, folder: Path) -> None:
        """Check the bench with a small sine, and keep what was found."""
        try:
            result = check_and_keep(self.bench, folder, switch=self.switch)
        except CheckStopped as stopped:
            self._check_ended(stopped)
            return
        except AcquisitionError as error:
            self._fails(error, EngineState.READY)
            raise
        self.shown.checked(result.report, result.checked.isoformat(timespec="seconds"))
        self.shown.enter(EngineState.READY)

    def measure(
        self,
        orders: CampaignRequest,
        on_item: Callable[[PointResult], None] = ignore_result,
        on_happening: CampaignListener = ignore_event,
        messengers: tuple[Messenger, ...] = (),
    ) -> tuple[PointResult, ...]:
        """Make the recordings of a campaign; see `run_campaign`, which calls what is given here."""
        assert self._kept is not None
        facts = bench_facts(self.bench)

        def tell(progress: CampaignProgress) -> None:
            self.shown.tell(progress, facts)

        def ended(item: PointResult) -> None:
            self.shown.item(item)
            on_item(item)

        def happened(happening: CampaignEvent) -> None:
            if happening.event is CampaignEventKind.RESTING:
                self.shown.rests(orders.campaign.rest_s, happening.text)
            on_happening(happening)

        self.shown.begin(orders.campaign, orders.folder)
        try:
            make_folder(orders.folder)
            with stop_on_signal(self.switch):
                require_fresh(self.bench, orders.folder, orders.check, switch=self.switch)
            items = run_campaign(
                self.bench,
                orders.campaign,
                orders.folder,
                orders.existing,
                orders.after_failure,
                on_progress=tell,
                on_item=ended,
                switch=self.switch,
                reopen=self._kept.reopen,
                changed_bench=orders.changed_bench,
                on_happening=happened,
                messengers=messengers,
            )
        except CheckStopped as stopped:
            self._check_ended(stopped)
            return ()
        except AcquisitionError as error:
            self.shown.failed(str(error))
            self._fails(error, EngineState.READY)
            raise
        self.shown.messages.info(_told(items))
        self.shown.enter(EngineState.READY)
        return items

    def _check_ended(self, stopped: CheckStopped) -> None:
        """Show that somebody wanted the check to end; nothing is wrong."""
        self.shown.messages.info(str(stopped))
        self.shown.enter(EngineState.READY)

    def fault(self, error: Exception) -> None:
        """Show what nobody has foreseen, and let the bench go."""
        self._fails(error, EngineState.FAULT)

    def _fails(self, error: Exception, otherwise: EngineState) -> None:
        """Show what went wrong; a bench that has lost an instrument is closed."""
        self.shown.messages.fault(error)
        state = EngineState.FAULT if isinstance(error, InstrumentLost) else otherwise
        if state is EngineState.FAULT:
            self._release()
        self.shown.enter(state)

    def _release(self) -> None:
        kept, self._kept = self._kept, None
        lock, self._lock = self._lock, None
        try:
            if kept is not None:
                kept.close()
        except AcquisitionError as error:
            self.shown.messages.fault(error)
        finally:
            self.shown.bench(None)
            if lock is not None:
                lock.close()


def _told(items: tuple[PointResult, ...]) -> str:
    """Say in a line how a campaign came out."""
    counts = {result: sum(item.result is result for item in items) for result in PointOutcome}
    return "Campaign ended: " + ", ".join(f"{count} {each.value}" for each, count in counts.items() if count)
