"""A point: one recording that a campaign wants, and the chain of points that it belongs to."""

from dataclasses import dataclass

from ._measurement import Measurement


@dataclass(frozen=True)
class Point:
    """One recording of a campaign."""

    name: str
    """Of its recording, without ``.h5``; different from every other point's."""
    measurement: Measurement
    chain: str = ""
    """Points of one chain follow each other on one branch; empty for a point that stands alone."""
