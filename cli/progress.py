"""Progress bars of a campaign: one for the measurement that runs, one for the whole."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from acquisition.plan.campaign import Campaign
from acquisition.run.run_campaign import CampaignProgress, Item

from .output import console


class CampaignBars:
    """Shows where a campaign stands; call it with each `CampaignProgress`."""

    def __init__(self, bars: Progress, whole: TaskID) -> None:
        self._bars = bars
        self._whole = whole
        self._one: TaskID | None = None
        self._name = ""
        self._total_s = 0.0
        self._done_s = 0.0

    def __call__(self, progress: CampaignProgress) -> None:
        """Draw what a block has changed."""
        run = progress.run
        if progress.name != self._name:
            self._begin(progress)
        if self._one is not None:
            state = run.state.value.replace("_", " ")
            self._bars.update(self._one, completed=run.elapsed_s, state=state)
        self._bars.update(self._whole, completed=self._done_s + run.elapsed_s)

    def _begin(self, progress: CampaignProgress) -> None:
        self.finish(Item.RECORDED)
        self._name = progress.name
        self._total_s = progress.run.total_s
        label = f"{progress.number}/{progress.count} {progress.name}"
        self._one = self._bars.add_task(label, total=self._total_s, state="")

    def finish(self, result: Item) -> None:
        """Draw how the measurement that ran last came out."""
        if self._one is not None:
            self._bars.update(self._one, completed=self._total_s, state=result.value)
            self._done_s += self._total_s


@contextmanager
def campaign_bars(campaign: Campaign) -> Iterator[CampaignBars]:
    """Show the bars of a campaign while inside."""
    columns = (
        TextColumn("{task.description:<24}"),
        BarColumn(bar_width=30),
        TextColumn("{task.completed:5.0f} of {task.total:.0f} s"),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[state]}"),
    )
    with Progress(*columns, console=console, speed_estimate_period=10) as bars:
        whole = bars.add_task(f"campaign {campaign.name}", total=campaign.duration_s, state="of rig time")
        yield CampaignBars(bars, whole)


@contextmanager
def analysis_bar(recordings: int) -> Iterator[Callable[[], None]]:
    """Show how many of the recordings are analysed; call what it gives after each."""
    columns = (TextColumn("{task.description:<24}"), BarColumn(bar_width=30), MofNCompleteColumn())
    with Progress(*columns, TimeElapsedColumn(), console=console) as bars:
        bar = bars.add_task("analysis and simulation", total=recordings)
        yield lambda: bars.advance(bar)
