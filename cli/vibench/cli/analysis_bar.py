"""The progress bar of an analysis: one step a recording."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from .output import console


@contextmanager
def analysis_bar(recordings: int) -> Iterator[Callable[[], None]]:
    """Show how many of the recordings are analysed; call what it gives after each."""
    columns = (TextColumn("{task.description:<24}"), BarColumn(bar_width=30), MofNCompleteColumn())
    with Progress(*columns, TimeElapsedColumn(), console=console) as bars:
        bar = bars.add_task("analysis and simulation", total=recordings)
        yield lambda: bars.advance(bar)
