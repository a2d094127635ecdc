"""Which numbers of the specimen a hidden motion is tracked with."""

from enum import StrEnum


class Numbers(StrEnum):
    """Which gaps, m1, springs, dampers and contact law the motion is tracked with."""

    FOUND = "found"
    """Those that the collisions tell, where they tell them."""
    AS_DESCRIBED = "as described"
