"""Lyapunov exponents and Kaplan-Yorke dimension over frequency or level, with intervals."""

import numpy as np
from matplotlib.axes import Axes

from vibench.sim import Parameter

from ..dynamics import ExponentSpectrum
from ..signals.arrays import Reals
from ..tables import Table, rows, table
from . import style

_HEIGHT_IN = 5.2


def exponent_spectrum_figure(found: ExponentSpectrum) -> style.DrawnFigure:
    """Draw six exponents with their intervals, and below them the Kaplan-Yorke dimension."""
    request = found.request
    is_frequency = request.along is Parameter.FREQUENCY
    place = found.column("frequency_hz") if is_frequency else 1e6 * found.column("amplitude_m")
    with style.styled():
        figure = style.new_figure(_HEIGHT_IN)
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0))
        _exponents(upper, place, found)
        _dimension(lower, place, found)
        lower.set_xlabel("drive frequency [Hz]" if is_frequency else "base amplitude A0 [µm]")
        style.legend_above(figure, [upper], columns=6)
        figure.align_ylabels()
    return style.DrawnFigure(
        name="spectrum",
        title=f"All exponents: {request.title}",
        caption=(
            f"Lyapunov exponents of the motion that a run from rest ends in; bars: {request.confidence:.0%} "
            f"intervals. Below: Kaplan and Yorke's dimension. {found.cost_sentence} "
            f"{request.specimen_text}, "
            f"{request.accuracy.value} accuracy, {request.duration_s:g} s after {request.settle_s:g} s."
        ),
        figure=figure,
        tables=(_numbers(found),),
    )


def _exponents(axes: Axes, place: Reals, found: ExponentSpectrum) -> None:
    values, low, high = (found.column(name) for name in ("exponents_per_s", "low_per_s", "high_per_s"))
    for k in range(values.shape[1]):
        known = np.isfinite(values[:, k])
        if not known.any():
            continue
        reach = np.abs(np.stack([values[known, k] - low[known, k], high[known, k] - values[known, k]]))
        colour, label, reach = style.LEVELS[k], f"λ{k + 1}", np.nan_to_num(reach)
        axes.errorbar(
            place[known], values[known, k], reach, fmt=".-", linewidth=0.9, color=colour, label=label
        )
    axes.axhline(0.0, color=style.BOUNDS, linewidth=0.7)
    axes.set_ylabel("exponent [1/s]")


def _dimension(axes: Axes, place: Reals, found: ExponentSpectrum) -> None:
    middle, low, high = (found.column(n) for n in ("dimension", "dimension_low", "dimension_high"))
    reach = np.nan_to_num(np.abs(np.stack([middle - low, high - middle])))
    axes.errorbar(place, middle, reach, fmt=".-", color=style.MEASURED, linewidth=0.9)
    axes.set_ylabel("dimension")


def _numbers(found: ExponentSpectrum) -> Table:
    values, low, high = (found.column(name) for name in ("exponents_per_s", "low_per_s", "high_per_s"))
    six = {
        f"{name}_{k + 1}_per_s": columns[:, k]
        for name, columns in (("exponent", values), ("low", low), ("high", high))
        for k in range(values.shape[1])
    }
    return table(
        "spectrum",
        **rows(found.points, "frequency_hz amplitude_m"),
        **six,
        **rows(found.points, "sum_per_s dampers_per_s dimension dimension_low dimension_high"),
    )
