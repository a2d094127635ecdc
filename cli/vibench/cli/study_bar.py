"""Progress bar of a study, on standard error, so that standard output stays what was asked for."""

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from vibench.sim.study import StudyProgress, Watcher

SECONDS_OF_A_MINUTE = 60.0
MINUTES_OF_AN_HOUR = 60.0


@contextmanager
def study_bar(points: int) -> Iterator[Watcher]:
    """Show the bar while inside; what it gives is told how far the study is."""
    columns = (
        TextColumn("points"),
        BarColumn(bar_width=30),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.fields[left]}"),
    )
    with Progress(*columns, console=Console(stderr=True)) as bars:
        bar = bars.add_task("points", total=points, left="")

        def watch(progress: StudyProgress) -> None:
            bars.update(bar, completed=progress.kept, left=_left(progress))

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
