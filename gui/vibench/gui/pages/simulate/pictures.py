"""Plots of simulations: branches, exponents, chains, responses, motions and similarity."""

import math
from collections.abc import Callable
from functools import partial
from math import log10

import numpy as np
from numpy.typing import NDArray
from PySide6.QtWidgets import QGridLayout, QStackedWidget, QWidget

from vibench.analysis import SIMILARITY_THRESHOLD, CurveOrigin
from vibench.analysis.dynamics import BranchDiagram, ChainAnswer, ChainDrive, ChainRun, ExponentSpectrum
from vibench.analysis.prediction.progress import SimulationProgress
from vibench.sim import Parameter

from ...plots.axis import FREQUENCY, LOG_FREQUENCY, TIME, PlotAxis, Scale
from ...plots.line_style import GUIDE, LIMIT, Dash, LineStyle, curve_style
from ...plots.plot import Plot
from ...widgets.boxes import column
from ...widgets.theme import Theme

Values = NDArray[np.float64]
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
_DASHES = {CurveOrigin.STABLE: Dash.SOLID, CurveOrigin.UNSTABLE: Dash.DASHED}
_FIRST_SPECIAL_COLOUR = 1
"""Colour number of the first event kind in `_SPECIAL`; 0 is for motions with the drive's period."""


class _PairPicture:
    """Two pairs of plots, one over frequency and one over drive level; only one pair is visible."""

    def __init__(self, theme: Theme, titles: tuple[str, str], axes: tuple[PlotAxis, PlotAxis], hint: str):
        self.widget = QStackedWidget()
        self._pairs: dict[Parameter, tuple[Plot, Plot]] = {}
        for along, across in ACROSS.items():
            over = f"{titles[0]} over {along.value}", f"{titles[1]} over {along.value}"
            first, second = (Plot(title, across, axis, theme) for title, axis in zip(over, axes, strict=True))
            first.with_legend().with_hint(hint)
            second.with_legend().with_hint("The same motions.")
            second.setXLink(first)
            self._pairs[along] = (first, second)
            self.widget.addWidget(column((first, 1), (second, 1)))

    def plots(self, along: Parameter) -> tuple[Plot, Plot]:
        """Return the pair of plots over a parameter."""
        return self._pairs[along]

    def clear(self, along: Parameter) -> tuple[Plot, Plot]:
        """Clear and show the pair of plots over a parameter; return the pair."""
        self.widget.setCurrentIndex(list(ACROSS).index(along))
        pair = self.plots(along)
        for plot in pair:
            plot.wipe()
        return pair


class BranchPicture(_PairPicture):
    """Branches: stable parts solid, unstable parts dashed, undecided parts dotted; colour: period."""

    def __init__(self, theme: Theme) -> None:
        axes = RESPONSES[0][1], RESPONSES[1][1]
        hint = "Periodic motions, drawn when found: solid if stable, dashed if unstable, dotted if undecided."
        titles = ("Response I of branches", "Response II of branches")
        super().__init__(theme, titles, axes, hint)

    def show_answer(self, answer: BranchDiagram) -> None:
        """Draw every branch."""
        along = answer.request.along
        pair = self.clear(along)
        named: set[str] = set()
        for line in answer.lines:
            for stability, piece in line.pieces():
                style = curve_style(line.periods - 1, _DASHES.get(stability, Dash.DOTTED))
                period = "" if line.periods == 1 else f", period {line.periods}"
                name = f"{stability.name.lower()}{period}"
                for plot, (what, _) in zip(pair, RESPONSES, strict=True):
                    curve = plot.curve(style, "" if name in named else name)
                    curve.setData(line.axis_values(along)[piece], getattr(line, what)[piece, 0])
                named.add(name)
        is_frequency = answer.request.along is Parameter.FREQUENCY
        for number, kind in enumerate(_SPECIAL, start=_FIRST_SPECIAL_COLOUR):
            found = [each for line in answer.lines for each in line.events if each.kind == kind]
            if found:
                place = [each.frequency_hz if is_frequency else each.amplitude_m for each in found]
                dots = pair[1].dots(curve_style(number), kind, size=7)
                dots.setData(np.array(place), np.array([each.response_ii for each in found]))


class SpectrumPicture(_PairPicture):
    """The six Lyapunov exponents and the dimension, with their confidence intervals."""

    def __init__(self, theme: Theme) -> None:
        hint = "All six Lyapunov exponents with their intervals, drawn when found."
        titles = ("Exponents", "Kaplan-Yorke dimension")
        super().__init__(theme, titles, (EXPONENT, DIMENSION), hint)

    def show_answer(self, answer: ExponentSpectrum) -> None:
        """Draw the exponents and dimensions found so far."""
        along = answer.request.along
        upper, lower = self.clear(along)
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
    place: Values,
    low: Values,
    middle: Values,
    high: Values,
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
_GAP = LineStyle(lambda theme: theme.muted, fill_opacity=0.14)
_SMALLEST = 1e-8
"""Lowest drawn transmissibility; smaller values are drawn at this value."""
_MOST_TRACES = 32
"""Largest number of cells whose motion is drawn; in longer chains, evenly spaced cells are drawn."""
_HEIGHT = 0.45
"""Ratio of the drawn height of the largest motion to the drawn distance between two cells."""


class ChainPicture:
    """Three plots of a chain, drawn again whenever a run is finished."""

    def __init__(self, theme: Theme) -> None:
        self.across = Plot("Transmission along the chain over frequency", FREQUENCY, ALONG_CHAIN, theme)
        self.motion = Plot("Motion of m0 over place and time", TIME, PLACE, theme)
        self.energies = Plot("Energy of the cells", PLACE, ENERGY, theme)
        self.across.with_legend().with_hint("Dashed: without contact; grey: band gaps of the infinite chain.")
        self.motion.with_hint("m0 of every cell over time, with its impacts, in the last run.")
        self.energies.with_legend().with_hint("Mean energy of every cell, in the last run.")
        self.widget = column(*((plot, 1) for plot in self.plots))

    @property
    def plots(self) -> tuple[Plot, Plot, Plot]:
        """All plots of a chain."""
        return self.across, self.motion, self.energies

    def show_answer(self, answer: ChainAnswer) -> None:
        """Draw the results that exist so far."""
        for plot in self.plots:
            plot.wipe()
        self._show_across(answer)
        run = answer.shown_run
        if run is not None:
            self._show_motion(run)
            known = np.isfinite(run.energy_j) & (run.energy_j > 0.0)
            place = np.arange(1.0, run.cells + 1.0)[known]
            impacts = f"{run.impacts.sum() / run.observed_s:.4g} impacts per second in total"
            where = "" if math.isnan(run.frequency_hz) else f" at {run.frequency_hz:g} Hz"
            self.energies.dots(curve_style(1), f"{run.cells} cells{where}, {impacts}", size=7).setData(
                place, run.energy_j[known]
            )

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


RESPONSE = PlotAxis("Motion of m0 over base, |x / U|", short="|x / U|", scale=Scale.LOGARITHMIC)
LARGEST_EXPONENT = PlotAxis("Largest Lyapunov exponent", "1/s", short="Exponent")
DIFFERENCE = PlotAxis("Difference of log Response I", short="Difference", scale=Scale.LOGARITHMIC)
RUN_TIME = PlotAxis("Time in the last part of the run", "ms", factor=1e3)
DISPLACEMENT = PlotAxis("Displacement", "m")
_COLLIDING = LineStyle(lambda theme: theme.muted, fill_opacity=0.14)
_EDGE = LineStyle(lambda theme: theme.muted, Dash.DOTTED)
_HINTS = (
    "Responses I and II of every model, drawn while they are computed.",
    "The motion of the masses at the frequency given under Signal.",
    "Largest Lyapunov exponents, if chosen under Exponent in the scene.",
    "Difference between the two models, where both are known.",
)
_SMALLEST_DIFFERENCE = 1e-6
"""Lowest drawn difference; smaller values are drawn at this value, because zero has no logarithm."""


class AnswerPlots(QWidget):
    """Four plots of a simulation, drawn again as results arrive."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.responses = Plot("Responses over frequency", LOG_FREQUENCY, RESPONSE, theme)
        self.exponents = Plot("Exponent over frequency", LOG_FREQUENCY, LARGEST_EXPONENT, theme)
        self.likeness = Plot("Difference of the two models over frequency", LOG_FREQUENCY, DIFFERENCE, theme)
        self.motion = Plot("Motion over time", RUN_TIME, DISPLACEMENT, theme)
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        for number, (plot, hint) in enumerate(zip(self.plots, _HINTS, strict=True)):
            plot.with_legend().with_hint(hint)
            layout.addWidget(plot, number // 2, number % 2)
            layout.setRowStretch(number // 2, 1)
            layout.setColumnStretch(number % 2, 1)

    @property
    def plots(self) -> tuple[Plot, ...]:
        """All plots of a simulation, row by row."""
        return (self.responses, self.motion, self.exponents, self.likeness)

    def show_progress(self, progress: SimulationProgress | None) -> None:
        """Draw the results that exist so far."""
        for step in self.steps(progress):
            step()

    def steps(self, progress: SimulationProgress | None) -> list[Callable[[], None]]:
        """Return one drawing function per plot, because drawing all plots takes longer than a frame."""
        draws = (self._responses, self._motion, self._exponents, self._likeness)
        return [
            partial(_draw_anew, plot, draw, progress) for plot, draw in zip(self.plots, draws, strict=True)
        ]

    def _responses(self, progress: SimulationProgress) -> None:
        for number, model in enumerate(progress.models):
            if number == 0:
                bands_hz = progress.collision_bands_hz(model)
                self.responses.stripes(_COLLIDING).show_bands(bands_hz)
                self.responses.rules(_EDGE).show_at(low_hz for low_hz, _ in bands_hz[1:])
                if bands_hz:
                    self.responses.upright(_EDGE, bands_hz[0][0], f"impacts, {model}")
            elsewhere_hz, elsewhere = progress.other_motions(model)
            if elsewhere_hz.size:
                dots = self.responses.dots(curve_style(number), f"other starts, {model}", size=5)
                dots.setData(elsewhere_hz, elsewhere)
            for name, label, dash in (
                ("response_i", "Response I", Dash.SOLID),
                ("response_ii", "Response II", Dash.DOTTED),
            ):
                frequency_hz, values = progress.column(model, name)
                if frequency_hz.size:
                    line = self.responses.curve(curve_style(number, dash), f"{label}, {model}")
                    line.setData(frequency_hz, values, connect="finite")
        low, high = progress.smallest_and_largest_response
        if high > 0.0:
            self.responses.setYRange(log10(low) - 0.1, log10(high) + 0.1, padding=0.0)

    def _exponents(self, progress: SimulationProgress) -> None:
        for number, model in enumerate(progress.models):
            frequency_hz, values = progress.column(model, "lyapunov_per_s")
            if np.isfinite(values).any():
                line = self.exponents.curve(curve_style(number), model)
                line.setData(frequency_hz, values, connect="finite")
                if number == 0:
                    self.exponents.level(GUIDE, 0.0)

    def _motion(self, progress: SimulationProgress) -> None:
        for number, signal in enumerate(progress.signals):
            time_s = signal.time_s - signal.time_s[0]
            line = self.motion.curve(curve_style(number), f"x, {signal.model}, {signal.frequency_hz:g} Hz")
            line.setData(time_s, signal.displacement_m)
            line = self.motion.curve(curve_style(number, Dash.DOTTED), f"p = y - z, {signal.model}")
            line.setData(time_s, signal.relative_m)
        if progress.signals:
            lower_m, upper_m = progress.signals[0].gaps_m
            stops_m = [each for each in (upper_m, -lower_m) if np.isfinite(each)]
            for stop_m in stops_m:
                self.motion.level(LIMIT, stop_m, "stop")
            reach_m = max(*np.abs(stops_m), progress.largest_signal_m)
            self.motion.setYRange(-1.1 * reach_m, 1.1 * reach_m, padding=0.0)

    def _likeness(self, progress: SimulationProgress) -> None:
        found = progress.similarity()
        if found is None:
            return
        name = f"{100 * found.rate:.0f} % similar ({100 * found.low:.0f} to {100 * found.high:.0f} %)"
        shown = np.maximum(found.difference, _SMALLEST_DIFFERENCE)
        line = self.likeness.curve(curve_style(2), name)
        line.setData(found.frequency_hz, shown, connect="finite")
        self.likeness.level(LIMIT, SIMILARITY_THRESHOLD, "limit")


def _draw_anew(
    plot: Plot, draw: Callable[[SimulationProgress], None], progress: SimulationProgress | None
) -> None:
    plot.wipe()
    if progress is not None:
        draw(progress)
