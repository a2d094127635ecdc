"""Progress bars that show the engine's status: one for the recording, one for the campaign."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TimeElapsedColumn, TimeRemainingColumn

from vibench.acquisition.engine import (
    DRIVING,
    Engine,
    EngineMessage,
    EngineStatus,
    MessageKind,
    RowStatus,
    RunStatus,
)

from .output import console, errors, words
from .progress_bars import show_bars

INTERVAL_S = 0.1
COLUMNS = (
    words("{task.description:<24}"),
    BarColumn(bar_width=30),
    words("{task.completed:6.0f} of {task.total:.0f} s"),
    TimeElapsedColumn(),
    TimeRemainingColumn(),
    words("{task.fields[state]}"),
)


class EngineBars:
    """Display of the engine's status: bars for recording and campaign, lines for results and messages."""

    def __init__(self, bars: Progress) -> None:
        self._bars = bars
        self._whole: TaskID | None = None
        self._one: TaskID | None = None
        self._name = ""
        self._reported_names: set[str] = set()
        self._messages = 0

    def draw(self, status: EngineStatus) -> None:
        """Draw the changes since the last status."""
        for row in status.rows:
            self._row(row)
        for message in status.messages:
            if message.number > self._messages:
                self._messages = message.number
                if message.kind is MessageKind.WARNING:
                    self._bars.console.print(sentence(message))
        if status.run is not None and status.state in DRIVING:
            self._run(status, status.run)

    def _run(self, status: EngineStatus, run: RunStatus) -> None:
        if self._whole is None:
            self._whole = self._bars.add_task("campaign", total=run.campaign_total_s, state="of rig time")
        if run.name != self._name:
            self._drop()
            self._name = run.name
            label = f"{run.number}/{run.count} {run.name}"
            self._one = self._bars.add_task(label, total=run.total_s, state="")
        self._bars.update(self._whole, completed=run.campaign_elapsed_s, total=run.campaign_total_s)
        if self._one is not None:
            state = status.state if status.state != "running" else run.run_state
            text = state.value.replace("_", " ") + ("" if run.until is None else f"; {run.until.sentence}")
            self._bars.update(self._one, completed=run.elapsed_s, total=run.total_s, state=text)

    def _row(self, row: RowStatus) -> None:
        if row.state in {"queued", "running"} or row.name in self._reported_names:
            return
        self._reported_names.add(row.name)
        if row.name == self._name:
            self._drop()
        self._bars.console.print(f"{row.state:11} {row.file or row.name}  ({row.reason})")

    def _drop(self) -> None:
        if self._one is not None:
            self._bars.remove_task(self._one)
            self._one = None


def sentence(message: EngineMessage) -> str:
    """Return a message as one line: what happened, what was done and what to do next."""
    text = " ".join(part for part in (message.what, message.done, message.next_step) if part)
    return f"{message.kind.value:11} {text}"


@contextmanager
def engine_bars(on: Console = console) -> Iterator[EngineBars]:
    """Draw the bars of an engine's status in this context."""
    with show_bars(Progress(*COLUMNS, console=on, speed_estimate_period=10)) as bars:
        yield EngineBars(bars)


@contextmanager
def show_status(ask: Callable[[], EngineStatus], engine: Engine) -> Iterator[None]:
    """Display the newest status in a separate thread; only this thread waits if the terminal is blocked.

    After a stop, print on standard error who stopped the engine, and whether its output is off.
    """
    ending = Event()

    def draw() -> None:
        with engine_bars() as bars:
            while not ending.wait(INTERVAL_S):
                bars.draw(ask())
            bars.draw(ask())
        if stopped := engine.stop_sentence:
            errors.print(f"stopped: {stopped}")

    thread = Thread(target=draw, name="progress", daemon=True)
    thread.start()
    try:
        yield
    finally:
        ending.set()
        # Wait no longer than this: the command must end even if the terminal is blocked.
        thread.join(timeout=2.0)
