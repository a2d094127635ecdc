"""The engine: it owns a bench and does what it is asked, one job after the other, in one thread."""

from collections.abc import Callable
from pathlib import Path
from queue import SimpleQueue

from ..bench import Bench, open_bench
from ..campaign.item import AfterFailure, CampaignItem, CampaignProgress, Existing, Item
from ..campaign.run_campaign import run_campaign
from ..check.admission import check_and_keep
from ..errors import AcquisitionError, InstrumentLost
from ..plan.campaign import Campaign
from ..rig.configuration import Rig
from ..rig.knobs import KnobSheet
from ..run.stop import Cause, StopSwitch
from .facts import bench_facts
from .lock import BenchLock
from .sheet import confirmed_by
from .shown import Shown
from .state import Attendance, EngineState

Job = Callable[[], None]
ENDING_CAUSES = frozenset({Cause.TERMINATED, Cause.KEYBOARD, Cause.PARENT_GONE})
"""After a campaign that one of these has stopped, the process ends too."""


class Engine:
    """Does jobs with a bench. Only the thread that calls `run` touches an instrument.

    What others ask reaches it through a `Desk`, which puts jobs into its queue and presses its switch.
    """

    def __init__(self, attendance: Attendance) -> None:
        self.shown = Shown(attendance)
        self.attendance = attendance
        self.switch = StopSwitch()
        """Holds or ends what runs; a new one for every campaign."""
        self._jobs: SimpleQueue[Job | None] = SimpleQueue()
        self._bench: Bench | None = None
        self._lock: BenchLock | None = None

    @property
    def bench(self) -> Bench:
        """The open bench, for looking at its rig; only in a state in which there is one."""
        assert self._bench is not None, f"no bench is open while {self.shown.state}"
        return self._bench

    def put(self, job: Job) -> None:
        """Do this after everything asked before; from any thread."""
        self._jobs.put(job)

    def leave(self) -> None:
        """End after everything asked before; from any thread, and from a signal handler."""
        self._jobs.put(None)

    def run(self) -> None:
        """Do jobs until told to leave. The bench is closed then, whatever happened."""
        try:
            while (job := self._jobs.get()) is not None:
                self._done(job)
        finally:
            self._release()

    def _done(self, job: Job) -> None:
        try:
            job()
        except Exception as error:  # noqa: BLE001 - whatever it is: silence, and an engine that can tell of it
            self.shown.messages.fault(error)
            self._release()
            self.shown.enter(EngineState.FAULT)

    def open(self, rig: Rig, confirmations: KnobSheet | None) -> None:
        """Job: open the bench of a rig."""
        try:
            self._lock = BenchLock.of(rig)
            confirm = None if rig.virtual is not None else confirmed_by(confirmations)
            self._bench = open_bench(rig, confirm=confirm)
        except AcquisitionError as error:
            self._release()
            self.shown.messages.fault(error)
            self.shown.enter(EngineState.FAULT)
            return
        self.shown.bench(bench_facts(self._bench))
        self.shown.messages.info(f"{rig.name} is open")
        self.shown.enter(EngineState.READY)

    def close(self) -> None:
        """Job: close the bench, silent first."""
        self._release()
        self.shown.enter(EngineState.CLOSED)

    def check(self, folder: Path) -> None:
        """Job: check the bench with a small sine."""
        try:
            result = check_and_keep(self.bench, folder)
        except AcquisitionError as error:
            self._failed(error)
            return
        self.shown.checked(result.report, result.checked.isoformat(timespec="seconds"))
        self.shown.enter(EngineState.READY)

    def carry_out(self, campaign: Campaign, folder: Path, existing: Existing) -> None:
        """Job: make the recordings of a campaign."""
        facts = bench_facts(self.bench)

        def tell(progress: CampaignProgress) -> None:
            self.shown.tell(progress, facts)

        try:
            items = run_campaign(
                self.bench,
                campaign,
                folder,
                existing,
                AfterFailure.STOP,
                on_progress=tell,
                on_item=self.shown.item,
                switch=self.switch,
            )
        except AcquisitionError as error:
            self.shown.failed(str(error))
            self._failed(error)
        else:
            self.shown.messages.info(_told(items))
            self.shown.enter(EngineState.READY)
        request = self.switch.request
        if request is not None and request.cause in ENDING_CAUSES:
            self.leave()

    def _failed(self, error: AcquisitionError) -> None:
        """Say what went wrong; a bench that has lost an instrument is closed, any other stays open."""
        self.shown.messages.fault(error)
        if isinstance(error, InstrumentLost):
            self._release()
            self.shown.enter(EngineState.FAULT)
        else:
            self.shown.enter(EngineState.READY)

    def _release(self) -> None:
        bench, self._bench = self._bench, None
        lock, self._lock = self._lock, None
        try:
            if bench is not None:
                bench.close()
        except AcquisitionError as error:
            self.shown.messages.fault(error)
        finally:
            self.shown.bench(None)
            if lock is not None:
                lock.release()


def _told(items: tuple[CampaignItem, ...]) -> str:
    """Say in a line how a campaign came out."""
    counts = {result: sum(item.result is result for item in items) for result in Item}
    return "Campaign ended: " + ", ".join(f"{count} {each.value}" for each, count in counts.items() if count)
