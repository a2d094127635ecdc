"""What of a specimen only its collisions tell: read from it, and given to it."""

from collections.abc import Mapping
from dataclasses import replace
from enum import StrEnum

from ._tracking_model import TrackedSpecimen


class Hidden(StrEnum):
    """What of a specimen only its collisions tell."""

    LOWER_GAP = "lower_gap_m"
    UPPER_GAP = "upper_gap_m"
    M1 = "m1_kg"
    C1 = "c1_ns_per_m"
    FORCE = "force_at_1um_n"
    """Of a stop pressed in by 1 um, F = FORCE (d / 1 um)^EXPONENT."""
    EXPONENT = "contact_exponent"


GEOMETRY = (Hidden.LOWER_GAP, Hidden.UPPER_GAP, Hidden.M1, Hidden.C1)
"""Found first, with the contact law as described."""
PRIOR_SD = {
    Hidden.LOWER_GAP: 0.04,
    Hidden.UPPER_GAP: 0.04,
    Hidden.M1: 0.04,
    Hidden.C1: 0.4,
    Hidden.FORCE: 0.3,
    Hidden.EXPONENT: 0.1,
}
"""Relative to the description: how far from it a parameter is looked for."""


def value_of(tracked: TrackedSpecimen, what: Hidden) -> float:
    """Read one parameter."""
    match what:
        case Hidden.LOWER_GAP:
            return tracked.specimen.gaps_m[0]
        case Hidden.UPPER_GAP:
            return tracked.specimen.gaps_m[1]
        case Hidden.M1:
            return tracked.specimen.masses[1]
        case Hidden.C1:
            return tracked.specimen.dampings[1]
        case Hidden.FORCE:
            return tracked.force_at_1um_n
        case Hidden.EXPONENT:
            return tracked.exponent


def with_values(tracked: TrackedSpecimen, values: Mapping[Hidden, float]) -> TrackedSpecimen:
    """Give others; k1 stays when m1 changes."""
    new = {each: values.get(each, value_of(tracked, each)) for each in Hidden}
    m0, _, m2 = tracked.specimen.masses
    c0, _, c2 = tracked.specimen.dampings
    specimen = replace(
        tracked.specimen,
        masses=(m0, new[Hidden.M1], m2),
        dampings=(c0, new[Hidden.C1], c2),
        gap_m=new[Hidden.UPPER_GAP],
        lower_gap_m=new[Hidden.LOWER_GAP],
    )
    return TrackedSpecimen(specimen, new[Hidden.FORCE], new[Hidden.EXPONENT])
