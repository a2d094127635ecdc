"""What of a specimen a colliding motion tells: read from it, and given to it."""

from collections.abc import Mapping
from dataclasses import replace
from enum import StrEnum

from ._tracking_model import TrackedSpecimen


class Hidden(StrEnum):
    """What of a specimen a colliding motion tells; m0, m2 and k1 stay as described."""

    LOWER_GAP = "lower_gap_m"
    UPPER_GAP = "upper_gap_m"
    M1 = "m1_kg"
    C1 = "c1_ns_per_m"
    K0 = "k0_n_per_m"
    K2 = "k2_n_per_m"
    C0 = "c0_ns_per_m"
    C2 = "c2_ns_per_m"
    FORCE = "force_at_1um_n"
    """Of a stop pressed in by 1 um, F = FORCE (d / 1 um)^EXPONENT (1 + LOSS d')."""
    EXPONENT = "contact_exponent"
    LOSS = "contact_loss_s_per_m"
    MEAN_GAP = "mean_gap_m"
    """Of both sides: what statistics tell better than either."""


PRIOR_SD = {
    Hidden.LOWER_GAP: 0.04,
    Hidden.UPPER_GAP: 0.04,
    Hidden.M1: 0.04,
    Hidden.C1: 0.4,
    Hidden.K0: 0.02,
    Hidden.K2: 0.02,
    Hidden.C0: 0.3,
    Hidden.C2: 0.3,
    Hidden.FORCE: 0.3,
    Hidden.EXPONENT: 0.1,
    Hidden.LOSS: 0.3,
}
"""Relative to the description: how far from it a parameter is looked for."""


def value_of(tracked: TrackedSpecimen, what: Hidden) -> float:
    """Read one parameter [m, kg, kg/s, N/m, N, s/m; the exponent has no unit]."""
    specimen = tracked.specimen
    lower, upper = specimen.gaps_m
    (k0, _, k2), (c0, c1, c2) = specimen.stiffnesses, specimen.dampings
    return {
        Hidden.LOWER_GAP: lower,
        Hidden.UPPER_GAP: upper,
        Hidden.M1: specimen.masses[1],
        Hidden.C1: c1,
        Hidden.K0: k0,
        Hidden.K2: k2,
        Hidden.C0: c0,
        Hidden.C2: c2,
        Hidden.FORCE: tracked.force_at_1um_n,
        Hidden.EXPONENT: tracked.exponent,
        Hidden.LOSS: tracked.loss_s_per_m,
        Hidden.MEAN_GAP: 0.5 * (lower + upper),
    }[what]


def scale_of(tracked: TrackedSpecimen, what: Hidden) -> float:
    """Return what relative distances are parts of: the parameter; of the loss, which may be none, 1 s/m."""
    return 1.0 if what is Hidden.LOSS else value_of(tracked, what)


def with_values(tracked: TrackedSpecimen, values: Mapping[Hidden, float]) -> TrackedSpecimen:
    """Return others; k1 stays when m1 changes."""
    new = {each: values.get(each, value_of(tracked, each)) for each in PRIOR_SD}
    m0, _, m2 = tracked.specimen.masses
    specimen = replace(
        tracked.specimen,
        masses=(m0, new[Hidden.M1], m2),
        stiffnesses=(new[Hidden.K0], tracked.specimen.stiffnesses[1], new[Hidden.K2]),
        dampings=(new[Hidden.C0], new[Hidden.C1], new[Hidden.C2]),
        gap_m=new[Hidden.UPPER_GAP],
        lower_gap_m=new[Hidden.LOWER_GAP],
    )
    return TrackedSpecimen(specimen, new[Hidden.FORCE], new[Hidden.EXPONENT], new[Hidden.LOSS])


class Numbers(StrEnum):
    """Which gaps, m1, springs, dampers and contact law the motion is tracked with."""

    FOUND = "found"
    """Those that the collisions tell, where they tell them."""
    AS_DESCRIBED = "as described"
