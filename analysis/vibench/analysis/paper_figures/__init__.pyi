from ._catalogue import (
    PAPER_FIGURES as PAPER_FIGURES,
)
from ._fig03_levels import (
    levels_figure as levels_figure,
)
from ._fig11_clearance import (
    GAPS_M as GAPS_M,
    clearance_studies as clearance_studies,
)
from ._options import (
    AMPLITUDES_M as AMPLITUDES_M,
    LOWEST_HZ as LOWEST_HZ,
    WITH_EXPONENT as WITH_EXPONENT,
    FigureOptions as FigureOptions,
    FrequencyGrid as FrequencyGrid,
)
from ._responses import (
    Responses as Responses,
    drive_at as drive_at,
    responses as responses,
)
from ._time_signal import (
    TimeSignal as TimeSignal,
    time_signal as time_signal,
)
