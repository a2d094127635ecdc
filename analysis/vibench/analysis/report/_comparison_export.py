"""Export of a comparison: figure, table, or the full report of its recordings."""

from collections.abc import Sequence
from enum import StrEnum
from itertools import chain, count
from pathlib import Path

import numpy as np

from vibench.sim.operating_system.this import replace_file

from ..comparison import Curve, curve_difference
from ..errors import InvalidRequest
from ..figures.comparison import comparison_figure
from ..results.campaign_results import CampaignResults, without_copies
from ..results.compared_recording import ComparedRecording, stored_result
from ..tables import Table, write_csv
from ._report import write_report

Pair = tuple[Curve, Curve]


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
