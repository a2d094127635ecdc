"""Motion under a power law, a sum of odd powers of p: a force that acts at every p, with no flight.

Harmonic drive: long steps, the force at eight Gauss points found by substitution, the linear part as a
Taylor series of the matrix exponential (docs/decisions/0026-power-laws.md). Sampled or swept drive: Dormand
and Prince's order 8(5,3) in time (`smooth`). Peaks, lines, samples and the variation are those of the step
itself.
"""

from ._flow import (
    PowerSystem,
    power_force,
    whole_power,
)
from ._numbers import (
    FEED,
    FREE,
    GAIN,
    MOVE,
    POINTS,
)
from ._run import (
    advance_under_power,
)
from ._smooth import (
    MOST_SHORTENINGS,
    SHORTENING,
    WALL_TURN,
    advance_smooth,
    begin_smooth,
)
from ._step import (
    PowerStepState,
)
from ._tables import (
    PowerTables,
    power_tables,
)

__all__ = [
    "FEED",
    "FREE",
    "GAIN",
    "MOST_SHORTENINGS",
    "MOVE",
    "POINTS",
    "SHORTENING",
    "WALL_TURN",
    "PowerStepState",
    "PowerSystem",
    "PowerTables",
    "advance_smooth",
    "advance_under_power",
    "begin_smooth",
    "power_force",
    "power_tables",
    "whole_power",
]
