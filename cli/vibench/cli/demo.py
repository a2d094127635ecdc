"""`vibench demo`: the paper's experiment on the virtual rig, from measurement to report."""

import json
import shlex
from collections.abc import Iterator
from contextlib import closing
from functools import partial
from importlib import import_module
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
from vibench.sim.operating_system.this import replace_file, use_one_heap

from .analyse import complain_about
from .measure import the_bench
from .options import option
from .output import ExitCode, bold, console, print_json
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
        self._pool, self._name, self._draws = pool, name, draws
        self._folder = Path()
        self._parts: dict[int, CampaignResults | BaseException] = {}
        self.submitted = 0
        for _ in range(PROCESSES):  # import scipy, which takes seconds, before the first recording
            pool.ask(import_module, lambda _: None, lambda _: None, "scipy.signal")

    def take(self, recording: Path) -> None:
        """Submit a recording for analysis."""
        take = partial(self._parts.__setitem__, self.submitted)
        self.submitted += 1
        self._folder = recording.parent
        self._pool.ask(analyse_files, take, take, [recording], self._name, draws=self._draws)
        self._pool.poll()

    def results(self) -> Iterator[CampaignResults]:
        """Wait for each result and yield the results in order; raise AnalysisError if a process died."""
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


def demo(
    out: Annotated[Path | None, option("New folder for all results; default vibench_demo.", "DIR")] = None,
    draws: Annotated[
        int,
        option("Simulation runs per test.", "N", min=FEWEST_DRAWS, max=MOST_DRAWS),
    ] = DRAWS,
    as_json: AsJson = False,
) -> None:
    """Run the paper's experiment on the virtual rig: measure, analyse, simulate, and write a report."""
    folder = free_path(Path("vibench_demo")) if out is None else out
    use_one_heap()
    campaign = load_campaign(shipped("campaigns/demo.toml"))
    console.print("The experiment of Gong et al. (2025), section 5, on a virtual rig.")
    console.print()
    with closing(Pool(PROCESSES)) as pool:
        analyst = Analyst(pool, campaign.name, draws)

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
            # Importing takes a second, and drawing ten, while other recordings are analysed.
            from vibench.analysis.report import draw_cards, write_report

            parts, drawn = [], {}
            for part in analyst.results():
                parts.append(part)
                drawn.update(draw_cards(part))
                observer(Progress(len(parts), analyst.submitted))
    results = merge_results(campaign.name, tuple(parts))
    report = write_report(results, folder / "report.html", folder / "figures", drawn=drawn)
    summary = campaign_summary(results)
    with replace_file(folder / "results.json") as coming:
        coming.write_text(json.dumps(summary, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    console.print()
    console.print("The report:", bold(report.resolve()))
    if as_json:
        print_json({**summary, "report": str(report)})
    complain_about(results)
