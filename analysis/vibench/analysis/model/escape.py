"""Motions that end by chance: told as a probability per second, not as an edge.

Chaos that is a transient, and collisions that a sweep loses, end at another time in every run. Their ends
follow a rate of escape (Tel and Lai, Phys. Rep. 460 (2008), ch. 1), and one end is one draw of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy

_ONE_EDGE_S = 2.0
"""Runs that all stop within this share one edge, the end of the record perhaps, as near as it can be told."""


@dataclass(frozen=True)
class Ending:
    """One run of a motion, from when it could end to when it did, or until nobody looked any more."""

    what: str
    """``"collisions"``, ``"irregular motion"``."""
    start_s: float
    stop_s: float
    ended: bool
    """False where the motion outlasted the record."""


@dataclass(frozen=True)
class EscapeRate:
    """How often a motion ends, per second that it lasts."""

    DOCUMENT: ClassVar = (
        "what runs ends measured_ended=measured.ended measured_end_s=measured.stop_s counted_from_s=from_s "
        "events exposure_s per_s per_s_lower=bounds_per_s.0 per_s_upper=bounds_per_s.1"
    )

    what: str
    runs: int
    """The measured one among them."""
    ends: int
    measured: Ending
    exposure_s: float
    """Time during which an end was counted, over all runs."""
    events: int
    """Ends counted: where the beginning of the time counted is itself an end, that one is not."""
    from_s: float
    """Since when ends are counted, as `Ending` counts time."""

    @property
    def per_s(self) -> float:
        """Ends over exposure: the likeliest rate."""
        return self.events / self.exposure_s

    @property
    def bounds_per_s(self) -> tuple[float, float]:
        """Exact 95 % bounds of a Poisson rate (Garwood 1936)."""
        low = float(scipy.stats.chi2.ppf(0.025, 2 * self.events)) if self.events else 0.0
        high = float(scipy.stats.chi2.ppf(0.975, 2 * self.events + 2))
        return low / (2 * self.exposure_s), high / (2 * self.exposure_s)

    @property
    def sentence(self) -> str:
        """The same in words."""
        low, high = self.bounds_per_s
        return (
            f"The end of {self.what} is a draw of chance: it came in {self.ends} of {self.runs} runs, the "
            f"measured one among them, at a rate of {self.per_s:.2g} per second ({low:.2g} to {high:.2g}) "
            f"once the first had ended"
        )


def escape_rate(measured: Sequence[Ending], draws: Sequence[Sequence[Ending]]) -> EscapeRate | None:
    """Count ends over the measured run and its draws; None where none ended, or all stop at one edge."""
    if not measured:
        return None
    mine = measured[0]
    runs = [mine, *(one for draw in draws for one in draw[:1] if one.what == mine.what)]
    stops = np.array([each.stop_s for each in runs if each.ended])
    if len(runs) == 1 or not stops.size or np.ptp([each.stop_s for each in runs]) < _ONE_EDGE_S:
        return None
    # Before the first end nothing shows that the motion could have ended there at all.
    from_s = float(stops.min())
    exposure_s = sum(max(each.stop_s - from_s, 0.0) for each in runs)
    if exposure_s <= 0.0:
        return None
    return EscapeRate(mine.what, len(runs), stops.size, mine, exposure_s, stops.size - 1, from_s)
