"""A study that is kept in a folder under a name of its own, and goes on where it was stopped."""

import hashlib
from pathlib import Path

import typer

from vibench.sim.study import Existing, Study, StudyResults, solve_study

from .interruption import told_to_stop
from .study import STOPPED_EXIT_CODE
from .study_bar import study_bar

_DIGEST = 16


def kept_study(study: Study, folder: Path, workers: int | None) -> StudyResults:
    """Solve a study, or what is missing of it: its file is named by everything that it asks."""
    folder.mkdir(parents=True, exist_ok=True)
    digest = hashlib.sha256(study.model_dump_json().encode()).hexdigest()[:_DIGEST]
    with told_to_stop() as is_stopped, study_bar(study.grid.size) as watcher:
        results = solve_study(
            study, folder / f"{digest}.h5", Existing.RESUME, workers, watcher=watcher, cancelled=is_stopped
        )
    if not results.is_complete:
        typer.echo(
            f"stopped after {results.kept} of {study.grid.size} points; the same command goes on", err=True
        )
        raise typer.Exit(STOPPED_EXIT_CODE)
    return results
