"""Progress bars of a campaign: one for the measurement that runs, one for the whole."""

from collections import deque
from collections.abc import Callable, Iterator, Mapping
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

from acquisition.campaign.item import CampaignItem, CampaignProgress
from acquisition.plan.campaign import Campaign
from acquisition.run.schedule import measured_s

from .output import console

MOST_BARS = 6
"""Of measurements, the newest: a campaign of hundreds must not fill the terminal."""


class CampaignBars:
    """Shows where a campaign stands; call it with each `CampaignProgress`, and `ended` with each item."""

    def __init__(self, bars: Progress, whole: TaskID, durations_s: Mapping[str, float]) -> None:
        self._bars = bars
        self._whole = whole
        self._durations_s = durations_s
        self._shown: deque[TaskID] = deque()
        self._name = ""
        self._done_s = 0.0

    def __call__(self, progress: CampaignProgress) -> None:
        """Draw what a block has changed."""
        run = progress.run
        if progress.name != self._name:
            self._begin(progress)
        state = run.state.value.replace("_", " ")
        self._bars.update(self._shown[-1], completed=run.elapsed_s, total=run.total_s, state=state)
        self._bars.update(self._whole, completed=self._done_s + run.elapsed_s)

    def ended(self, item: CampaignItem) -> None:
        """Draw how a measurement came out."""
        if item.name == self._name:
            self._bars.update(self._shown[-1], state=item.result.value)
            self._name = ""
        self._done_s += self._durations_s.get(item.name, 0.0)
        self._bars.update(self._whole, completed=self._done_s)

    def _begin(self, progress: CampaignProgress) -> None:
        self._name = progress.name
        label = f"{progress.number}/{progress.count} {progress.name}"
        self._shown.append(self._bars.add_task(label, total=progress.run.total_s, state=""))
        if len(self._shown) > MOST_BARS:
            self._bars.remove_task(self._shown.popleft())


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
    durations_s = {name: measured_s(each) for name, each in campaign.recordings()}
    with Progress(*columns, console=console, speed_estimate_period=10) as bars:
        total_s = sum(durations_s.values())
        whole = bars.add_task(f"campaign {campaign.name}", total=total_s, state="of rig time")
        yield CampaignBars(bars, whole, durations_s)


@contextmanager
def analysis_bar(recordings: int) -> Iterator[Callable[[], None]]:
    """Show how many of the recordings are analysed; call what it gives after each."""
    columns = (TextColumn("{task.description:<24}"), BarColumn(bar_width=30), MofNCompleteColumn())
    with Progress(*columns, TimeElapsedColumn(), console=console) as bars:
        bar = bars.add_task("analysis and simulation", total=recordings)
        yield lambda: bars.advance(bar)
