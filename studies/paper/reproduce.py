"""Judge all claims, at the defaults and over the dampings, and say what they were judged on."""

import json
from collections.abc import Callable, Mapping

import numpy as np

from vibench.sim.study import PACKAGES, software

from .case import Case
from .claim import Claim, judged
from .document import Reproduction
from .evidence import Evidence
from .page_tables import rates_table, regions_table
from .score import scores
from .settings import claims_by_setting, exponents_table, methods_table, reach_table

_MINUTE_S = 60.0
Told = Callable[[str], None]
"""Told what is measured next."""


def ignore_steps(step: str) -> None:
    """Watch nothing."""


def reproduction(
    sections: Mapping[str, tuple[Claim, ...]],
    evidence: Evidence,
    case: Case,
    on_step: Told = ignore_steps,
) -> Reproduction:
    """Judge every claim under a case, under its alternatives where it fails, by damping and by setting."""
    judgements = {}
    for heading, claims in sections.items():
        found = []
        for claim in claims:
            on_step(claim.key)
            found.append(judged(claim, evidence, case))
        judgements[heading] = tuple(found)
    on_step("score by damping")
    every = [claim for each in sections.values() for claim in each]
    by_damping = scores(every, evidence, case)
    on_step("claims by setting")
    tables = (
        claims_by_setting(every, evidence, case),
        reach_table(case),
        exponents_table(evidence, case),
        methods_table(evidence, case),
        regions_table(evidence, case),
        rates_table(evidence, case),
    )
    return Reproduction(
        sections=judgements,
        scores=by_damping,
        tables=tables,
        options=case.sentence,
        made_with=_made_with(evidence),
    )


def _made_with(evidence: Evidence) -> str:
    """Say how much was computed, by what; taken from the studies, however often they were gone on with."""
    studies = evidence.studies
    points = sum(each.study.grid.size for each in studies)
    taken_s = sum(float(np.nansum(each.values("taken"))) for each in studies)
    versions = json.loads(software())
    named = ", ".join(f"{name} {versions[name]}" for name in PACKAGES)
    return (
        f"Computed from {points} simulated points in {len(studies)} studies, "
        f"{taken_s / _MINUTE_S:.0f} minutes of one core, with {named}."
    )
