"""Progress and interruption of long commands: bars or lines on standard error, and Ctrl-C."""

import signal
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from threading import Event, Thread
from types import FrameType

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress as Bars,
    TaskProgressColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from vibench.sim.background import Observer, Progress

from .output import console, errors, words

LINE_INTERVAL_S = 10.0
"""Interval between progress lines if there is no terminal [s]."""


@contextmanager
def show_bars(bars: Bars, interval_s: float = LINE_INTERVAL_S) -> Iterator[Bars]:
    """Draw progress bars on a terminal; if there is no terminal, print lines."""
    if bars.console.is_terminal:
        with bars:
            yield bars
        return
    ending = Event()

    def print_lines() -> None:
        while not ending.wait(interval_s):
            if tasks := bars.tasks:
                bars.console.print(f"progress: {progress_line(bars)}, after {tasks[0].elapsed or 0:.0f} s")

    thread = Thread(target=print_lines, name="progress lines", daemon=True)
    thread.start()
    try:
        yield bars
    finally:
        ending.set()


def progress_line(bars: Bars) -> str:
    """Return the state of all bars as one line of text."""
    return "; ".join(
        each.description
        if each.total is None
        else f"{each.description} {each.completed:.0f} of {each.total:.0f} ({each.percentage:.0f} %)"
        for each in bars.tasks
    )


SECONDS_OF_A_MINUTE = 60.0
MINUTES_OF_AN_HOUR = 60.0


@contextmanager
def _bar(bars: Bars, what: str, total: int | None) -> Iterator[Observer]:
    """Show one progress bar; yield the function that updates it."""
    with show_bars(bars):
        bar = bars.add_task(what, total=total, left="")

        def draw(progress: Progress) -> None:
            if not progress.of:
                bars.tasks[0].total = None  # reset does not remove the total of the previous stage
                bars.reset(bar, description=progress.note)
                return
            left = "" if progress.remaining_s is None else f"{_duration(progress.remaining_s)} left"
            left += f", {progress.note}" if progress.note else ""
            bars.update(bar, total=progress.of, completed=progress.done, left=left)

        yield draw


def analysis_bar(recordings: int) -> AbstractContextManager[Observer]:
    """Show the number of analysed recordings."""
    columns = (words("{task.description:<24}"), BarColumn(bar_width=30), MofNCompleteColumn())
    return _bar(Bars(*columns, TimeElapsedColumn(), console=console), "analysis and simulation", recordings)


def study_bar(points: int) -> AbstractContextManager[Observer]:
    """Show the number of finished points of a study or map."""
    left = words("{task.fields[left]}")
    columns = (words("points"), BarColumn(bar_width=30), MofNCompleteColumn(), TimeElapsedColumn(), left)
    return _bar(Bars(*columns, console=errors), "points", points)


def reading_bar() -> AbstractContextManager[Observer]:
    """Show stage and progress of an analysis; the bar disappears when the analysis ends."""
    columns = (words("{task.description}"), BarColumn(bar_width=30), TaskProgressColumn())
    return _bar(Bars(*columns, TimeElapsedColumn(), console=errors, transient=True), "opening", None)


def _duration(seconds: float) -> str:
    minutes = seconds / SECONDS_OF_A_MINUTE
    if minutes < 1.0:
        return f"{seconds:.0f} s"
    if minutes < MINUTES_OF_AN_HOUR:
        return f"{minutes:.0f} min"
    return f"{minutes / MINUTES_OF_AN_HOUR:.1f} h"


@contextmanager
def transfer_bar(what: str, values: int) -> Iterator[Callable[[int], None]]:
    """Show a progress bar; yield the function that advances the bar by a number of values."""
    columns = (words("{task.description}"), BarColumn(bar_width=30), TaskProgressColumn())
    with show_bars(Bars(*columns, TimeRemainingColumn(), console=errors)) as bars:
        bar = bars.add_task(what, total=values)
        yield lambda done: bars.advance(bar, done)


@contextmanager
def watch_interrupt() -> Iterator[Callable[[], bool]]:
    """Yield a function that returns whether Ctrl-C was pressed since this context was entered."""
    before = signal.getsignal(signal.SIGINT)
    pressed: list[int] = []

    def note(number: int, _frame: FrameType | None) -> None:
        pressed.append(number)
        signal.signal(signal.SIGINT, before)

    signal.signal(signal.SIGINT, note)
    try:
        yield lambda: bool(pressed)
    finally:
        signal.signal(signal.SIGINT, before)
