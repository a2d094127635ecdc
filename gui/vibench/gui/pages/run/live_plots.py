"""Live plots of a run: time histories, spectra, responses, phase portrait and motion of m1."""

from functools import partial
from math import nan

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from vibench.acquisition.engine import EngineStatus, TwinStatus
from vibench.acquisition.rig import RESPONSE_ROLES
from vibench.analysis import MeasurementPrediction
from vibench.analysis.live import LiveView, Portrait, zigzag

from ...plots.axis import FREQUENCY, LOG_FREQUENCY, PlotAxis, Scale
from ...plots.line_style import LIMIT, PREDICTED, Dash, LineStyle, curve_style
from ...plots.plot import Curves, Plot, show_fields
from ...plots.plot_stack import PlotStack
from ...widgets.boxes import fill_box
from ...widgets.theme import Colour, Theme
from ...widgets.units import UNITS, SentenceLabel, plain_unit


class SweepPlot(QWidget):
    """Responses during a dwell, steps or a sweep, over the drive frequency at the time of measurement."""

    def __init__(self, tab: str, plot: Plot) -> None:
        super().__init__()
        self.title, self.tab, self.plot = plot.accessibleName(), tab, plot
        self._stripes = plot.stripes(LineStyle(lambda theme: theme.traces[3], fill_opacity=0.15))
        self.predicted: Curves = {}
        self.measured: Curves = {}
        self._newest_s: float | None = None
        fill_box(QVBoxLayout(self), plot, margin=0)

    def show_view(self, view: LiveView) -> None:
        """Draw all responses measured so far, in the order of measurement."""
        history = view.history()
        newest_s = history.time_s[-1] if len(history.time_s) else None
        if newest_s == self._newest_s:
            return
        self._newest_s = newest_s
        show_fields(self.measured, history)

    def show_prediction(self, seen: MeasurementPrediction | None) -> None:
        """Draw a prediction and its frequency ranges with collisions behind the points; None clears both."""
        self._stripes.show_bands(() if seen is None else seen.collision_bands_hz)
        show_fields(self.predicted, seen and seen.prediction)

    def clear(self) -> None:
        """Remove the measured points."""
        self._newest_s = None
        show_fields(self.measured, None)


def sweep_history(theme: Theme) -> SweepPlot:
    """Return the plot of Responses I and II."""
    up = PlotAxis("Response I, II", "x / A0", scale=Scale.LOGARITHMIC)
    plot = Plot("Response over frequency", FREQUENCY, up, theme).with_legend()
    plot.with_hint("One point per tenth of a second of a dwell or sweep, and the predicted responses.")
    made = SweepPlot("Responses", plot)
    made.predicted = {
        "response_i": plot.curve(PREDICTED, "I, simulated"),
        "response_ii": plot.curve(curve_style(0, Dash.DOTTED), "II, simulated"),
        "linear": plot.curve(curve_style(2, Dash.DOTTED), "linear, simulated"),
    }
    made.measured = {
        "response_i": plot.dots(curve_style(3), "I, measured", 3),
        "response_ii": plot.dots(curve_style(0), "II, measured", 3),
    }
    return made


def sweep_envelope(theme: Theme) -> SweepPlot:
    """Return the plot of the largest and smallest velocity of m0 over the drive frequency."""
    plot = Plot("Sweep envelope", FREQUENCY, PlotAxis("m0 velocity", "m/s"), theme).with_legend()
    plot.with_hint("Largest and smallest velocity of m0 during a sweep.")
    made = SweepPlot("Envelope", plot)
    made.measured = {
        "upper": plot.curve(curve_style(3), "largest"),
        "lower": plot.curve(curve_style(0), "smallest"),
    }
    return made


_WORDS = {
    "drive_voltage": "drive",
    "amplifier_voltage": "amplifier",
    "base_acceleration": "base",
    **{role.value: "m0" for role in RESPONSE_ROLES},
}
_SHORT = {"amplifier_voltage": "amp."}


def channel_word(role: str) -> str:
    """Return a short name of the channel with this role."""
    return _WORDS.get(role, role.replace("_", " "))


def channel_axis(role: str, unit: str) -> PlotAxis:
    """Return the axis of a channel, in the chosen unit."""
    return PlotAxis(channel_word(role), plain_unit(unit), short=_SHORT.get(role, channel_word(role)))


AGO = PlotAxis("Time before now", "s")
"""Common time axis, which does not move, because a scrolling axis would be repainted in every frame."""
LEAST_COLUMNS, MOST_COLUMNS = 500, 3000
"""Smallest and largest number of columns in which a signal is drawn; a column per pixel leaves no gap."""
UP_EM = 4.0
USUAL_SPAN_S = 2.0
"""Time range shown when the window opens [s]."""


class TimeHistoryPlots(PlotStack):
    """Plots with a common time axis, rebuilt when the channels change."""

    def __init__(self, theme: Theme) -> None:
        super().__init__(theme)
        self._curves: list[pg.PlotDataItem] = []
        self._span_s = 0.0
        self._channels: tuple[tuple[str, str], ...] = ()

    def show_channels(self, channels: tuple[tuple[str, str], ...]) -> None:
        """Show one plot per channel; channels are given as (role, unit)."""
        if channels != self._channels:
            self._build(channels)
            self._channels = channels

    def show_view(self, view: LiveView, span_s: float) -> None:
        """Draw the newest ``span_s`` seconds of every channel."""
        self.show_channels(tuple((channel.role, channel.unit) for channel in view.channels))
        if not self.plots:
            return
        seen = view.time_histories(span_s, min(max(LEAST_COLUMNS, self.plots[0].columns), MOST_COLUMNS))
        if len(seen.time_s) == 0:
            return
        time_s = np.repeat(seen.time_s - seen.time_s[-1], 2)
        for row, plot in enumerate(self.plots):
            low, high = (np.asarray(edge[row], dtype=np.float64) for edge in (seen.low, seen.high))
            self._curves[row].setData(time_s, zigzag(low, high))
            known = np.isfinite(low)
            if known.any():
                plot.keep_in_view(up=(float(low[known].min()), float(high[known].max())))
            if span_s != self._span_s:
                plot.setXRange(-span_s, 0, padding=0)
        self._span_s = span_s

    def _build(self, channels: tuple[tuple[str, str], ...]) -> None:
        """Create missing plots and reuse the others, because creating a plot is slow."""
        for plot in self.plots[len(channels) :]:
            self._layout.removeWidget(plot)
            plot.deleteLater()
        plots = list(self.plots[: len(channels)])
        del self._curves[len(channels) :]
        for row in range(len(plots), len(channels)):
            plot = Plot("Time history", AGO, channel_axis(*channels[row]), self._theme)
            plot.setXRange(-USUAL_SPAN_S, 0, padding=0)
            plot.up_em = UP_EM
            plot.follow_font()
            self._curves.append(plot.curve(curve_style(row)))
            self._layout.addWidget(plot, 1)
            plots.append(plot)
        for (role, unit), plot, curve in zip(channels, plots, self._curves, strict=True):
            curve.clear()
            plot.setAccessibleName(f"Time history of {channel_word(role)}")
            plot.with_hint(f"The newest seconds of {channel_word(role)} appear while a test runs.")
            plot.up.show_unit(channel_axis(role, unit))
        self.plots = plots
        self._span_s = 0.0
        self._label_last()


MEASURED = "measured, 95 % bounds"


class TransmissibilityPlot(QWidget):
    """Plot of the transmissibility |x / U| and its coherence over frequency."""

    title = "Transmission from base to m0"
    tab = "Transmission"

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        up = PlotAxis("|x / U|", scale=Scale.LOGARITHMIC)
        self.magnitude = Plot("Transmission from base to m0", FREQUENCY, up, theme).with_legend()
        self.magnitude.with_hint("The transmission with its bounds appears while a test runs.")
        self.coherence = Plot("Coherence", FREQUENCY, PlotAxis("Coherence", short="γ²"), theme)
        shade = LineStyle(lambda theme: theme.traces[0], fill_opacity=0.25)
        self._band = self.magnitude.band(shade, MEASURED)
        self._predicted = {
            "response_i": self.magnitude.curve(PREDICTED, "Response I to sines, simulated"),
            "linear": self.magnitude.curve(curve_style(2, Dash.DOTTED), "linear, simulated"),
        }
        self._measured = self.magnitude.curve(curve_style(0), MEASURED)
        self._coherence = self.coherence.curve(curve_style(0))
        self.coherence.setYRange(0, 1, padding=0.3)
        self.coherence.setXLink(self.magnitude)
        # The lower plot labels the frequency axis for both plots.
        self.magnitude.across.show_nothing()
        fill_box(QVBoxLayout(self), (self.magnitude, 2), (self.coherence, 1), margin=0).setSpacing(1)

    def show_view(self, view: LiveView) -> None:
        """Draw the current estimates of transmissibility and coherence."""
        found = view.frequency_response()
        if found is None:
            return
        self._measured.setData(found.frequency_hz, found.magnitude)
        self._band.set_data(found.frequency_hz, found.magnitude_lower, found.magnitude_upper)
        self._coherence.setData(found.frequency_hz, found.coherence)

    def show_prediction(self, seen: MeasurementPrediction | None) -> None:
        """Draw the predicted transmissibility behind the estimates; None clears the prediction."""
        show_fields(self._predicted, seen and seen.prediction)

    def clear(self) -> None:
        """Clear the plot of the transmissibility."""
        for curve in (self._measured, self._coherence):
            curve.clear()
        self._band.set_data([], [], [])


_LEAST = 1e-12


class SpectrumPlot(QWidget):
    """Spectra of all channels over a common frequency axis."""

    title = "Spectral density of every channel"
    tab = "Spectrum"

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        label = "Amplitude density, channel's unit / √Hz"
        up = PlotAxis(label, scale=Scale.LOGARITHMIC, short="unit / √Hz")
        self.plot = Plot("Spectral density of every channel", LOG_FREQUENCY, up, theme).with_legend()
        self.plot.with_hint("Spectra of all channels over the newest seconds of a run.")
        self._curves: list[pg.PlotDataItem] = []
        self._view: LiveView | None = None
        UNITS.on_change(self._redraw)
        fill_box(QVBoxLayout(self), self.plot, margin=0)

    def show_view(self, view: LiveView) -> None:
        """Draw the current spectra."""
        found = view.spectrum()
        if found is None:
            return
        self._view = view
        units = [UNITS.on_axis(channel.unit) for channel in view.channels]
        for row in range(len(self._curves), len(units)):
            name = f"{channel_word(view.channels[row].role)} ({units[row].name})"
            self._curves.append(self.plot.curve(curve_style(row), name))
        for curve, density, unit in zip(self._curves, found.amplitude_density, units, strict=False):
            curve.setData(found.frequency_hz[1:], unit.per_si * np.maximum(density[1:], _LEAST))

    def _redraw(self) -> None:
        """Redraw all curves after a change of units, because each curve has the unit of its channel."""
        self.plot.wipe()
        self._curves.clear()
        if self._view is not None:
            self.show_view(self._view)

    def clear(self) -> None:
        """Clear the plot of the spectra."""
        self._view = None
        for curve in self._curves:
            curve.clear()


_ACROSS = PlotAxis("m0 displacement", "m", short="x")
_UP = PlotAxis("m0 velocity", "m/s", short="v")


def extent(values: NDArray[np.floating]) -> tuple[float, float]:
    """Return the smallest and the largest value of an array."""
    return float(values.min()), float(values.max())


class PortraitPlot(QWidget):
    """Phase portrait of m0 on the left, Poincaré section on the right."""

    title = "Phase portrait and Poincaré section"
    tab = "Phase portrait, Poincaré"

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.orbit = Plot("Phase portrait of the newest periods", _ACROSS, _UP, theme)
        self.section = Plot("Poincaré section of the run so far", _ACROSS, _UP, theme)
        self.orbit.with_hint("Orbit of m0 over the newest drive periods of a sine test.")
        self.section.with_hint("One point of the motion per drive period of the run so far.")
        self._orbit = self.orbit.curve(curve_style(0))
        self._strobe = self.orbit.dots(curve_style(3), size=6)
        self._points = self.section.dots(curve_style(3), size=3)
        self._shown: Portrait | None = None
        fill_box(QHBoxLayout(self), (self.orbit, 1), (self.section, 1), margin=0)

    def show_view(self, view: LiveView) -> None:
        """Draw the newest drive periods of the motion of m0."""
        found = view.portrait()
        if found is None or found is self._shown:
            return
        self._shown = found
        self._orbit.setData(found.orbit_displacement_m, found.orbit_velocity_m_per_s)
        self._strobe.setData(found.strobe_displacement_m, found.strobe_velocity_m_per_s)
        self.orbit.keep_in_view(extent(found.orbit_displacement_m), extent(found.orbit_velocity_m_per_s))
        section = view.section
        if section.displacement_m.size:
            self.section.keep_in_view(extent(section.displacement_m), extent(section.velocity_m_per_s))
        self._points.setData(section.displacement_m, section.velocity_m_per_s)

    def clear(self) -> None:
        """Clear phase portrait and Poincaré section."""
        for item in (self._orbit, self._strobe, self._points):
            item.clear()


_FROM_NEWEST = PlotAxis("Time from the newest sample", "ms", 1e3, short="t")
_BETWEEN_STOPS = PlotAxis("p = y - z", "m", short="p")
_SHADES = 5
"""Number of shades of the forecast curve; the faintest shade marks an error of a quarter of the gap."""
_WORTH_OF_GAP = 0.25
_AHEAD_S, _BACK_S = 0.025, 0.05
_HINT = "Motion p of m1 between its stops; shown while a test runs with the live twin."


def _fade(number: int, theme: Theme) -> Colour:
    opacity = round(255 * (1.0 - number / _SHADES))
    return f"{theme.traces[1]}{opacity:02x}"


class HiddenMotionPlot(QWidget):
    """Estimated motion p of m1 in the newest 50 ms, with forecast and estimated parameters."""

    title = "Hidden motion: m1 between its stops"
    tab = "Hidden motion"

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.plot = Plot(self.title, _FROM_NEWEST, _BETWEEN_STOPS, theme).with_hint(_HINT)
        self.tracked = self.plot.curve(curve_style(0))
        self.forecast = [
            self.plot.curve(LineStyle(partial(_fade, number), Dash.SOLID)) for number in range(_SHADES)
        ]
        self._stops = [self.plot.level(LIMIT, nan, "stop") for _ in range(2)]
        self.caption = SentenceLabel(rank="second", name="Report of the live twin")
        self._end = (0, -1)
        self.plot.setXRange(-_BACK_S, _AHEAD_S, padding=0)
        fill_box(QVBoxLayout(self), self.caption, (self.plot, 1)).setContentsMargins(8, 4, 0, 0)
        self.clear()

    def show_status(self, status: EngineStatus | None) -> None:
        """Draw the newest estimate of the live twin, if it has changed since it was drawn."""
        twin = None if status is None else status.twin
        if twin is None:
            self.clear()
            return
        self.caption.setText(_words(twin))
        if (twin.run_id, twin.end_sample) == self._end or not twin.p_m:
            return
        self._end = (twin.run_id, twin.end_sample)
        p = np.array([np.nan if each is None else each for each in twin.p_m])
        self.tracked.setData((np.arange(p.size) - p.size + 1) * twin.step_s, p, connect="finite")
        self._draw_forecast(twin)
        for line, place in zip(self._stops, twin.stops_m, strict=True):
            self.plot.move_level(line, place)
        reach = 1.15 * max(map(abs, twin.stops_m))
        self.plot.keep_in_view(up=(-reach, reach))

    def clear(self) -> None:
        """Clear the plot, because the live twin is off or a new run begins."""
        for curve in (self.tracked, *self.forecast):
            curve.setData([], [])
        for line in self._stops:
            self.plot.move_level(line, nan)
        self.caption.setText("The live twin is off.")
        self._end = (0, -1)

    def _draw_forecast(self, twin: TwinStatus) -> None:
        """Draw the forecast in pieces, which are fainter where the error is larger."""
        p, error = np.array(twin.forecast_m), np.array(twin.forecast_error_m)
        time_s = np.arange(1, p.size + 1) * twin.step_s
        worth = _WORTH_OF_GAP * min(map(abs, twin.stops_m))
        shade = np.minimum(_SHADES * error / worth, _SHADES - 1).astype(int) if p.size else np.empty(0)
        for number, curve in enumerate(self.forecast):
            here = np.flatnonzero(shade == number)
            # Each piece of the forecast begins at the last point of the previous piece, to leave no gap.
            part = slice(max(here[0] - 1, 0), here[-1] + 1) if here.size else slice(0, 0)
            curve.setData(time_s[part], p[part])


def _words(twin: TwinStatus) -> str:
    numbers = "; ".join(f"{name} {value}" for name, value in twin.numbers[:3])
    parts = [twin.state, twin.sentence, numbers]
    if twin.missed_s:
        parts.append(f"{twin.missed_s:.1f} s were skipped: the computer was too busy")
    return " · ".join(each for each in parts if each)
