"""Fig. 9: similarity rates of n = 29, 35 and 47."""

from vibench.analysis.report import DrawnFigure
from vibench.sim.study import Study, StudyResults

from .options import FigureOptions
from .similarity_rates import rates_figure, similarity_study

MODELS = ("power:29", "power:35", "power:47")


def studies(options: FigureOptions) -> tuple[Study, ...]:
    """Return the study of the three models and the piece-wise model."""
    return (similarity_study(options, MODELS),)


def draw(options: FigureOptions, results: StudyResults) -> DrawnFigure:
    """Draw the similarity rates over the amplitude."""
    return rates_figure("figure_9", "Figure 9: similarity of extreme orders", MODELS, options, results)
