"""What the commands that compute many points share: who computes, and which points have no answer."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from .exit_code import ExitCode
from .options import option
from .output import errors

if TYPE_CHECKING:
    from vibench.sim.study import GridPlan

SHOWN_FAILURES = 5

Workers = Annotated[int | None, option("Threads; one for each processor if absent.", "N", min=1)]
Cluster = Annotated[str | None, option("Let the workers of this Dask scheduler compute.", "ADDRESS")]
Failures = Sequence[tuple[Mapping[str, float | str], str]]
"""Values of the axes at each point without an answer, and why there is none."""


def complain_about_points(plan: "GridPlan", failures: Failures, kept: int) -> None:
    """End with sentences for points without an answer, or as a study of which only ``kept`` were answered."""
    if say_failures(plan, failures) > 0:
        raise typer.Exit(ExitCode.FAILED)
    if kept < plan.grid.size:
        errors.print(f"stopped after {kept} of {plan.grid.size} points; a file goes on with --resume")
        raise typer.Exit(ExitCode.STOPPED)


def say_failures(plan: "GridPlan", failures: Failures) -> int:
    """Say on standard error which points have no answer, and why; returns how many."""
    for where, why in failures[:SHOWN_FAILURES]:
        # An axis of one value tells no point from another.
        told = [axis for axis in plan.axes if len(axis.values) > 1] or [plan.axes[-1]]
        place = ", ".join(f"{axis.name} {where[axis.name]} {axis.units}".strip() for axis in told)
        errors.print(f"error: {place}: {why}")
    if len(failures) > SHOWN_FAILURES:
        more = len(failures) - SHOWN_FAILURES
        errors.print(f"error: {more} more points have no answer: see `failures` with --json")
    return len(failures)
