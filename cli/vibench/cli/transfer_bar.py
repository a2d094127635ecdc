"""Progress bar of an export or an import, on standard error like a study's."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn


@contextmanager
def transfer_bar(what: str, values: int) -> Iterator[Callable[[int], None]]:
    """Show the bar while inside; what it gives is told how many values came since the last call."""
    columns = (TextColumn("{task.description}"), BarColumn(bar_width=30), TaskProgressColumn())
    with Progress(*columns, TimeRemainingColumn(), console=Console(stderr=True)) as bars:
        bar = bars.add_task(what, total=values)
        yield lambda done: bars.advance(bar, done)
