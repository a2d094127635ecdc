"""Pictures of a chain: transmission over frequency, motion over place and time, energy and impacts."""

import math

import numpy as np

from vibench.analysis.dynamics import ChainAnswer, ChainDrive, ChainRun

from ...plots.axis import FREQUENCY, TIME, PlotAxis, Scale
from ...plots.line_style import Dash, LineStyle, curve_style
from ...plots.plot import Plot
from ...widgets.boxes import column
from ...widgets.theme import Theme

ACROSS = PlotAxis("Motion of m0 over base, |x / U|", short="|x / U|", scale=Scale.LOGARITHMIC)
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
        self.across = Plot("Transmission along the chain over frequency", FREQUENCY, ACROSS, theme)
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
