"""Reports: one HTML file with everything in it, figures and tables of results, and measured accuracy.

A campaign, one recording or a comparison is written for a screen and for paper, with its findings in
sentences and what it cannot say. Also chosen here: which figures a result has, in which order. The page
on speed and accuracy is docs/accuracy.md. Results are taken as they are: nothing is analysed here.

>>> from vibench.analysis.report import FigureOptions, FrequencyGrid
>>> options = FigureOptions(damping_time_s=2e-5, grid=FrequencyGrid.COARSE)
>>> len(options.frequencies_hz), options.frequencies_hz[-1]
(120, 600.0)
>>> options.sentence.partition(" accuracy")[0]
'Options: c = 2e-05 s · k, gap 45 µm, standard'
"""

from ..figures import (
    SHOWN,
    DrawnFigure,
    ImageKind,
    branches_figure,
    chain_figure,
    contact_forces_figure,
    exponent_spectrum_figure,
    map_figure,
    tradeoff_figure,
)
from ..paper_figures import (
    PAPER_FIGURES,
    FigureOptions,
    FrequencyGrid,
    levels_figure,
)
from ._accuracy_document import (
    accuracy_document,
    worst_error,
)
from ._comparison_export import (
    write_comparison,
)
from ._drawings import (
    DRAWINGS,
    Drawing,
    findings,
    recording_figures,
    result_figures,
)
from ._report import (
    check_warnings,
    write_report,
)

__all__ = [
    "DRAWINGS",
    "PAPER_FIGURES",
    "SHOWN",
    "Drawing",
    "DrawnFigure",
    "FigureOptions",
    "FrequencyGrid",
    "ImageKind",
    "accuracy_document",
    "branches_figure",
    "chain_figure",
    "check_warnings",
    "contact_forces_figure",
    "exponent_spectrum_figure",
    "findings",
    "levels_figure",
    "map_figure",
    "recording_figures",
    "result_figures",
    "tradeoff_figure",
    "worst_error",
    "write_comparison",
    "write_report",
]
