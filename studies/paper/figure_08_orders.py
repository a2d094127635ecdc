"""Fig. 8: similarity rates of n = 3, 5, 7 and their sum."""

from vibench.analysis.report import DrawnFigure
from vibench.sim.study import Study, StudyResults

from .options import FigureOptions
from .similarity_rates import rates_figure, similarity_study

_MODELS = ("power:3", "power:5", "power:7", "power:3+5+7")


def studies(options: FigureOptions) -> tuple[Study, ...]:
    """Return the study of the four models and the piece-wise model."""
    return (similarity_study(options, _MODELS),)


def draw(options: FigureOptions, results: StudyResults) -> DrawnFigure:
    """Draw the similarity rates over the amplitude."""
    return rates_figure("figure_8", "Figure 8: similarity of several orders", _MODELS, options, results)
