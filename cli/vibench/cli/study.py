"""`vibench study`: every combination of what a TOML file lists, predicted into one HDF5 file."""

import hashlib
from pathlib import Path
from typing import Annotated

import typer

from vibench.acquisition import load_toml
from vibench.sim.study import ExistingStudy, Study, StudyResults, plausibility_warnings, solve_study

from .interruption import told_to_stop
from .output import console, print_json, print_warnings
from .paths import AsJson
from .progress_bars import study_bar

STOPPED_EXIT_CODE = 3
"""Not everything was computed, and nothing failed: somebody stopped it."""
SHOWN_FAILURES = 5

Workers = Annotated[
    int | None, typer.Option("--workers", metavar="N", help="Threads; one for each processor if absent.")
]
Cluster = Annotated[
    str | None,
    typer.Option("--cluster", metavar="ADDRESS", help="Let the workers of this Dask scheduler compute."),
]


def study(
    plan: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="What to predict.")],
    out: Annotated[Path, typer.Option("--out", metavar="FILE.h5", help="File for the answers.")],
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with what FILE.h5 does not hold yet.")
    ] = False,
    workers: Workers = None,
    cluster: Cluster = None,
    as_json: AsJson = False,
) -> None:
    """Predict responses over every combination of what a file lists, longest first."""
    asked = load_toml(plan, Study)
    print_warnings(plausibility_warnings(asked))
    existing = ExistingStudy.RESUME if resume else ExistingStudy.REFUSE
    with told_to_stop() as is_stopped, study_bar(asked.grid.size) as observer:
        results = solve_study(asked, out, existing, workers, cluster, observer, is_stopped)
    if as_json:
        print_json(document(results, out))
    else:
        tell(results, out)
    if not results.is_complete:
        raise typer.Exit(STOPPED_EXIT_CODE)


def document(results: StudyResults, out: Path) -> dict[str, object]:
    """Say what a file holds, for other programs; the numbers themselves are in it."""
    return {
        "file": str(out),
        "points": results.study.grid.size,
        "kept": results.kept,
        "is_complete": results.is_complete,
        "sessions": len(results.sessions),
        "failures": [{**where, "message": why} for where, why in results.failures()],
        "study": results.study.model_dump(mode="json"),
    }


def tell(results: StudyResults, out: Path) -> None:
    """Say how far a study is, and where scenes could not be computed."""
    failures = list(results.failures())
    state = "complete" if results.is_complete else "stopped: go on with --resume"
    console.print(
        f"{out}: {results.kept} of {results.study.grid.size} points, {len(failures)} failed ({state})"
    )
    for where, why in failures[:SHOWN_FAILURES]:
        place = ", ".join(f"{name} {value}" for name, value in where.items())
        console.print(f"  {place}: {why}", markup=False)
    if len(failures) > SHOWN_FAILURES:
        console.print(f"  and {len(failures) - SHOWN_FAILURES} more; see `message` in the file")


_DIGEST = 16


def kept_study(study: Study, folder: Path, workers: int | None) -> StudyResults:
    """Solve a study, or what is missing of it: its file is named by everything that it asks."""
    folder.mkdir(parents=True, exist_ok=True)
    digest = hashlib.sha256(study.model_dump_json().encode()).hexdigest()[:_DIGEST]
    with told_to_stop() as is_stopped, study_bar(study.grid.size) as observer:
        results = solve_study(
            study,
            folder / f"{digest}.h5",
            ExistingStudy.RESUME,
            workers,
            observer=observer,
            cancelled=is_stopped,
        )
    if not results.is_complete:
        typer.echo(
            f"stopped after {results.kept} of {study.grid.size} points; the same command goes on", err=True
        )
        raise typer.Exit(STOPPED_EXIT_CODE)
    return results
