"""`vibench demo`: the paper's experiment on the virtual rig, from the first volt to the report."""

import json
from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import load_campaign, shipped
from vibench.acquisition.campaign import PointOutcome, PointResult
from vibench.acquisition.engine import CampaignRequest
from vibench.acquisition.rig import load_rig
from vibench.analysis import DRAWS, FEWEST_DRAWS, campaign_summary
from vibench.sim.background import Progress
from vibench.sim.operating_system.this import replaced

from .analyse import complain_about
from .analyst import second_process
from .exit_code import ExitCode
from .measure import the_bench
from .options import option
from .output import bold, console, leave_output_to_json, print_json
from .paths import AsJson, unused
from .progress_bars import analysis_bar


def demo(
    out: Annotated[Path | None, option("New folder for everything; vibench_demo if absent.", "DIR")] = None,
    draws: Annotated[
        int, option("Runs of each test's simulation, from near starts.", "N", min=FEWEST_DRAWS)
    ] = DRAWS,
    as_json: AsJson = False,
) -> None:
    """Run the paper's experiment on the virtual rig: measure, analyse, simulate, and write a report."""
    from vibench.analysis.report import write_report

    if as_json:
        leave_output_to_json()
    folder = unused(Path("vibench_demo")) if out is None else out
    campaign = load_campaign(shipped("campaigns/paper.toml"))
    console.print("The experiment of Gong et al. (2025), section 5, on a virtual rig.")
    console.print()
    with second_process(campaign.name, draws) as analyst:

        def recorded(point_result: PointResult) -> None:
            if point_result.outcome is PointOutcome.RECORDED:
                analyst.take(point_result.path)

        rig = shipped("hardware_configs/virtual_rig.toml")
        with the_bench(load_rig(rig), "demo") as engine:
            point_results = engine.measure(
                CampaignRequest(campaign=campaign, folder=folder / "recordings"), recorded
            )
        if {
            point_result.name
            for point_result in point_results
            if point_result.outcome is PointOutcome.RECORDED
        } != set(campaign.recording_names()):
            raise typer.Exit(ExitCode.STOPPED)
        with analysis_bar(analyst.asked) as observer:
            for done, _ in enumerate(analyst.results(), start=1):
                observer(Progress(done, analyst.asked))
        results = analyst.together()
    report = write_report(results, folder / "report.html", folder / "figures")
    summary = campaign_summary(results)
    with replaced(folder / "results.json") as coming:
        coming.write_text(json.dumps(summary, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    console.print()
    console.print("The report:", bold(report.resolve()))
    if as_json:
        print_json({**summary, "report": str(report)})
    complain_about(results)
