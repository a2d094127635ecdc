"""Options and error messages of commands that compute many points."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from .options import option
from .output import ExitCode, errors

if TYPE_CHECKING:
    from vibench.sim.study import GridPlan

SHOWN_FAILURES = 5

Workers = Annotated[int | None, option("Number of threads; by default one per processor.", "N", min=1)]
Cluster = Annotated[str | None, option("Compute on the workers of this Dask scheduler.", "ADDRESS")]
Failures = Sequence[tuple[Mapping[str, float | str], str]]
"""Axis values of each failed point, and the reason for the failure."""


def complain_about_points(plan: "GridPlan", failures: Failures, kept: int) -> None:
    """Print failed points or, after a stop, the number of finished points; exit with an error code."""
    if print_failures(plan, failures) > 0:
        raise typer.Exit(ExitCode.FAILED)
    if kept < plan.grid.size:
        errors.print(f"stopped after {kept} of {plan.grid.size} points; --resume continues a stored file")
        raise typer.Exit(ExitCode.STOPPED)


def print_failures(plan: "GridPlan", failures: Failures) -> int:
    """Print each failed point with the reason on standard error; return the number of failed points."""
    for where, why in failures[:SHOWN_FAILURES]:
        # Leave out axes with a single value.
        axes = [axis for axis in plan.axes if len(axis.values) > 1] or [plan.axes[-1]]
        place = ", ".join(f"{axis.name} {where[axis.name]} {axis.units}".strip() for axis in axes)
        errors.print(f"error: {place}: {why}")
    if len(failures) > SHOWN_FAILURES:
        more = len(failures) - SHOWN_FAILURES
        errors.print(f"error: {more} more points have no result: see `failures` with --json")
    return len(failures)
