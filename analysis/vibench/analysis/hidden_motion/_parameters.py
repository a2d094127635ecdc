"""Parameters of a specimen that a colliding motion determines."""

from collections.abc import Mapping
from dataclasses import replace
from enum import StrEnum
from typing import NamedTuple

from ._tracking_model import TrackedSpecimen


class Hidden(StrEnum):
    """Parameters that a colliding motion determines; m0, m2 and k1 stay as described."""

    LOWER_GAP = "lower_gap_m"
    UPPER_GAP = "upper_gap_m"
    M1 = "m1_kg"
    C1 = "c1_ns_per_m"
    K0 = "k0_n_per_m"
    K2 = "k2_n_per_m"
    C0 = "c0_ns_per_m"
    C2 = "c2_ns_per_m"
    FORCE = "force_at_1um_n"
    """Force at an indentation d of 1 um: F = FORCE (d / 1 um)^EXPONENT (1 + LOSS d')."""
    EXPONENT = "contact_exponent"
    LOSS = "contact_loss_s_per_m"
    MEAN_GAP = "mean_gap_m"
    """Mean of both gaps; statistics determine the mean better than each gap."""


class Search(NamedTuple):
    """Standard deviations and step of the search for one parameter, relative to its value."""

    prior_sd: float
    """Prior standard deviation about the described value."""
    step: float
    """Step of the parameter for numerical derivatives."""
    near: float
    """Prior standard deviation about the described value, if the described values suffice for tracking."""
    least_sd: float = 0.0
    """Smallest prior standard deviation about a value found without a contact model."""
    claimed: float = 1.0
    """Ratio of actual errors to the filter's standard deviation; the random walk makes the ratio smaller than
    1. The ratio was determined on 31 random rigs; the slow tests check other rigs."""


SEARCHES = {
    Hidden.LOWER_GAP: Search(0.04, 1e-5, 0.004, claimed=0.75),
    Hidden.UPPER_GAP: Search(0.04, 1e-5, 0.004, claimed=0.75),
    Hidden.M1: Search(0.04, 1e-4, 1e-3, least_sd=1e-3, claimed=0.5),
    Hidden.C1: Search(0.4, 1e-2, 0.05, least_sd=0.03, claimed=0.5),
    Hidden.K0: Search(0.02, 1e-5, 1e-4, least_sd=3e-4),
    Hidden.K2: Search(0.02, 1e-5, 1e-4, least_sd=3e-4),
    Hidden.C0: Search(0.3, 1e-2, 0.01, least_sd=0.03, claimed=0.5),
    Hidden.C2: Search(0.3, 1e-2, 0.01, least_sd=0.03, claimed=0.55),
    Hidden.FORCE: Search(0.3, 1e-3, 0.1, claimed=1.1),
    Hidden.EXPONENT: Search(0.1, 1e-4, 0.03),
    Hidden.LOSS: Search(0.3, 1e-3, 0.03, claimed=0.5),
}
PRIOR_SD = {what: search.prior_sd for what, search in SEARCHES.items()}
NEAR = {what: search.near for what, search in SEARCHES.items()}


def value_of(tracked: TrackedSpecimen, what: Hidden) -> float:
    """Return one parameter [m, kg, kg/s, N/m, N, s/m; the exponent has no unit]."""
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
    """Return the scale of relative deviations: the parameter's value, or 1 s/m for the loss (may be zero)."""
    return 1.0 if what is Hidden.LOSS else value_of(tracked, what)


def with_values(tracked: TrackedSpecimen, values: Mapping[Hidden, float]) -> TrackedSpecimen:
    """Return a copy with the given values; k1 stays the same if m1 changes."""
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
    """Source of gaps, m1, springs, dampers and contact law for tracking."""

    FOUND = "found"
    """Parameters found from collisions where possible."""
    AS_DESCRIBED = "as described"
