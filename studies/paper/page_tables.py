"""Tables of the page beside the claims: colliding regions, similarity rates, and the score by damping."""

from collections.abc import Sequence

import numpy as np

from vibench.analysis.report import ReportTable
from vibench.sim import gong2025

from .case import Case
from .evidence import PIECE_WISE, Evidence, level
from .options import AMPLITUDES_M
from .responses import Flags, Reals
from .score import DampingScore
from .similarity_claims import EXTREME_ORDERS, FIRST, SECOND, orders, rates

SI_READING_S = 0.01
"""c_i = 0.01 k_i, as the paper prints it, in SI units."""


def regions_table(evidence: Evidence, case: Case) -> ReportTable:
    """Where m1 and m2 collide, at each amplitude."""
    rows = []
    for amplitude_m in AMPLITUDES_M:
        curve = level(evidence, case, amplitude_m, PIECE_WISE)
        found = regions(curve.frequency_hz, curve.collides)
        rows.append(
            (
                f"{1e6 * amplitude_m:g} µm",
                ", ".join(_span(*each) for each in found) or "nowhere",
                f"{np.mean(curve.collides):.0%}",
            )
        )
    return ReportTable(
        "Where collisions begin and end",
        ("A0", "colliding [Hz]", "of the grid"),
        tuple(rows),
        f"Frequencies, on a grid of {case.options.grid.step_hz:g} Hz, at which m1 and m2 collided within "
        "the last 5 s of 30 s from rest. The paper's text gives no numbers for the shaded regions of Fig. 3.",
    )


def regions(frequency_hz: Reals, collides: Flags) -> tuple[tuple[float, float], ...]:
    """First and last colliding frequency of every run of neighbours."""
    changes = np.flatnonzero(np.diff(np.concatenate(([False], collides, [False])).astype(np.int8)))
    return tuple(
        (float(frequency_hz[first]), float(frequency_hz[last - 1])) for first, last in changes.reshape(-1, 2)
    )


def _span(low_hz: float, high_hz: float) -> str:
    return f"{low_hz:g}" if low_hz == high_hz else f"{low_hz:g}–{high_hz:g}"


def rates_table(evidence: Evidence, case: Case) -> ReportTable:
    """Give the similarity rate of every continuous model at every amplitude."""
    rows = tuple(
        (
            model.removeprefix("power:"),
            *(f"{each:.0%}" for what in (FIRST, SECOND) for each in rates(evidence, case, model, what)),
        )
        for model in (*orders(case), *EXTREME_ORDERS)
    )
    options = case.options
    named = [f"{title}, {1e6 * each:g} µm" for title in ("I", "II") for each in AMPLITUDES_M]
    return ReportTable(
        "Similarity rates",
        ("n", *named),
        rows,
        f"Eqs. 6 and 7 with log10 of the response [{options.logarithm_of.value}], a difference of at most "
        f"{options.threshold:.0%}, up to {options.similarity_highest_hz:g} Hz.",
    )


def score_table(scores: Sequence[DampingScore]) -> ReportTable:
    """Give the score by damping."""
    ratios = gong2025(SI_READING_S).damping_ratios
    most = max(len(each.held) for each in scores)
    best = ", ".join(f"{each.damping_time_s:.3g} s" for each in scores if len(each.held) == most)
    return ReportTable(
        "Score by damping",
        ("c / k", "hold", "largest exponent at 1 µm [1/s]", "at 5 µm [1/s]", "do not hold"),
        tuple(
            (
                f"{each.damping_time_s:.3g} s",
                f"{len(each.held)} of {len(each.held) + len(each.failed)}",
                f"{each.weak_exponent_per_s:.3g}",
                f"{each.moderate_exponent_per_s:.3g}",
                ", ".join(each.failed),
            )
            for each in scores
        ),
        f"The paper's c = 0.01 k, read in SI units, would make the damping ratios {_listed(ratios)}; "
        "above 1 a mode does not oscillate. Read in mm, g and ms it is 1e-05 s. Of the claims that are "
        f"measured at every damping, most hold at {best}.",
    )


def _listed(values: Reals) -> str:
    *first, last = (f"{each:.2g}" for each in values)
    return f"{', '.join(first)} and {last}"
