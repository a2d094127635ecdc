"""`vibench analyse`: a recording, or a folder of them, becomes figures, tables and a report."""

from pathlib import Path
from typing import Annotated

import typer

from analysis.campaign_results import CampaignResults, Simulation, analyse_files, recordings_in
from analysis.report.report import write_report
from analysis.summary import campaign_summary

from .output import console, print_json
from .paths import AsJson, unused


def analyse(
    recording: Annotated[
        Path, typer.Argument(metavar="RECORDING.h5", help="A recording, or a folder of recordings.")
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Folder for the report; beside the recording if absent."),
    ] = None,
    simulate: Annotated[
        bool, typer.Option(help="Lay the simulation over the measurement; takes some seconds more.")
    ] = True,
    as_json: AsJson = False,
) -> None:
    """Analyse recordings, complete, interrupted or still growing, and write one HTML report."""
    paths = recordings_in(recording) if recording.is_dir() else (recording,)
    name = recording.name.removesuffix(".part").removesuffix(".h5")
    results = analyse_files(paths, name, Simulation.LAID_OVER if simulate else Simulation.LEFT_OUT)
    if as_json:
        print_json(campaign_summary(results))
    if out is not None or not as_json:
        folder = unused(recording.parent / f"{name}_analysis") if out is None else out
        report = write_report(results, unused(folder / "report.html"), folder / "figures")
        if not as_json:
            console.print(f"The report: [bold]{report.resolve()}[/]")
    complain_about(results)


def complain_about(results: CampaignResults) -> None:
    """End with a sentence for each recording without a result."""
    for failure in results.failures:
        typer.echo(f"error: {failure.sentence}", err=True)
    if any(failure.what == "analysis" for failure in results.failures):
        raise typer.Exit(1)
