"""`vibench study`: predict every combination of the values in a TOML file, into one HDF5 file."""

import hashlib
from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import file_path, load_toml
from vibench.sim.study import (
    ExistingStudy,
    Study,
    StudyResults,
    planned_work_s,
    plausibility_warnings,
    solve_study,
)

from .interruption import watch_interrupt
from .options import option
from .output import ExitCode, console, errors, print_json, print_warnings
from .paths import AllowExternal, AsJson, require_suffix
from .points import Cluster, Workers, complain_about_points, print_failures
from .progress_bars import study_bar


def study(
    plan: Annotated[
        Path, typer.Argument(metavar="STUDY", help="TOML file of the study, or a shipped name: paper.")
    ],
    out: Annotated[Path, option("File for the results.", "FILE.h5")],
    resume: Annotated[bool, option("Compute the points missing in FILE.h5.")] = False,
    workers: Workers = None,
    cluster: Cluster = None,
    only_estimate: Annotated[
        bool, option("Print number of points and estimated work without computing.", name="--estimate")
    ] = False,
    _allow_external: AllowExternal = False,
    as_json: AsJson = False,
) -> None:
    """Predict every combination of the values in a file, starting with the longest runs."""
    require_suffix(out, ".h5")
    request = load_toml(file_path(plan, "studies"), Study)
    print_warnings(
        plausibility_warnings(request.amplitudes_m, request.gaps_m or request.specimen.specimen().gaps_m)
    )
    if only_estimate:
        points, work_s = request.grid.size, planned_work_s(request)
        if as_json:
            print_json({"points": points, "work_s": work_s})
        else:
            console.print(f"{points} points, estimated work {work_s:.2g} s on one core")
        return
    existing = ExistingStudy.RESUME if resume else ExistingStudy.REFUSE
    with watch_interrupt() as is_stopped, study_bar(request.grid.size) as observer:
        results = solve_study(request, out, existing, workers, cluster, observer, is_stopped)
    if as_json:
        print_json(document(results, out))
    else:
        failed = sum(1 for _ in results.failures())
        state = "complete" if results.is_complete else "stopped: continue with --resume"
        console.print(f"{out}: {results.done} of {results.study.grid.size} points, {failed} failed ({state})")
        if results.study.error is not None:
            console.print(results.target_text(results.study.error))
    complain_about_points(request, list(results.failures()), results.done)


def document(results: StudyResults, out: Path) -> dict[str, object]:
    """Return a summary of a study's results as a JSON document; the HDF5 file contains the values."""
    return {
        "file": str(out),
        "points": results.study.grid.size,
        "kept": results.done,
        "is_complete": results.is_complete,
        "sessions": len(results.sessions),
        "failures": [{**where, "message": why} for where, why in results.failures()],
        "study": results.study.model_dump(mode="json"),
    }


_DIGEST = 16


class KeptStudies:
    """Solver that stores each study's results in a folder, in a file named by a hash of the study."""

    def __init__(self, folder: Path, workers: int | None) -> None:
        self._folder = folder
        self._workers = workers
        self._failed = 0

    def __call__(self, study: Study) -> StudyResults:
        """Solve the points that are missing in a study's file; return the results of all points."""
        self._folder.mkdir(parents=True, exist_ok=True)
        digest = hashlib.sha256(study.model_dump_json().encode()).hexdigest()[:_DIGEST]
        with watch_interrupt() as is_stopped, study_bar(study.grid.size) as observer:
            results = solve_study(
                study,
                self._folder / f"{digest}.h5",
                ExistingStudy.RESUME,
                self._workers,
                observer=observer,
                cancelled=is_stopped,
            )
        self._failed += print_failures(study, list(results.failures()))
        if not results.is_complete:
            errors.print(
                f"stopped after {results.done} of {study.grid.size} points; repeat the command to continue"
            )
            raise typer.Exit(ExitCode.STOPPED)
        return results

    def complain(self) -> None:
        """Exit with an error code if a point of any study has failed; all other points are stored."""
        if self._failed > 0:
            raise typer.Exit(ExitCode.FAILED)
