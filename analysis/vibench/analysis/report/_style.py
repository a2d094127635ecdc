"""Style of all figures, and what several figures show.

Several figures show simulated runs (median and 95 % band) and resonances; every recording has figures of its
planned voltage and of the levels of all channels. Readers with colour blindness can distinguish the colours.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, LogFormatter, NullLocator

from vibench.acquisition import printable
from vibench.acquisition.plan import Measurement, SignalPreview
from vibench.sim import Specimen
from vibench.sim.operating_system.this import replace_file

from ..overlay.draws import SimulatedRun
from ..overlay.overlay import (
    RESPONSE_I,
    RESPONSE_II,
    AbstractOverlay,
    ResponsePrediction,
    SteppedSineOverlay,
    SweepOverlay,
)
from ..recordings.facts import RecordingFacts
from ..signals import Reals, envelope
from ..tables import ImageKind, Table, columns, table, write_csv

MEASURED = "#1b1b1b"
SIMULATED = "#d55e00"
"""Colour of simulations driven by the recorded voltage or base motion (vermillion of Okabe and Ito)."""
PREDICTED = "#0072b2"
"""Colour of predicted responses to sines (blue)."""
LINEAR = "#56b4e9"
"""Colour of the specimen without contact (sky blue, always dashed)."""
TERMINAL = "#8a3b7a"
"""Colour of resonances with m1 stuck to m2 (purple, always dotted)."""
BOUNDS = "#9a9a9a"
COLLIDING = "#d9d9d9"
LEVELS = ("#0072b2", "#009e73", "#d55e00", "#cc79a7", "#e69f00", "#56b4e9")
"""Colours of several levels in one figure, weak to strong; line styles differ too."""
LEVEL_STYLES = ("-", "--", "-.", ":", "-", "--")
SIMULATED_CURVE: Mapping[str, Any] = {
    "color": SIMULATED,
    "linewidth": 0.8,
    "linestyle": (0, (4, 2)),
    "zorder": 3.5,
}
"""Line style of a simulated curve that is drawn over a measured curve."""
LINEAR_CURVE: Mapping[str, Any] = {
    "color": LINEAR,
    "linestyle": "--",
    "linewidth": 1.0,
    "label": "without contact",
}

WIDTH_IN = 7.2
"""Width of figures [inches]; it fits the text width of an A4 page and a column of a report."""
PNG_DPI = 160
_EDGE = 1e-3
"""Relative margin at both ends of a frequency axis; measured frequencies differ from round values by ppm."""
_LINEAR_BELOW = 5.0
_FEW_MARKS_ABOVE = 60.0
"""Ratios of highest to lowest frequency below which an axis is linear (first) or has more ticks (second)."""
_FEW_DECADES = (1.5, 0.5)
"""Numbers of decades below which some (first) or all (second) ticks between powers of ten have labels."""
_POWERS_BELOW = 1e-3
_ROUNDING = 1e-9
_PREFIXES = ((1e-9, "n"), (1e-6, "µ"), (1e-3, "m"), (1.0, ""), (1e3, "k"))

STYLE: Mapping[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.labelsize": 9.0,
    "axes.titlesize": 9.0,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e3e3e3",
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.2,
    "lines.markersize": 4.0,
    "patch.linewidth": 0.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.fonttype": "path",
    "svg.hashsalt": "vibench",
    "path.simplify": True,
    "axes.formatter.useoffset": False,
}


@contextmanager
def figure_style() -> Iterator[None]:
    """Apply the style inside a ``with`` block only."""
    with mpl.rc_context(dict(STYLE)):
        yield


def plain_label(name: str) -> str:
    """Escape a text so that Matplotlib shows it unchanged, even with dollar signs."""
    return printable(name).replace("$", r"\$")


def new_figure(height_in: float) -> Figure:
    """Return a new figure of the common width and of ``height_in`` inches, laid out without overlaps."""
    figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


@contextmanager
def drawing(height_in: float) -> Iterator[Figure]:
    """Yield a `new_figure`, with the style inside the ``with`` block."""
    with figure_style():
        yield new_figure(height_in)


def legend_above(figure: Figure, axes: Sequence[Axes], columns: int = 3) -> None:
    """Draw one legend for all ``axes`` in ``columns`` above the ``figure``, where it covers no data."""
    found = {
        label: handle
        for each in axes
        for handle, label in zip(*each.get_legend_handles_labels(), strict=True)
    }
    figure.legend(list(found.values()), list(found), loc="outside upper left", ncols=columns)


def frequency_axis(axes: Axes, low_hz: float, high_hz: float) -> None:
    """Give ``axes`` a logarithmic frequency axis with ticks at 20, 50, ...; a narrow band stays linear."""
    axes.set_xlim(low_hz * (1 - _EDGE), high_hz * (1 + _EDGE))
    if high_hz < _LINEAR_BELOW * low_hz:
        return
    axes.set_xscale("log")
    digits = (1, 2, 3, 5, 7) if high_hz < _FEW_MARKS_ABOVE * low_hz else (1, 2, 5)
    marks = [digit * 10**power for power in range(5) for digit in digits]
    shown = [each for each in marks if low_hz * (1 - _EDGE) <= each <= high_hz * (1 + _EDGE)]
    axes.xaxis.set_major_locator(FixedLocator(shown))
    axes.xaxis.set_major_formatter(FuncFormatter(_plain))
    axes.xaxis.set_minor_locator(NullLocator())


def magnitude_axis(axes: Axes) -> None:
    """Give ``axes`` a logarithmic magnitude axis; a narrow range also has labels between powers of ten."""
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(FuncFormatter(_plain))
    axes.yaxis.set_minor_formatter(_Between(minor_thresholds=_FEW_DECADES))


class _Between(LogFormatter):
    """Formatter that labels the same ticks as Matplotlib's formatter, but writes 0.4 instead of 4e−01."""

    def __call__(self, value: float, place: int | None = None) -> str:
        return _plain(value) if super().__call__(value, place) else ""


def _plain(value: float, _place: int | None = None) -> str:
    if not 0 < value < _POWERS_BELOW:
        return f"{value:g}"
    power = math.floor(math.log10(value) + _ROUNDING)
    digits = f"{value / 10**power:.3g}"
    return f"$10^{{{power}}}$" if digits == "1" else f"${digits}\\cdot10^{{{power}}}$"


def with_prefix(largest: float, unit: str) -> tuple[float, str]:
    """Return a factor that scales ``largest`` [unit] to 1 ... 1000, and ``unit`` with its SI prefix."""
    fitting = [each for each in _PREFIXES if each[0] <= abs(largest)] or [_PREFIXES[0]]
    scale, prefix = fitting[-1]
    return 1 / scale, f"{prefix}{unit}"


_NO_DATE = {"Date": None}
_NO_PDF_DATE = {"CreationDate": None}
"""Metadata without dates, so that the same data give the same file."""


SCREEN = (ImageKind.PNG, ImageKind.SVG)


@dataclass(frozen=True, eq=False)
class DrawnFigure:
    """One figure, ready to be saved or put into a report."""

    name: str
    """Name of the files, without suffix."""
    title: str
    caption: str
    figure: Figure
    """Curves and texts of the figure; absent after `release`."""
    tables: tuple[Table, ...]

    png = cached_property[bytes](lambda self: self._render("png"))
    svg = cached_property[bytes](lambda self: self._render("svg"))
    pdf = cached_property[bytes](lambda self: self._render("pdf"))
    """The figure in each format; it is drawn only once."""

    def _render(self, kind: str) -> bytes:
        target = BytesIO()
        metadata = {"svg": _NO_DATE, "pdf": _NO_PDF_DATE}.get(kind)
        with figure_style():
            # The layout takes a third of the time. Compute it once; with an engine, savefig draws twice.
            if (layout := self.figure.get_layout_engine()) is not None:
                self.figure.set_dpi(PNG_DPI)
                layout.execute(self.figure)
                self.figure.set_layout_engine(None)
            self.figure.savefig(target, format=kind, dpi=PNG_DPI, metadata=metadata)
        return target.getvalue()

    def release(self) -> None:
        """Draw the images of a report, and free the figure, which takes megabytes; no PDF can follow."""
        for kind in SCREEN:
            getattr(self, kind.value)
        self.figure.clear()
        del self.__dict__["figure"]

    def save(self, folder: Path, kinds: Sequence[ImageKind] = SCREEN) -> tuple[Path, ...]:
        """Write the requested images, and the tables as CSV; replace older files of the same name."""
        folder.mkdir(parents=True, exist_ok=True)
        paths = [folder / f"{self.name}.{kind.value}" for kind in kinds]
        for path, kind in zip(paths, kinds, strict=True):
            with replace_file(path) as coming:
                coming.write_bytes(getattr(self, kind.value))
        return (*paths, *(write_csv(each, folder / f"{each.name}.csv") for each in self.tables))


ATTRIBUTES = {RESPONSE_I: "response_i", RESPONSE_II: "response_ii"}
"""Names of the attributes in which a result stores its responses to sines, keyed by response."""
RESPONSE_LABELS = {RESPONSE_I: "Response I\nmax |x| / A0", RESPONSE_II: "Response II\n|x at f| / A0"}


def draw_sines(axes: Axes, along: Reals, sines: ResponsePrediction, what: str, label: str) -> None:
    """Draw the response without contact as a line, and responses to steady sines as dots, over ``along``."""
    rising = np.argsort(along)
    axes.plot(along[rising], sines.linear[rising], **LINEAR_CURVE)
    axes.plot(along, getattr(sines, ATTRIBUTES[what]), ".", color=PREDICTED, label=label)


def simulated_label(run: SimulatedRun) -> str:
    """Return the legend label of the simulated curve."""
    if not run.driven.by_voltage:
        return "simulated from the recorded base motion"
    return "simulated from the recorded voltage"


def draw_band(
    axes: Axes,
    along: Reals,
    overlay: AbstractOverlay[Any],
    name: str,
    shown: Callable[[Reals], Reals] = lambda values: values,
) -> Reals | None:
    """Draw the 95 % band of one quantity as an area, and return its median; None without several draws.

    ``along`` contains the abscissae of the quantity; ``shown`` converts the quantity's values to axis values.
    """
    found = overlay.quantity(name)
    if found is None or overlay.run.draws == 1:
        return None
    # The number of draws differs between recordings: the caption states the number, the label does not.
    look: dict[str, Any] = {"color": SIMULATED, "alpha": 0.25, "zorder": 1.5, "label": "95 % of draws"}
    axes.fill_between(along, shown(found.lower), shown(found.upper), **look)
    return shown(found.median)


def run_text(overlay: AbstractOverlay[Any]) -> str:
    """Return sentences on the simulation, and on the position of the measurement among the simulated runs."""
    run = overlay.run
    if not run.driven.by_voltage:
        why = f" ({run.why})" if run.why else ""
        return (
            f"Simulated from the recorded base motion{why}, {run.impact_rate_hz:.0f} impacts per second: "
            f"median difference {overlay.difference.median_abs_db:.2g} dB, "
            f"{100 * overlay.difference.share_within_two:.0f} % of the values within two standard errors. "
            "Simulated impacts do not move the recorded base, so simulated chaos differs from measured chaos."
        )
    parts = [
        (
            f"Rig and specimen simulated together from the {run.driven.value}, {run.draws} draws from "
            f"slightly different initial states, {run.impact_rate_hz:.0f} impacts per second"
        ),
        *overlay.agreement,
    ]
    ending = [] if overlay.escape is None else [overlay.escape.sentence]
    known = [run.why] if run.why else []
    return ". ".join(["; ".join(parts), *ending, *known]) + "."


def agreement_text(overlay: AbstractOverlay[Any]) -> str:
    """Return the end of a sentence: agreement and escape rate; empty if base motion drives the simulation."""
    if not overlay.run.driven.by_voltage:
        return ""
    parts = [*overlay.agreement]
    if overlay.escape is not None:
        parts.append(overlay.escape.sentence)
    return "".join(f"; {each}" for each in parts)


def sines_table(name: str, sines: ResponsePrediction) -> Table:
    """Return a table of the responses to steady sines."""
    keys = "frequency_hz amplitude_m response_i response_ii linear impacts"
    return table(f"{name}_sines", **columns(sines, keys))


def band_columns(overlay: AbstractOverlay[Any], name: str, column: str) -> dict[str, Reals]:
    """Return columns with median, band, z and rank of a simulated quantity; empty without several draws."""
    found = overlay.quantity(name)
    if found is None or overlay.run.draws == 1:
        return {}
    return {
        f"{column}_draws_median": found.median,
        f"{column}_draws_lower": found.lower,
        f"{column}_draws_upper": found.upper,
        f"{column}_z": found.z,
        f"{column}_rank": found.rank.astype(np.float64),
    }


def simulated_responses(overlay: SweepOverlay | SteppedSineOverlay) -> dict[str, Reals]:
    """Return table columns of simulated responses to sines, with median and band of the simulated runs."""
    return {
        **columns(overlay.response, "response_i_simulated=response_i response_ii_simulated=response_ii"),
        **band_columns(overlay, RESPONSE_I, "response_i"),
        **band_columns(overlay, RESPONSE_II, "response_ii"),
    }


_LABEL_HEIGHT = 1.01
"""Height of frequency labels just above the panel, relative to the panel height."""
_FREE_LABEL = "resonances without contact"
_BOUND_LABEL = "terminal resonances (m1 stuck to m2)"


def mark_resonances(axes: Axes, of: Specimen, *, without_contact: bool = True) -> None:
    """Draw dashed lines at resonances without contact, and dotted lines at those with m1 stuck to m2."""
    look: dict[str, Any] = {"linestyle": "--", "linewidth": 0.8, "label": _FREE_LABEL, "zorder": 1}
    for frequency in of.natural_frequencies_hz if without_contact else ():
        axes.axvline(frequency, color=BOUNDS, **look)
    look |= {"linestyle": ":", "linewidth": 1.0, "label": _BOUND_LABEL}
    for frequency in of.bound_frequencies_hz:
        axes.axvline(frequency, color=TERMINAL, **look)


def label_resonances(axes: Axes, of: Specimen, *, without_contact: bool = True) -> None:
    """Write the frequencies of the resonances above the panel."""
    low, high = axes.get_xlim()
    place: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "ha": "center", "va": "bottom"}
    free_hz = of.natural_frequencies_hz if without_contact else ()
    for frequencies_hz, colour in ((free_hz, "#555555"), (of.bound_frequencies_hz, TERMINAL)):
        for frequency in frequencies_hz:
            if low <= frequency <= high:
                axes.text(frequency, _LABEL_HEIGHT, f"{frequency:.0f}", fontsize=7, color=colour, **place)


_CHANNEL_IN = 0.85
_FRAME_IN = 0.6
_UNITS = {"m s-1": "m/s", "m s-2": "m/s²"}
"""Readable forms of units that files state in UDUNITS notation."""


def bench_levels_figure(facts: RecordingFacts) -> DrawnFigure:
    """Draw the smallest and largest values of every channel over the whole recording."""
    peaks = []
    columns = {"time_s": facts.channels[0].envelope.time_s}
    with drawing(_FRAME_IN + _CHANNEL_IN * len(facts.channels)) as figure:
        panels = figure.subplots(len(facts.channels), 1, sharex=True, squeeze=False)[:, 0]
        for axes, level in zip(panels, facts.channels, strict=True):
            factor, unit = with_prefix(level.peak, _UNITS.get(level.header.unit, level.header.unit))
            role, shape = level.header.role, level.envelope
            share = f"{100 * level.share_of_range:.2g} % of its range"
            peaks.append(f"{role.replace('_', ' ')} {factor * level.peak:.3g} {unit} ({share})")
            columns |= {f"{role}_lower": shape.lower, f"{role}_upper": shape.upper}
            axes.fill_between(
                shape.time_s, factor * shape.lower, factor * shape.upper, color=MEASURED, linewidth=0.3
            )
            title = plain_label(role).replace("_", "\n")
            axes.set_ylabel(f"{title}\n[{plain_label(unit)}]", fontsize=7.5)
        panels[-1].set(xlabel="time since the first sample [s]", xlim=(0, facts.duration_s))
        figure.align_ylabels()
    return DrawnFigure(
        name=f"levels_{facts.name}",
        title="Levels of all channels",
        caption=f"Extremes of every channel, including ramps and waits. Peaks: {', '.join(peaks)}.",
        figure=figure,
        tables=(table(f"levels_{facts.name}", **columns),),
    )


_EXCITATION_HEIGHT_IN = 2.3
_SAMPLES_PER_CYCLE = 8
"""Samples per period of the highest frequency: enough for a figure, and few enough for a long sweep."""
_SMALLEST_PART = 0.2
"""The frequency axis contains all spectral lines above this fraction of the largest line (-14 dB)."""
_EXCITATION_COLUMNS = 2000


def excitation_figure(measurement: Measurement) -> DrawnFigure:
    """Draw the planned voltage over time, and its spectrum."""
    excitation = measurement.excitation
    rate_hz = _SAMPLES_PER_CYCLE * excitation.highest_frequency_hz
    seen = excitation.preview(rate_hz)
    shape = envelope(seen.volts, rate_hz)
    frequency_hz, size = _largest_lines(seen)
    strong = np.flatnonzero(size > _SMALLEST_PART * float(np.max(size)))
    with drawing(_EXCITATION_HEIGHT_IN) as figure:
        signal, spectrum = figure.subplots(1, 2)
        factor, unit = with_prefix(seen.peak_v, "V")
        signal.fill_between(
            shape.time_s, factor * shape.lower, factor * shape.upper, color=PREDICTED, linewidth=0.3
        )
        signal.set(xlim=(0, float(shape.time_s[-1])), xlabel="time [s]", ylabel=f"planned voltage [{unit}]")
        factor, unit = with_prefix(float(np.max(size)), "V")
        spectrum.plot(frequency_hz, factor * size, color=PREDICTED, linewidth=0.8)
        frequency_axis(spectrum, 0.8 * float(frequency_hz[strong[0]]), 1.25 * float(frequency_hz[strong[-1]]))
        spectrum.set(ylim=(0, None), xlabel="frequency [Hz]", ylabel=f"amplitude of a line [{unit}]")
    name = f"excitation_{measurement.name}"
    return DrawnFigure(
        name=name,
        title="Excitation as planned",
        caption=(
            f"{excitation.kind.replace('_', ' ')} at {excitation.amplitude_vpp:g} Vpp: {seen.rms_v:.3g} V "
            f"rms, crest factor {seen.peak_v / seen.rms_v:.3g}, {seen.duration_s:.4g} s including waits."
        ),
        figure=figure,
        tables=(
            table(f"{name}_signal", time_s=shape.time_s, lower_v=shape.lower, upper_v=shape.upper),
            table(f"{name}_spectrum", frequency_hz=frequency_hz, amplitude_v=size),
        ),
    )


def _largest_lines(seen: SignalPreview) -> tuple[Reals, Reals]:
    """Return frequency and amplitude of the largest spectral line, except at 0 Hz, in each column."""
    frequency_hz, size = seen.frequency_hz[1:], seen.spectrum_v[1:]
    width = -(-size.size // _EXCITATION_COLUMNS)
    starts = np.arange(0, size.size, width)
    places = np.array([first + int(np.argmax(size[first : first + width])) for first in starts])
    return frequency_hz[places], size[places]
