"""What holds under which setting: claims by setting, and what cannot hold together, as tables of the page."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vibench.analysis.report import ReportTable
from vibench.sim import Harmonic, Specimen, base_transmissibility

from .case import ALIKE, BY_ODE45, CLOSEST, SCORED_S, Alternative, Case, damping, together
from .claim import Claim, found
from .evidence import MODERATE_M, Evidence, level, specimen_under
from .responses import drive_at
from .textbook_methods import (
    TextbookMethod,
    ode45,
    runge_kutta,
    textbook_exponent,
    textbook_state,
)

SETTINGS: tuple[Alternative, ...] = (
    damping(1e-5),
    damping(4e-5),
    ALIKE,
    BY_ODE45,
    together(damping(4e-5), BY_ODE45),
)
"""Beside the defaults."""
_HOLDS, _FAILS, _NOT_ASKED = "holds", "fails", ""
FIRST_REGION_HZ, SECOND_REGION_HZ = (90.0, 95.0, 100.0, 105.0), (250.0, 260.0, 270.0, 280.0)
"""Where exponents are shown side by side."""
_NEAR_HZ, _SECOND_HZ = np.arange(80.0, 110.0, 0.01), np.arange(230.0, 310.0, 0.01)
SPEEDS = (0.03, 0.1, 0.3)
"""Of approach in the impacts at these drives, about [m/s]."""
STEPS_S = (2e-5, 1e-5, 5e-6)
SHOWN_HZ = 260.0
_PHASES = 50
"""Of a step in which a contact begins."""


def claims_by_setting(claims: Sequence[Claim], evidence: Evidence, case: Case) -> ReportTable:
    """Say which claims hold under which setting: those that do not hold under all, from rest."""
    settings = [case, *(each.of(case) for each in SETTINGS), CLOSEST.of(case)]
    rows = []
    for claim in claims:
        asked = [each for each in settings if claim.is_scored or each in (settings[0], settings[-1])]
        said = {each.name: _verdict(claim, evidence, each) for each in asked}
        rows.append((claim.key, *(said.get(each.name, _NOT_ASKED) for each in settings)))
    columns = list(zip(*rows, strict=True))[1:]
    totals = (f"{each.count(_HOLDS)} of {len(rows) - each.count(_NOT_ASKED)}" for each in columns)
    kept = tuple(row for row in rows if _FAILS in row)
    return ReportTable(
        "Claims by setting",
        ("claim", *(each.name for each in settings)),
        (("hold", *totals), *kept),
        "From rest alone. Claims that hold under every setting are left out, but counted in the first row. "
        "An empty cell was not computed: claims on continuous models take too long.",
    )


def _verdict(claim: Claim, evidence: Evidence, case: Case) -> str:
    return _HOLDS if found(replace(claim, draws=1), evidence, case).is_met else _FAILS


def reach_table(case: Case) -> ReportTable:
    """Say when m1 first reaches its stops at 1 um, and between which frequencies it does at 5 um."""
    rows = []
    for setting in (*(damping(each) for each in SCORED_S), ALIKE):
        specimen = specimen_under(setting.of(case))
        x, _, _, p = np.abs(base_transmissibility(specimen, _NEAR_HZ)).T
        reached = np.abs(base_transmissibility(specimen, _SECOND_HZ)[:, 3]) * MODERATE_M
        over = _SECOND_HZ[reached > case.options.gap_m]
        ends = f"{over[0]:.1f} to {over[-1]:.1f}" if over.size else "nowhere"
        level_um = 1e6 * case.options.gap_m / p.max()
        rows.append((setting.name, f"{x.max():.3g}", f"{level_um:.3g}", ends))
    return ReportTable(
        "Where linear motion reaches the gap",
        (
            "damping",
            "|x / U| at its peak near 95 Hz",
            "A0 at which p reaches the gap there [µm]",
            "p reaches the gap at 5 µm between [Hz]",
        ),
        tuple(rows),
        "Exact linear motion; up to there Responses I and II are the same.",
    )


def exponents_table(evidence: Evidence, case: Case) -> ReportTable:
    """Say how chaotic the motion is at 5 um, around the first and around the second resonance."""
    settings = (damping(1e-5).of(case), case, ALIKE.of(case), BY_ODE45.of(case))
    curves = [level(evidence, each, MODERATE_M) for each in settings]
    rows = []
    for frequency_hz in (*FIRST_REGION_HZ, *SECOND_REGION_HZ):
        at = [np.flatnonzero(each.frequency_hz == frequency_hz) for each in curves]
        values = (each.exponent_per_s[place] for each, place in zip(curves, at, strict=True))
        rows.append((f"{frequency_hz:g}", *(f"{each[0]:.0f}" if each.size else "" for each in values)))
    return ReportTable(
        "Exponents at 5 µm around two resonances",
        ("frequency [Hz]", *(each.name for each in settings)),
        tuple(rows),
        "Largest exponent [1/s]; another run of chaos differs by some per cent.",
    )


def methods_table(evidence: Evidence, case: Case) -> ReportTable:
    """Compare textbook methods with the exact motion: energy of an impact, and exponent at 260 Hz."""
    options, drive = case.options, drive_at(SHOWN_HZ, MODERATE_M)
    specimen, settle_s = specimen_under(case), options.window_s
    curve = level(evidence, case, MODERATE_M)
    exact = curve.exponent_per_s[curve.frequency_hz == SHOWN_HZ]
    rows = [("exact flight, resolved contact", "1, 1, 1", *(f"{each:.0f}" for each in exact))]
    for method in (ode45(), *(runge_kutta(each) for each in STEPS_S)):
        kept = ", ".join(f"{energy_kept(specimen, method, each):.3g}" for each in SPEEDS)
        found = textbook_exponent(specimen, drive, method, options.duration_s - settle_s, settle_s)
        rows.append((method.name, kept, f"{found:.0f}"))
    speeds = ", ".join(f"{each:g}" for each in SPEEDS)
    return ReportTable(
        "Methods of integration",
        ("method", f"energy kept at {speeds} m/s", "exponent [1/s]"),
        tuple(rows),
        "The first step in a contact begins at any moment. Energy of m1 and m2 after a free impact over that "
        f"before it, averaged over that moment; exponents at {SHOWN_HZ:g} Hz, 5 µm, from rest.",
    )


def energy_kept(specimen: Specimen, method: TextbookMethod, speed: float) -> float:
    """Give the energy of m1 and m2 after an impact that nothing else takes part in, over that before."""
    free = replace(
        specimen, stiffnesses=(_NO_SPRING,) * 3, dampings=(0.0,) * 3, lower_gap_m=np.inf, gap_m=_SHORT_M
    )
    step_s = min(method.longest_s, _SHORT_M / speed)
    kept = []
    for share in np.linspace(0.0, 1.0, _PHASES, endpoint=False):
        before = [0.0, _SHORT_M - share * step_s * speed, 0.0, 0.0, speed, 0.0]
        after = textbook_state(free, _STILL, method, _LONG_S, before)
        kept.append(((after[4] - after[5]) / speed) ** 2)
    return float(np.mean(kept))


_STILL = Harmonic(100.0, 0.0)
_NO_SPRING = 1e-9
"""[N/m]."""
_SHORT_M, _LONG_S = 1e-5, 1e-3
"""A gap that is soon crossed, and a time after which any impact is over."""
