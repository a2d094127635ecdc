"""`vibench demo`: the paper's experiment on the virtual rig, from the first volt to the report."""

from pathlib import Path
from typing import Annotated

import typer

from acquisition.bench import open_bench
from acquisition.campaign.item import CampaignItem, Item
from acquisition.campaign.run_campaign import run_campaign
from acquisition.check.admission import require_fresh
from acquisition.plan.campaign import load_campaign
from acquisition.shipped import shipped
from analysis.report.report import write_report
from analysis.summary import campaign_summary

from .analyst import second_process
from .measure import STOPPED_EXIT_CODE, tell
from .output import console, write_json
from .paths import existing_folder, unused
from .progress import analysis_bar, campaign_bars


def demo(
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="New folder for everything; vibench_demo if absent."),
    ] = None,
) -> None:
    """Run the paper's experiment on the virtual rig: measure, analyse, simulate, and write a report."""
    folder = unused(Path("vibench_demo")) if out is None else out
    campaign = load_campaign(shipped("campaigns/paper.toml"))
    console.print(
        "The experiment of Gong et al. (2025), section 5, on a virtual rig. The first time, the simulation\n"
        "is compiled: it starts slowly and then runs many times faster than real time.\n"
    )
    with second_process(campaign.name) as analyst:

        def recorded(item: CampaignItem) -> None:
            bars.ended(item)
            if item.result is Item.RECORDED:
                analyst.take(item.path)

        rig = shipped("hardware_configs/virtual_rig.toml")
        with open_bench(rig) as bench, campaign_bars(campaign) as bars:
            require_fresh(bench, existing_folder(folder))
            items = run_campaign(bench, campaign, folder / "recordings", on_progress=bars, on_item=recorded)
        tell(items)
        if {item.name for item in items if item.result is Item.RECORDED} != set(campaign.recording_names()):
            raise typer.Exit(STOPPED_EXIT_CODE)
        with analysis_bar(analyst.asked) as step:
            for _ in analyst.results():
                step()
        results = analyst.together()
    report = write_report(results, folder / "report.html", folder / "figures")
    write_json(campaign_summary(results), folder / "results.json")
    console.print(f"\nThe report: [bold]{report.resolve()}[/]")
