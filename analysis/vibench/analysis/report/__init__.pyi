from ._chain import chain_figure as chain_figure
from ._choices import SHOWN as SHOWN, ImageKind as ImageKind, Table as Table, table as table
from ._comparison import write_comparison as write_comparison
from ._drawings import (
    DRAWINGS as DRAWINGS,
    STEPPED as STEPPED,
    Drawing as Drawing,
    ReportTable as ReportTable,
    findings as findings,
    recording_figures as recording_figures,
    result_figures as result_figures,
)
from ._maps import branches_figure as branches_figure, draw_line as draw_line, map_figure as map_figure
from ._predictions import (
    contact_forces_figure as contact_forces_figure,
    curve_figure as curve_figure,
    exponent_spectrum_figure as exponent_spectrum_figure,
)
from ._report import (
    Agreement as Agreement,
    Card as Card,
    Fold as Fold,
    Page as Page,
    check_warnings as check_warnings,
    draw_cards as draw_cards,
    write_page as write_page,
    write_report as write_report,
)
from ._style import (
    COLLIDING as COLLIDING,
    LEVEL_STYLES as LEVEL_STYLES,
    LEVELS as LEVELS,
    LINEAR as LINEAR,
    MEASURED as MEASURED,
    SIMULATED as SIMULATED,
    TERMINAL as TERMINAL,
    DrawnFigure as DrawnFigure,
    figure_style as figure_style,
    frequency_axis as frequency_axis,
    legend_above as legend_above,
    magnitude_axis as magnitude_axis,
    new_figure as new_figure,
    with_prefix as with_prefix,
)
