"""Pictures of branches and of exponents, over frequency or level."""

import math
from functools import partial

import numpy as np
from PySide6.QtWidgets import QStackedWidget, QWidget

from vibench.analysis.dynamics import BranchDiagram, ChainAnswer, ChainDrive, ChainRun, ExponentSpectrum
from vibench.sim import Parameter

from ...plots.axis import FREQUENCY, LOG_FREQUENCY, TIME, PlotAxis, Scale
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


ALONG_CHAIN = PlotAxis("Motion of m0 over base, |x / U|", short="|x / U|", scale=Scale.LOGARITHMIC)
PLACE = PlotAxis("Cell, from the base", short="Cell")
ENERGY = PlotAxis("Mean energy of a cell", "µJ", factor=1e6, short="Energy", scale=Scale.LOGARITHMIC)
_GAP = LineStyle(lambda theme: theme.muted, filled=0.14)
_SMALLEST = 1e-8
"""Transmissions below are drawn at the foot of the axis."""
_MOST_TRACES = 32
"""Cells whose motion is drawn, evenly chosen in longer chains."""
_HEIGHT = 0.45
"""Of the largest motion, in cells."""


class ChainPicture:
    """Three plots above one another, drawn anew as runs come in."""

    def __init__(self, theme: Theme) -> None:
        self.across = Plot("Transmission along the chain over frequency", FREQUENCY, ALONG_CHAIN, theme)
        self.motion = Plot("Motion of m0 over place and time", TIME, PLACE, theme)
        self.energies = Plot("Energy of the cells", PLACE, ENERGY, theme)
        self.across.with_legend().with_hint("Dashed: without contact; grey: gaps of the endless chain.")
        self.motion.with_hint("m0 of every cell over time, with its impacts, in the last run.")
        self.energies.with_legend().with_hint("Mean energy of every cell, in the last run.")
        self.widget = column(*((plot, 1) for plot in self.plots))

    @property
    def plots(self) -> tuple[Plot, Plot, Plot]:
        """All three."""
        return self.across, self.motion, self.energies

    def show_answer(self, answer: ChainAnswer) -> None:
        """Draw what is there."""
        for plot in self.plots:
            plot.wipe()
        self._show_across(answer)
        run = answer.shown_run
        if run is not None:
            self._show_motion(run)
            self._show_energies(run)

    def _show_across(self, answer: ChainAnswer) -> None:
        top_hz = float(answer.linear_hz[-1])
        self.across.stripes(_GAP).show_bands(
            [(gap.lower_hz, min(gap.upper_hz, top_hz)) for gap in answer.gaps]
        )
        for number, (cells, place, name) in enumerate(answer.shown_cells):
            linear = np.maximum(answer.linear_transmission(cells)[:, place], _SMALLEST)
            self.across.curve(curve_style(number, Dash.DASHED), name).setData(answer.linear_hz, linear)
            over_hz, driven = answer.driven_transmission(cells, place)
            if not over_hz.size:
                continue
            driven = np.maximum(driven, _SMALLEST)
            self.across.curve(curve_style(number)).setData(over_hz, driven, connect="finite")
            if answer.request.drive is ChainDrive.STEADY:
                self.across.dots(curve_style(number), size=6).setData(over_hz, driven)

    def _show_motion(self, run: ChainRun) -> None:
        largest = float(np.nanmax(np.abs(run.motion_m), initial=0.0)) or 1.0
        places = np.unique(np.linspace(0, run.cells - 1, min(run.cells, _MOST_TRACES)).round().astype(int))
        for place in places:
            trace = place + 1 + _HEIGHT * run.motion_m[:, place] / largest
            self.motion.curve(curve_style(0)).setData(run.time_s, trace)
        is_shown = np.isin(run.impact_cell, places)
        self.motion.dots(curve_style(2), "impacts", size=3).setData(
            run.impact_time_s[is_shown], run.impact_cell[is_shown] + 1.0
        )

    def _show_energies(self, run: ChainRun) -> None:
        known = np.isfinite(run.energy_j) & (run.energy_j > 0.0)
        place = np.arange(1.0, run.cells + 1.0)[known]
        impacts = f"{run.impacts.sum() / run.observed_s:.4g} impacts a second in all"
        where = "" if math.isnan(run.frequency_hz) else f" at {run.frequency_hz:g} Hz"
        self.energies.dots(curve_style(1), f"{run.cells} cells{where}, {impacts}", size=7).setData(
            place, run.energy_j[known]
        )
