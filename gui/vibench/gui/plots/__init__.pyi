from ._axis import (
    FREQUENCY as FREQUENCY,
    LOG_FREQUENCY as LOG_FREQUENCY,
    TIME as TIME,
    PlotAxis as PlotAxis,
    Scale as Scale,
)
from ._bar_delegate import (
    SHARE_ROLE as SHARE_ROLE,
    BarDelegate as BarDelegate,
)
from ._line_style import (
    GUIDE as GUIDE,
    LIMIT as LIMIT,
    PREDICTED as PREDICTED,
    Dash as Dash,
    LineStyle as LineStyle,
    curve_style as curve_style,
    dashed_pen as dashed_pen,
)
from ._plot import (
    Plot as Plot,
)
from ._signal_curve import (
    SignalCurve as SignalCurve,
)
