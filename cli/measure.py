"""`vibench measure`: carry out a campaign, one recording a measurement."""

from pathlib import Path
from typing import Annotated

import typer

from acquisition.campaign.item import AfterFailure, CampaignItem, ChangedBench, Existing, Item
from acquisition.campaign.kept_bench import KeptBench
from acquisition.campaign.run_campaign import run_campaign
from acquisition.check.admission import CheckRule, require_fresh
from acquisition.plan.campaign import load_campaign
from acquisition.run.stop import StopSwitch

from .output import console
from .paths import BenchPath, FaultsPath, existing_folder, rig_at
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
    after_failure: Annotated[
        AfterFailure, typer.Option("--after-failure", help="When a point has failed for good.")
    ] = AfterFailure.STOP,
    accept_changed_bench: Annotated[
        bool, typer.Option("--accept-changed-bench", help="Resume on another bench than it was begun on.")
    ] = False,
    faults: FaultsPath = None,
    check: Annotated[
        CheckRule, typer.Option(help="A passed check of the bench, of today: ask for it, make it, or not.")
    ] = CheckRule.FRESH,
) -> None:
    """Measure: check the bench, ramp up, record and ramp down, for each measurement of a campaign."""
    plan = load_campaign(campaign)
    switch = StopSwitch()
    with KeptBench(rig_at(bench, faults)) as kept, campaign_bars(plan) as bars:
        require_fresh(kept.bench, existing_folder(out), check)
        items = run_campaign(
            kept.bench,
            plan,
            out,
            Existing.RESUME if resume else Existing.REFUSE,
            after_failure,
            on_progress=bars,
            on_item=bars.ended,
            switch=switch,
            reopen=kept.reopen,
            changed_bench=ChangedBench.ACCEPT if accept_changed_bench else ChangedBench.REFUSE,
        )
    tell(items)
    if switch.request is not None:
        raise typer.Exit(STOPPED_EXIT_CODE)
    if any(item.result is Item.FAILED for item in items):
        raise typer.Exit(1)


def tell(items: tuple[CampaignItem, ...]) -> None:
    """Say where each recording is and how it ended."""
    for item in items:
        console.print(f"{item.result.value:9} {item.path}  ({item.reason})")
