"""Progress bar of an analysis, on standard error, so that standard output stays what was asked for."""

from collections.abc import Iterator
from contextlib import contextmanager

from rich.progress import BarColumn, Progress, TaskID, TaskProgressColumn, TimeElapsedColumn

from vibench.analysis import ProgressObserver

from .output import errors, words
from .progress_bars import shown


class ReadingBar:
    """Shows which recording is looked at, what is computed, and how much of it was read."""

    def __init__(self, bars: Progress, bar: TaskID) -> None:
        self._bars = bars
        self._bar = bar

    def begin(self, recording: str, stage: str) -> None:
        """Begin a stage; until samples are read nobody knows how long it will take."""
        self._bars.reset(self._bar, total=None, description=f"{recording}: {stage}")

    def read(self, samples: int, of: int) -> None:
        """Draw how far it is."""
        self._bars.update(self._bar, completed=samples, total=of)


@contextmanager
def reading_bar() -> Iterator[ProgressObserver]:
    """Show the bar while inside; on a terminal it leaves nothing behind."""
    columns = (
        words("{task.description}"),
        BarColumn(bar_width=30),
        TaskProgressColumn(),
        TimeElapsedColumn(),
    )
    with shown(Progress(*columns, console=errors, transient=True)) as bars:
        yield ReadingBar(bars, bars.add_task("opening", total=None))
