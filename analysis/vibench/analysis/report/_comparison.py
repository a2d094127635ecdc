"""Export of a comparison: figure in light colours for printing, table, or full report of the recordings."""

from collections.abc import Mapping, Sequence
from enum import StrEnum
from itertools import chain, count
from pathlib import Path
from typing import TypeAlias

import numpy as np
from matplotlib.axes import Axes

from vibench.acquisition import printable
from vibench.sim.operating_system.this import replace_file

from ..comparison import Curve, CurveKind, CurveOrigin, curve_difference, curve_peaks
from ..errors import InvalidRequest
from ..results.campaign_results import CampaignResults, without_copies
from ..results.compared_recording import ComparedRecording, stored_result
from ..tables import Table, columns, rows, table, write_csv
from . import _style as style
from ._report import write_report

Pair = tuple[Curve, Curve]
Dashes: TypeAlias = str | tuple[int, tuple[int, ...]]
_HEIGHT_IN = 4.6
_DIFFERENCE_IN = 1.4
_STYLES: Mapping[CurveOrigin, tuple[Dashes, Dashes]] = {
    CurveOrigin.MEASURED: ("-", ":"),
    CurveOrigin.SIMULATED: ("--", "-."),
    CurveOrigin.PREDICTED: ((0, (9, 3)), (0, (5, 2, 1, 2, 1, 2))),
    CurveOrigin.STABLE: ("-", ":"),
    CurveOrigin.UNSTABLE: ("--", "-."),
    CurveOrigin.UNDECIDED: ((0, (1, 3)), (0, (5, 2, 1, 2, 1, 2))),
}
"""Line styles by origin: the first for transmission and Response I, the second for Response II."""
_LONE = 1
"""Maximum number of points of a curve that is drawn with markers."""
_SINGLE_BAND = 0.2


def comparison_figure(
    name: str,
    curves: Sequence[Curve],
    pair: Pair | None = None,
    markers_hz: Sequence[float] = (),
) -> style.DrawnFigure:
    """Draw curves with their bounds, the difference of two curves, and vertical markers.

    Raises InvalidRequest when there is no curve, and NotEnoughData when the pair has no frequency in common.

    Parameters
    ----------
    name
        Name of the files, without suffix.
    pair
        A curve and its reference; their difference is drawn below the curves.
    """
    if not curves:
        raise InvalidRequest("a figure without curves was requested; choose one or more curves")
    difference = None if pair is None else curve_difference(*pair)
    count = 1 if difference is None else 2
    with style.drawing(_HEIGHT_IN + (count - 1) * _DIFFERENCE_IN) as figure:
        panels = figure.subplots(count, 1, sharex=True, height_ratios=(3.2, 1.0)[:count], squeeze=False)[:, 0]
        top: Axes = panels[0]
        sources = list(dict.fromkeys(each.source for each in curves))
        for curve in curves:
            _curve(top, curve, style.LEVELS[sources.index(curve.source) % len(style.LEVELS)])
        style.magnitude_axis(top)
        top.set(ylim=_heights(curves), ylabel="|x / U|  (m0 over base)")
        if difference is not None and pair is not None:
            panels[1].plot(difference.frequency_hz, difference.decibel, color=style.MEASURED, linewidth=0.8)
            panels[1].axhline(0, color=style.BOUNDS, linewidth=0.6)
            panels[1].set_ylabel("difference\n[dB]")
        for marker_hz in markers_hz:
            for axes in panels:
                axes.axvline(marker_hz, color=style.BOUNDS, linewidth=0.8, linestyle="-.")
        panels[-1].set_xlabel("frequency [Hz]")
        low_hz = min(float(np.min(each.frequency_hz)) for each in curves)
        high_hz = max(float(np.max(each.frequency_hz)) for each in curves)
        margin = 0.0 if high_hz > low_hz else _SINGLE_BAND
        style.frequency_axis(top, low_hz * (1 - margin), high_hz * (1 + margin))
        style.legend_above(figure, [top], columns=2)
        figure.align_ylabels()
    return style.DrawnFigure(
        name=name,
        title="Comparison",
        caption=comparison_caption(curves, pair),
        figure=figure,
        tables=comparison_tables(name, curves, pair),
    )


def _curve(axes: Axes, curve: Curve, colour: str) -> None:
    lone = curve.frequency_hz.size <= _LONE
    known = np.isfinite(curve.relative_sd)
    if known.any() and not lone:
        axes.fill_between(curve.frequency_hz, curve.lower, curve.upper, color=colour, alpha=0.18, where=known)
    axes.plot(
        curve.frequency_hz,
        curve.magnitude,
        color=colour,
        linestyle="none" if lone else _STYLES[curve.origin][curve.response is CurveKind.RESPONSE_II],
        marker="o" if lone else None,
        linewidth=1.0,
        label=style.plain_label(curve.name),
        gid=printable(curve.name),
    )


def _heights(curves: Sequence[Curve]) -> tuple[float, float]:
    """Return limits of the magnitude axis that fit the curves; bounds may exceed these limits."""
    known = np.concatenate([each.magnitude[np.isfinite(each.magnitude)] for each in curves])
    positive = known[known > 0]
    return (float(positive.min()) / 2, 2 * float(positive.max())) if positive.size else (0.1, 10.0)


def comparison_caption(curves: Sequence[Curve], pair: Pair | None) -> str:
    """Return the caption: the note of each curve, and the difference between the pair's curves."""
    sentences = [f"{each.name}: {each.note}." if each.note else f"{each.name}." for each in curves]
    sentences.append("Shaded: two standard deviations.")
    if pair is not None:
        difference = curve_difference(*pair)
        sentences.append(
            f"Difference between {pair[0].name} and {pair[1].name}: median {difference.median_abs_db:.2g} "
            f"dB, root mean square {difference.rms_db:.2g} dB."
        )
    return " ".join(sentences)


def comparison_tables(name: str, curves: Sequence[Curve], pair: Pair | None = None) -> tuple[Table, ...]:
    """Return tables of every curve, of its peaks, and of the difference of the pair."""
    found = [
        table(
            f"{name}_{number}_{_file_word(curve)}",
            **columns(
                curve,
                "frequency_hz magnitude_displacement_over_displacement=magnitude "
                "relative_standard_deviation=relative_sd",
            ),
        )
        for number, curve in enumerate(curves, start=1)
    ]
    peaks = [(curve.name, peak) for curve in curves for peak in curve_peaks(curve)]
    if peaks:
        found.append(
            table(
                f"{name}_peaks",
                curve=[label for label, _ in peaks],
                **rows([each for _, each in peaks], "frequency_hz magnitude half_power_width_hz"),
            )
        )
    if pair is not None:
        keys = "frequency_hz difference_db=decibel standard_errors"
        found.append(table(f"{name}_difference", **columns(curve_difference(*pair), keys)))
    return tuple(found)


def _file_word(curve: Curve) -> str:
    kept = (each if each.isalnum() or each in "-_" else "_" for each in curve.name.replace(", ", "_"))
    return "".join(kept)


class ExportKind(StrEnum):
    """Export formats of a comparison; the value is the file suffix."""

    PNG = "png"
    SVG = "svg"
    PDF = "pdf"
    CSV = "csv"
    HTML = "html"
    """Full report of the compared recordings."""


def write_comparison(
    path: Path,
    curves: Sequence[Curve],
    recordings: Sequence[ComparedRecording],
    pair: Pair | None = None,
    markers_hz: Sequence[float] = (),
) -> Path:
    """Write a comparison as a report, a table or a picture; return the path of the file.

    Raises InvalidRequest when the suffix is unknown, or there is nothing to write.

    Parameters
    ----------
    path
        The suffix selects the format: ``.html``, ``.csv``, ``.png``, ``.svg`` or ``.pdf``. If the file
        exists, ``NAME-2`` is written.
    curves
        Curves of the table and the pictures, over frequency [Hz].
    recordings
        Recordings for the report.
    pair
        Two of the curves, whose difference is also shown.
    markers_hz
        Frequencies of vertical lines in pictures [Hz].
    """
    try:
        kind = ExportKind(path.suffix.removeprefix(".").lower())
    except ValueError as unknown:
        allowed = ", ".join(f".{each.value}" for each in ExportKind)
        raise InvalidRequest(f"{path.name!r} was given; its suffix must be one of {allowed}") from unknown
    target = first_free_path(path)
    match kind:
        case ExportKind.HTML:
            _report(target, recordings)
        case ExportKind.CSV:
            write_csv(comparison_table(target.stem, curves, pair), target)
        case _:
            drawn = comparison_figure(target.stem, curves, pair, markers_hz)
            with replace_file(target) as coming:
                coming.write_bytes(getattr(drawn, kind.value))
    return target


def _report(target: Path, recordings: Sequence[ComparedRecording]) -> None:
    if not recordings:
        raise InvalidRequest("a report without recordings was requested; add a recording to the comparison")
    kept = [stored_result(each) for each in recordings]
    failures = tuple(failure for _, failed in kept for failure in failed)
    results = without_copies([result for result, _ in kept])
    write_report(CampaignResults(target.stem, results, failures), target)


def comparison_table(name: str, curves: Sequence[Curve], pair: Pair | None) -> Table:
    """Return all curves in one table; each heading names a curve and a unit."""
    if not curves:
        raise InvalidRequest("a table without curves was requested; choose one or more curves")
    columns: list[tuple[str, tuple[float | str, ...]]] = []
    for each in curves:
        columns += [
            (f"frequency [Hz] ({each.name})", _cells(each.frequency_hz)),
            (f"|x / U| [1] ({each.name})", _cells(each.magnitude)),
            (f"relative standard deviation [1] ({each.name})", _cells(each.relative_sd)),
        ]
    if pair is not None:
        difference = curve_difference(*pair)
        names = f"{pair[0].name} over {pair[1].name}"
        columns += [
            (f"frequency [Hz] ({names})", _cells(difference.frequency_hz)),
            (f"difference [dB] ({names})", _cells(difference.decibel)),
        ]
    return Table(name, tuple(columns))


def _cells(values: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]") -> tuple[float | str, ...]:
    return tuple(float(value) if np.isfinite(value) else "" for value in values)


def first_free_path(path: Path) -> Path:
    """Return the first of ``NAME.svg``, ``NAME-2.svg``, ... that does not exist yet."""
    numbered = (path.with_name(f"{path.stem}-{number}{path.suffix}") for number in count(2))
    return next(each for each in chain((path,), numbered) if not each.exists())
