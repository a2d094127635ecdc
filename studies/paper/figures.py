"""Every figure of the paper that simulation draws: which studies it needs, and how it is drawn from them."""

from collections.abc import Callable
from dataclasses import dataclass

from vibench.analysis.report import DrawnFigure
from vibench.sim.study import Study, StudyResults

from .figure_01_forces import forces_figure
from .figure_02_definitions import definitions_figure, definitions_study
from .figure_03_levels import continuous_figure, continuous_study, levels_figure, levels_study
from .figure_04_multi_state import multi_state_figure, multi_state_study
from .figure_05_damping import damping_figure, damping_study
from .figure_07_similarity import (
    cubic_figure,
    cubic_study,
    extreme_figure,
    extreme_study,
    orders_figure,
    orders_study,
)
from .figure_10_exponents import exponents_figure, exponents_study, models_study
from .figure_11_clearance import clearance_figure, clearance_studies
from .options import FigureOptions


@dataclass(frozen=True)
class PaperFigure:
    """How one figure comes about."""

    studies: Callable[[FigureOptions], tuple[Study, ...]]
    draw: Callable[[FigureOptions, tuple[StudyResults, ...]], DrawnFigure]


def _of_one(
    study: Callable[[FigureOptions], Study], draw: Callable[[FigureOptions, StudyResults], DrawnFigure]
) -> PaperFigure:
    return PaperFigure(lambda options: (study(options),), lambda options, results: draw(options, results[0]))


PAPER_FIGURES = {
    1: PaperFigure(lambda _: (), lambda options, _: forces_figure(options)),
    2: _of_one(definitions_study, definitions_figure),
    3: _of_one(levels_study, levels_figure),
    4: _of_one(multi_state_study, multi_state_figure),
    5: _of_one(damping_study, damping_figure),
    6: _of_one(continuous_study, continuous_figure),
    7: _of_one(cubic_study, cubic_figure),
    8: _of_one(orders_study, orders_figure),
    9: _of_one(extreme_study, extreme_figure),
    10: PaperFigure(
        lambda options: (exponents_study(options), models_study(options)),
        lambda options, results: exponents_figure(options, *results),
    ),
    11: PaperFigure(clearance_studies, lambda options, results: clearance_figure(options, *results)),
}
"""By the paper's number; 12 to 14 show the experiment and are drawn from recordings."""
