"""Fig. 6: the continuous model n = 5 at the four amplitudes, with branches of harmonic balance."""

from typing import TYPE_CHECKING

from vibench.analysis.dynamics import BranchMethod, BranchRequest, diagram_of
from vibench.analysis.report import TERMINAL, DrawnFigure, draw_line
from vibench.sim.study import Study, StudyResults

from .figure_03_levels import four_levels
from .options import AMPLITUDES_M, FigureOptions
from .responses import Responses

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MODEL = "power:5"
_PLACES = 60
"""Number of frequencies at which closed-form first-order solutions are used to start branches."""


def studies(options: FigureOptions) -> tuple[Study, ...]:
    """Return the study of n = 5 at the paper's four amplitudes."""
    return (options.study((_MODEL,), AMPLITUDES_M),)


def draw(options: FigureOptions, results: StudyResults) -> DrawnFigure:
    """Draw simulated responses over harmonic-balance branches and the folds of the branches."""

    def background(axes: "Axes", curve: Responses, amplitude_m: float) -> None:
        found = diagram_of(
            BranchRequest(
                model=_MODEL,
                damping_time_s=options.only_damping_time_s,
                gap_m=options.gap_m,
                method=BranchMethod.FIRST_ORDER,
                amplitude_m=amplitude_m,
                start=float(curve.frequency_hz[0]),
                stop=float(curve.frequency_hz[-1]),
                places=_PLACES,
            )
        )
        for line in found.lines:
            draw_line(axes, line, line.frequency_hz, line.response_ii[:, 0])
        folds_hz = [each.frequency_hz for line in found.lines for each in line.events if each.kind == "fold"]
        for at_hz in folds_hz:
            axes.axvline(at_hz, color=TERMINAL, linestyle=":", linewidth=0.8, label="fold: a jump")

    return four_levels(
        "figure_6",
        "Figure 6: Responses I and II of the continuous model, n = 5",
        "Blue: branches of the paper's first-order balance, unstable ones dashed; dotted: where they fold. "
        + options.sentence,
        results,
        background,
    )
