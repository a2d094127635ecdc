"""`vibench measure`: carry out a campaign, one recording a measurement."""

from pathlib import Path
from typing import Annotated

import typer

from acquisition.bench import open_bench
from acquisition.plan.campaign import load_campaign
from acquisition.run.run_campaign import CampaignItem, Existing, Item, run_campaign

from .output import console
from .paths import BenchPath, bench_path
from .progress import campaign_bars

STOPPED_EXIT_CODE = 3
"""Not everything was recorded, and nothing failed: somebody stopped it."""


def measure(
    campaign: Annotated[Path, typer.Argument(metavar="CAMPAIGN.toml", help="What to measure.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the recordings.")],
    bench: BenchPath = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Keep complete recordings in DIR and make the missing ones.")
    ] = False,
) -> None:
    """Measure: check the bench, ramp up, record and ramp down, for each measurement of a campaign."""
    plan = load_campaign(campaign)
    existing = Existing.RESUME if resume else Existing.REFUSE
    with open_bench(bench_path(bench)) as opened, campaign_bars(plan) as bars:
        items = run_campaign(opened, plan, out, existing, on_progress=bars)
        bars.finish(items[-1].result)
    tell(items)
    if any(item.result is Item.STOPPED for item in items):
        raise typer.Exit(STOPPED_EXIT_CODE)


def tell(items: tuple[CampaignItem, ...]) -> None:
    """Say where each recording is and how it ended."""
    for item in items:
        console.print(f"{item.result.value:9} {item.path}  ({item.reason})")
