"""Pictures of branches and of exponents, over frequency or level."""

from functools import partial

import numpy as np
from PySide6.QtWidgets import QStackedWidget, QWidget

from vibench.analysis.dynamics import BranchDiagram, ExponentSpectrum
from vibench.sim import Parameter

from ...plots.axis import LOG_FREQUENCY, PlotAxis, Scale
from ...plots.line_style import GUIDE, Dash, LineStyle, curve_style
from ...plots.plot import Plot
from ...widgets.boxes import column
from ...widgets.theme import Theme

LEVEL = PlotAxis("Base amplitude A0", "m")
RESPONSES = (
    ("response_i", PlotAxis("Response I of m0, max |x| / A0", short="Response I", scale=Scale.LOGARITHMIC)),
    (
        "response_ii",
        PlotAxis("Response II of m0, |x at f| / A0", short="Response II", scale=Scale.LOGARITHMIC),
    ),
)
EXPONENT = PlotAxis("Lyapunov exponents", "1/s", short="Exponents")
DIMENSION = PlotAxis("Kaplan-Yorke dimension", short="Dimension")
ACROSS = {Parameter.FREQUENCY: LOG_FREQUENCY, Parameter.AMPLITUDE: LEVEL}
_SPECIAL = ("fold", "period doubling", "Neimark-Sacker", "symmetry breaking", "grazing")
_FIRST_SPECIAL_COLOUR = 1
"""The first is that of motions of one period."""


class _TwoPlots(QStackedWidget):
    """Two plots above one another, once over frequency and once over level."""

    def __init__(self, theme: Theme, titles: tuple[str, str], axes: tuple[PlotAxis, PlotAxis], hint: str):
        super().__init__()
        self.pairs: dict[Parameter, tuple[Plot, Plot]] = {}
        for along, across in ACROSS.items():
            over = f"{titles[0]} over {along.value}", f"{titles[1]} over {along.value}"
            first, second = (Plot(title, across, axis, theme) for title, axis in zip(over, axes, strict=True))
            first.with_legend().with_hint(hint)
            second.with_legend().with_hint("The same motions.")
            second.setXLink(first)
            self.pairs[along] = (first, second)
            self.addWidget(column((first, 1), (second, 1)))

    def cleared(self, along: Parameter) -> tuple[Plot, Plot]:
        """Bring the pair of a parameter to the front, empty."""
        self.setCurrentIndex(list(ACROSS).index(along))
        pair = self.pairs[along]
        for plot in pair:
            plot.wipe()
        return pair


class _PairPicture:
    """What pictures of two plots have alike."""

    def __init__(self, plots: _TwoPlots) -> None:
        self._plots = plots

    @property
    def widget(self) -> QWidget:
        """Both plots."""
        return self._plots

    def plots(self, along: Parameter) -> tuple[Plot, Plot]:
        """Those over one parameter."""
        return self._plots.pairs[along]


class BranchPicture(_PairPicture):
    """Stable motions solid, unstable ones dashed; longer periods in other colours; special points marked."""

    def __init__(self, theme: Theme) -> None:
        axes = RESPONSES[0][1], RESPONSES[1][1]
        hint = "Periodic motions: stable ones solid, unstable ones dashed, as they are found."
        titles = ("Response I of branches", "Response II of branches")
        super().__init__(_TwoPlots(theme, titles, axes, hint))

    def show_answer(self, answer: BranchDiagram) -> None:
        """Draw every branch."""
        along = answer.request.along
        pair = self._plots.cleared(along)
        named: set[str] = set()
        for line in answer.lines:
            for is_stable, piece in line.pieces():
                style = curve_style(line.periods - 1, Dash.SOLID if is_stable else Dash.DASHED)
                period = "" if line.periods == 1 else f", period {line.periods}"
                name = f"{'stable' if is_stable else 'unstable'}{period}"
                for plot, (what, _) in zip(pair, RESPONSES, strict=True):
                    curve = plot.curve(style, "" if name in named else name)
                    curve.setData(line.along(along)[piece], getattr(line, what)[piece, 0])
                named.add(name)
        self._mark_special(answer, pair[1])

    def _mark_special(self, answer: BranchDiagram, plot: Plot) -> None:
        is_frequency = answer.request.along is Parameter.FREQUENCY
        for number, kind in enumerate(_SPECIAL, start=_FIRST_SPECIAL_COLOUR):
            found = [each for line in answer.lines for each in line.events if each.kind == kind]
            if found:
                place = [each.frequency_hz if is_frequency else each.amplitude_m for each in found]
                dots = plot.dots(curve_style(number), kind, size=7)
                dots.setData(np.array(place), np.array([each.response_ii for each in found]))


class SpectrumPicture(_PairPicture):
    """Six exponents with their intervals, and the dimension with its own."""

    def __init__(self, theme: Theme) -> None:
        hint = "All six Lyapunov exponents with their intervals, as they are found."
        titles = ("Exponents", "Kaplan-Yorke dimension")
        super().__init__(_TwoPlots(theme, titles, (EXPONENT, DIMENSION), hint))

    def show_answer(self, answer: ExponentSpectrum) -> None:
        """Draw what is there."""
        along = answer.request.along
        upper, lower = self._plots.cleared(along)
        if not answer.points:
            return
        place = answer.column("frequency_hz" if along is Parameter.FREQUENCY else "amplitude_m")
        low, middle, high = (answer.column(n) for n in ("low_per_s", "exponents_per_s", "high_per_s"))
        draw = partial(_with_interval, place=place)
        for k in range(middle.shape[1]):
            draw(upper, k, f"λ{k + 1}", low=low[:, k], middle=middle[:, k], high=high[:, k])
        upper.level(GUIDE, 0.0)
        low, middle, high = (answer.column(n) for n in ("dimension_low", "dimension", "dimension_high"))
        draw(lower, 0, "", low=low, middle=middle, high=high)


def _with_interval(
    plot: Plot,
    number: int,
    name: str,
    *,
    place: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]",
    low: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]",
    middle: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]",
    high: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]",
) -> None:
    known = np.isfinite(low) & np.isfinite(middle) & np.isfinite(high)
    if not known.any():
        return
    style = curve_style(number)
    plot.band(LineStyle(style.colour, Dash.SOLID, 0.2)).set_data(place[known], low[known], high[known])
    plot.curve(style, name).setData(place[known], middle[known])
    if np.count_nonzero(known) == 1:
        plot.dots(style, size=6).setData(place[known], middle[known])
