"""`vibench demo`: the paper's experiment on the virtual rig, from measurement to report."""

import json
import shlex
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import load_campaign, shipped
from vibench.acquisition.campaign import PointOutcome, PointResult
from vibench.acquisition.engine import CampaignRequest
from vibench.acquisition.rig import load_rig
from vibench.analysis import (
    FEWEST_DRAWS,
    MOST_DRAWS,
    AnalysisError,
    CampaignResults,
    analyse_files,
    campaign_summary,
    merge_results,
)
from vibench.sim.background import Pool, Progress
from vibench.sim.operating_system.this import replace_file

from .analyse import complain_about
from .measure import the_bench
from .options import option
from .output import ExitCode, bold, console, leave_output_to_json, print_json
from .paths import AsJson, free_path
from .progress_bars import analysis_bar

LOOK_S = 1.0
DRAWS = 8
"""Number of simulation runs per test: half of the default of `vibench analyse`, to save time."""
PROCESSES = 2
"""Number of analysis processes; the largest process needed 0.7 GB."""


class Analyst:
    """Analyser of recordings in other processes; it returns results in the order of submission."""

    def __init__(self, pool: Pool, name: str, draws: int) -> None:
        self._pool = pool
        self._draws = draws
        self._name = name
        self._folder = Path()
        self._parts: dict[int, CampaignResults | BaseException] = {}
        self.submitted = 0

    def take(self, recording: Path) -> None:
        """Submit a recording for analysis."""
        take = partial(self._parts.__setitem__, self.submitted)
        self.submitted += 1
        self._folder = recording.parent
        self._pool.ask(analyse_files, take, take, [recording], self._name, draws=self._draws)
        self._pool.poll()

    def results(self) -> Iterator[CampaignResults]:
        """Yield the results in order, waiting for each; raise AnalysisError if a process died."""
        for number in range(self.submitted):
            while number not in self._parts:
                self._pool.poll(LOOK_S)
            match self._parts[number]:
                case ChildProcessError() as error:
                    raise AnalysisError(
                        "the analysis process has ended (killed, or out of memory); every recording is kept. "
                        f"Analyse the recordings with: vibench analyse {shlex.quote(str(self._folder))}"
                    ) from error
                case BaseException() as error:
                    raise error
                case results:
                    yield results


@contextmanager
def analysis_processes(name: str, draws: int) -> Iterator[Analyst]:
    """Yield an analyser in new processes; after an error, drop the unfinished analyses."""
    pool = Pool(PROCESSES)
    try:
        yield Analyst(pool, name, draws)
    finally:
        pool.close()


def demo(
    out: Annotated[Path | None, option("New folder for all results; default vibench_demo.", "DIR")] = None,
    draws: Annotated[
        int,
        option("Simulation runs per test.", "N", min=FEWEST_DRAWS, max=MOST_DRAWS),
    ] = DRAWS,
    as_json: AsJson = False,
) -> None:
    """Run the paper's experiment on the virtual rig: measure, analyse, simulate, and write a report."""
    from vibench.analysis.report import write_report

    if as_json:
        leave_output_to_json()
    folder = free_path(Path("vibench_demo")) if out is None else out
    campaign = load_campaign(shipped("campaigns/demo.toml"))
    console.print("The experiment of Gong et al. (2025), section 5, on a virtual rig.")
    console.print()
    with analysis_processes(campaign.name, draws) as analyst:

        def take_recording(point_result: PointResult) -> None:
            if point_result.outcome is PointOutcome.RECORDED:
                analyst.take(point_result.path)

        rig = shipped("hardware_configs/virtual_rig.toml")
        with the_bench(load_rig(rig), "demo") as engine:
            point_results = engine.measure(
                CampaignRequest(campaign=campaign, folder=folder / "recordings"), take_recording
            )
        recorded = {each.name for each in point_results if each.outcome is PointOutcome.RECORDED}
        if recorded != set(campaign.recording_names()):
            raise typer.Exit(ExitCode.STOPPED)
        with analysis_bar(analyst.submitted) as observer:
            parts = []
            for part in analyst.results():
                parts.append(part)
                observer(Progress(len(parts), analyst.submitted))
    results = merge_results(campaign.name, tuple(parts))
    report = write_report(results, folder / "report.html", folder / "figures")
    summary = campaign_summary(results)
    with replace_file(folder / "results.json") as coming:
        coming.write_text(json.dumps(summary, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    console.print()
    console.print("The report:", bold(report.resolve()))
    if as_json:
        print_json({**summary, "report": str(report)})
    complain_about(results)
