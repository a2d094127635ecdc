"""Style of all figures: sizes, and colours that colour-blind readers can distinguish."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, LogFormatter, NullLocator

from vibench.acquisition import printable
from vibench.sim.operating_system.this import replace_file

from ..tables import ImageKind, Table, write_csv

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
    """Return a factor that scales ``largest`` to between 1 and 1000, and the unit with its SI prefix."""
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
