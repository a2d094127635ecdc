"""What decides how long is long: when a motion has surely forgotten its start, and what counts as settled."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..model.accuracy import Accuracy
from ..model.arrays import Floats
from ..model.contact_law import ContactLaw
from ..model.power_law import PowerLaw
from ..model.specimen import Specimen
from .followed_run import Stretch
from .observed_window import states_of
from .prediction import MotionKind
from .repetition import (
    CERTAIN_GROWTH,
    Growth,
    Repetition,
    Sharpness,
    is_drifting,
    kind_of,
    repetition,
    section_needed,
)

FORGETTING = 8.0
"""Forgetting times after which a motion that does not repeat is taken to be on its attractor."""
FEWEST_TIMES = 40.0
"""The longest run holds this many forgetting times; slower modes, and undamped ones, count as so slow."""
MOST_STATES = 2_000_000
"""A window holds no more drive periods. Their states, two windows of them and a copy, take 300 MB."""
FEWEST_PERIODS = 32
"""Drive periods after which a motion that does not repeat is taken to be on its attractor, at least."""
SETTLED = {Accuracy.QUICK: 1e-5, Accuracy.STANDARD: 1e-6, Accuracy.REFERENCE: 1e-8}
"""Distance from the motion that it repeats, over its size, at which it counts as settled."""
ROUNDING = 1e-10
"""Noise of exact flight and of contacts that begin and end as they did a period before."""
EXACTLY = 1e-9
"""Distance at which a motion is passed over: what is left of the way is less than any level promises."""
STEPPING = 100.0
"""Noise over the tolerance where steps follow one another without a break: they fall elsewhere in each
period. Measured: 70 at most (p^7 at 130 Hz and 20 um)."""


@dataclass(frozen=True)
class Pace:
    """What decides how long is long, for one drive."""

    frequency_hz: float
    forgetting_s: float
    """Time in which the slowest mode without contact fades by e, or as slowly as is waited for."""
    fading_s: float
    """The same where it is longer than can be waited for; of undamped modes, what is waited for."""
    sharpness: Sharpness
    nearly: Sharpness
    """That of the least accurate level."""

    @property
    def forgetting_periods(self) -> float:
        """The forgetting time in drive periods."""
        return self.forgetting_s * self.frequency_hz

    @property
    def attractor_s(self) -> float:
        """When a motion that does not repeat is taken to be on its attractor."""
        return max(FORGETTING * self.forgetting_s, FEWEST_PERIODS / self.frequency_hz)

    @property
    def section_s(self) -> float:
        """Length of the section that lets every period be found."""
        return (section_needed(self.forgetting_periods) + 1) / self.frequency_hz

    @property
    def settling_s(self) -> float:
        """What a motion takes, from wherever it was, to be seen to repeat."""
        return self.attractor_s + self.section_s

    def repeats(self, stretches: Sequence[Stretch]) -> Repetition | None:
        """Say whether the motion of these stretches, one after the other, repeats at their end."""
        return self.repeats_in(states_of(stretches))

    def drifts(self, stretches: Sequence[Stretch]) -> bool:
        """Return whether the motion of these stretches still approaches or leaves another motion."""
        return is_drifting(states_of(stretches), 2.0 * np.pi * self.frequency_hz)

    def cycle(self, stretches: Sequence[Stretch]) -> int:
        """Give the drive periods over which lines are taken: the motion's own, if it has nearly settled.

        What counts as nearly is the same at every level, so that a line is the same question at each.
        """
        found = self.repeats(stretches) or replace(self, sharpness=self.nearly).repeats(stretches)
        return 1 if found is None else found.period

    def is_chaos(self, stretches: Sequence[Stretch]) -> bool:
        """Say whether a small change has grown in each half of these stretches as only chaos makes it."""
        growth = growth_of(stretches)
        is_plenty = min(growth.halves) > CERTAIN_GROWTH
        return is_plenty and kind_of(None, growth, self.fading_s) is MotionKind.CHAOTIC

    def repeats_in(self, section: Floats) -> Repetition | None:
        """Say whether a motion with these states once a drive period, shape (n, 6), repeats at their end."""
        omega = 2.0 * np.pi * self.frequency_hz
        return repetition(section, omega, self.forgetting_periods, self.sharpness)


def pace_of(
    specimen: Specimen, frequency_hz: float, accuracy: Accuracy, slowest_rate: float, longest_s: float
) -> Pace:
    """Choose the pace for a specimen whose slowest mode has ``slowest_rate`` [1/s], zero or negative."""
    slowest_s = min(longest_s / FEWEST_TIMES, MOST_STATES / FEWEST_TIMES / frequency_hz)
    fading_s = -1.0 / slowest_rate if slowest_rate < 0.0 else slowest_s
    own, nearly = (_sharpness(specimen.contact, each) for each in (accuracy, Accuracy.QUICK))
    return Pace(frequency_hz, min(slowest_s, fading_s), fading_s, own, nearly)


def _sharpness(contact: ContactLaw, accuracy: Accuracy) -> Sharpness:
    match contact:
        case PowerLaw():
            noise = STEPPING * accuracy.tolerance
        case _:
            noise = ROUNDING
    return Sharpness(max(SETTLED[accuracy], 2.0 * noise), noise)


def growth_of(stretches: Sequence[Stretch]) -> Growth:
    """Growth of a small change over those stretches in which one was carried."""
    carried = [stretch for stretch in stretches if np.isfinite(stretch.growth)]
    logarithms = np.array([stretch.growth for stretch in carried])
    return Growth(logarithms, sum(stretch.length_s for stretch in carried))
