"""Claims by setting: a table over named settings, and a score over damping."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vibench.analysis import report
from vibench.sim import gong2025

from .claim import Claim, finding
from .exponent_claims import NEAR_ZERO_PER_S, SEVERE_PER_S
from .options import ALIKE, BY_ODE45, CLOSEST, SCORED_S, Case, damping, together
from .reading import MODERATE_M, WEAK_M, Evidence, Reading

SETTINGS = (damping(1e-5), damping(4e-5), ALIKE, BY_ODE45, together(damping(4e-5), BY_ODE45))
"""Named settings, in addition to the defaults."""
_LINEAR_PER_S = 10.0
"""Linear range of the exponent axis around zero."""


@dataclass(frozen=True)
class DampingScore:
    """The claims that hold at one damping."""

    damping_time_s: float
    held: tuple[str, ...]
    failed: tuple[str, ...]
    weak_exponent_per_s: float
    """Largest exponent over frequency at 1 um; near zero in the paper."""
    moderate_exponent_per_s: float
    """Largest exponent over frequency at 5 um; above 100 in the paper."""


def holds_from_rest(claim: Claim, evidence: Evidence, case: Case) -> bool:
    """Return whether a claim holds for the motion from rest."""
    return finding(replace(claim, draws=1), evidence, case).is_met


def scores(claims: Sequence[Claim], evidence: Evidence, case: Case) -> tuple[DampingScore, ...]:
    """Measure every scored claim at every damping; the case gives all other options."""
    found = []
    for damping_time_s in SCORED_S:
        at = damping(damping_time_s).of(case)
        is_met = {each.key: holds_from_rest(each, evidence, at) for each in claims if each.is_scored}
        weak, moderate = (
            float(np.nanmax(Reading(evidence, at).exponents(each))) for each in (WEAK_M, MODERATE_M)
        )
        held = tuple(key for key, met in is_met.items() if met)
        failed = tuple(key for key, met in is_met.items() if not met)
        found.append(DampingScore(damping_time_s, held, failed, weak, moderate))
    return tuple(found)


def score_table(scores: Sequence[DampingScore]) -> report.ReportTable:
    """Return a table of the score over damping, with the claims that do not hold."""
    first, second, third = (f"{each:.2g}" for each in gong2025(0.01).damping_ratios)
    most = max(len(each.held) for each in scores)
    best = ", ".join(f"{each.damping_time_s:.3g} s" for each in scores if len(each.held) == most)
    always = [key for key in scores[0].failed if all(key in each.failed for each in scores)]
    return report.ReportTable(
        "Score by damping",
        ("c / k", "claims that hold", "largest exponent at 1 µm [1/s]", "at 5 µm [1/s]", "others that fail"),
        tuple(
            (
                f"{each.damping_time_s:.3g} s",
                f"{len(each.held)} of {len(each.held) + len(each.failed)}",
                f"{each.weak_exponent_per_s:.3g}",
                f"{each.moderate_exponent_per_s:.3g}",
                ", ".join(key for key in each.failed if key not in always),
            )
            for each in scores
        ),
        f"In SI units, the paper's c = 0.01 k gives damping ratios of {first}, {second} and {third}; above 1 "
        f"a mode does not oscillate. In mm, g and ms, c / k is 1e-05 s. The table counts the claims that "
        f"are quick to compute; this count is highest at {best}. "
        f"Claims that fail at every damping: {', '.join(always) or 'none'}.",
    )


def score_figure(scores: Sequence[DampingScore]) -> report.DrawnFigure:
    """Draw the score, and the largest exponents at 1 and 5 um, over damping."""
    damping_s = np.array([each.damping_time_s for each in scores])
    held = np.array([len(each.held) for each in scores])
    count = len(scores[0].held) + len(scores[0].failed)
    weak = np.array([each.weak_exponent_per_s for each in scores])
    moderate = np.array([each.moderate_exponent_per_s for each in scores])
    with report.figure_style():
        figure = report.new_figure(4.6)
        top, low = figure.subplots(2, 1, sharex=True)
        top.plot(1e6 * damping_s, held, color=report.MEASURED, marker="o")
        top.set(ylim=(0, count), ylabel=f"claims that hold, of {count}")
        low.set_yscale("symlog", linthresh=_LINEAR_PER_S)  # before plotting: margins depend on the scale
        for values, label, colour, marker in (
            (weak, "1 µm: near zero in the paper", report.LEVELS[0], "o"),
            (moderate, "5 µm: above 100 in the paper", report.SIMULATED, "s"),
        ):
            low.plot(1e6 * damping_s, values, color=colour, marker=marker, label=label)
        for bound in (NEAR_ZERO_PER_S, SEVERE_PER_S):
            low.axhline(bound, color=report.TERMINAL, linestyle=":", linewidth=1.0)
        low.set(ylabel="largest exponent [1/s]", xlabel="c / k [µs]")
        low.legend()
    columns = {"claims_that_hold": held, "exponent_1um_per_s": weak, "exponent_5um_per_s": moderate}
    return report.DrawnFigure(
        name="reproduction_damping",
        title="Claims that hold, by damping",
        caption="Dotted: upper bound of exponents near zero, lower bound of exponents called severe.",
        figure=figure,
        tables=(report.table("reproduction_damping", damping_time_s=damping_s, **columns),),
    )


def claims_by_setting(claims: Sequence[Claim], evidence: Evidence, case: Case) -> report.ReportTable:
    """Return the claims that hold from rest with each setting, except those that hold with all settings."""
    settings = [case, *(each.of(case) for each in SETTINGS), CLOSEST.of(case)]
    rows = []
    for claim in claims:
        # For claims on continuous models, the intermediate settings would take too long.
        claim_settings = settings if claim.is_scored else [settings[0], settings[-1]]
        held = {
            each.name: "holds" if holds_from_rest(claim, evidence, each) else "fails"
            for each in claim_settings
        }
        rows.append([held.get(each.name, "") for each in settings])
    totals = [f"{each.count('holds')} of {len(each) - each.count('')}" for each in zip(*rows, strict=True)]
    kept = [(claim.key, *row) for claim, row in zip(claims, rows, strict=True) if "fails" in row]
    return report.ReportTable(
        "Claims by setting",
        ("claim", *(each.name for each in settings)),
        (("hold", *totals), *kept),
        "All runs start from rest. Claims that hold under every setting are counted in the first row only. "
        "Claims on continuous models take too long to compute for every setting; their cells are empty.",
    )
