"""Progress bars on standard error; without a terminal, a line every ten seconds."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskProgressColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from vibench.sim.study import StudyObserver, StudyProgress

from .output import console, errors, words

LINE_INTERVAL_S = 10.0
"""Time between two lines of progress where there is no terminal to draw bars on [s]."""


@contextmanager
def shown(bars: Progress, interval_s: float = LINE_INTERVAL_S) -> Iterator[Progress]:
    """Draw progress bars on a terminal; print a line of them every few seconds into anything else."""
    if bars.console.is_terminal:
        with bars:
            yield bars
        return
    ending = Event()

    def print_lines() -> None:
        while not ending.wait(interval_s):
            bars.console.print("progress:", progress_line(bars))

    thread = Thread(target=print_lines, name="progress lines", daemon=True)
    thread.start()
    try:
        yield bars
    finally:
        ending.set()


def progress_line(bars: Progress) -> str:
    """Put all bars into one line of text."""
    return "; ".join(
        each.description
        if each.total is None
        else f"{each.description} {each.completed:.0f} of {each.total:.0f} ({each.percentage:.0f} %)"
        for each in bars.tasks
    )


@contextmanager
def analysis_bar(recordings: int) -> Iterator[Callable[[], None]]:
    """Show how many of the recordings are analysed; call what it gives after each."""
    columns = (words("{task.description:<24}"), BarColumn(bar_width=30), MofNCompleteColumn())
    with shown(Progress(*columns, TimeElapsedColumn(), console=console)) as bars:
        bar = bars.add_task("analysis and simulation", total=recordings)
        yield lambda: bars.advance(bar)


SECONDS_OF_A_MINUTE = 60.0
MINUTES_OF_AN_HOUR = 60.0


@contextmanager
def study_bar(points: int) -> Iterator[StudyObserver]:
    """Show the bar while inside; what it gives is told how far the study is."""
    columns = (
        words("points"),
        BarColumn(bar_width=30),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        words("{task.fields[left]}"),
    )
    with shown(Progress(*columns, console=errors)) as bars:
        bar = bars.add_task("points", total=points, left="")

        def watch(progress: StudyProgress) -> None:
            bars.update(bar, total=progress.points, completed=progress.kept, left=_left(progress))

        yield watch


def _left(progress: StudyProgress) -> str:
    failed = f", {progress.failed} failed" if progress.failed else ""
    return ("" if progress.left_s is None else f"{_duration(progress.left_s)} left") + failed


def _duration(seconds: float) -> str:
    minutes = seconds / SECONDS_OF_A_MINUTE
    if minutes < 1.0:
        return f"{seconds:.0f} s"
    if minutes < MINUTES_OF_AN_HOUR:
        return f"{minutes:.0f} min"
    return f"{minutes / MINUTES_OF_AN_HOUR:.1f} h"


@contextmanager
def transfer_bar(what: str, values: int) -> Iterator[Callable[[int], None]]:
    """Show the bar while inside; what it gives is told how many values came since the last call."""
    columns = (words("{task.description}"), BarColumn(bar_width=30), TaskProgressColumn())
    with shown(Progress(*columns, TimeRemainingColumn(), console=errors)) as bars:
        bar = bars.add_task(what, total=values)
        yield lambda done: bars.advance(bar, done)
