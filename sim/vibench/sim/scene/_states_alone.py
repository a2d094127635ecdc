"""A motion followed by its states alone, until it repeats: chaos that has shown itself, and other starts."""

import math

import numpy as np

from ..kernels import Floats
from ..model import Outcome
from ._fixed_run import Pace, growth_of
from ._followed_run import FollowedRun
from ._observed_window import follow_strobed
from ._repetition import Growth, Repetition, section_needed, wandered_until

SLICE_S = 0.5
"""Time between two looks, at least."""
PARTS = 4
"""Of a stretch over which growth is seen: whether it goes on growing."""
REMEMBERED = 16.0
"""Forgetting times whose states are kept: from wandering to settled a motion needs ten, at standard."""


class StatesAlone:
    """A run without a tangent, looked at now and then."""

    def __init__(self, run: FollowedRun, pace: Pace, recent: Floats | None = None) -> None:
        run.drop_tangent()
        self.run = run
        self.repeats: Repetition | None = None
        """Found; it is followed no further then."""
        self.recent = np.empty((0, 6)) if recent is None else recent
        """States once a drive period, up to now."""
        self._settled_s: float | None = None
        self._pace = pace
        self._kept = section_needed(pace.forgetting_periods) + math.ceil(REMEMBERED * pace.forgetting_periods)

    @property
    def is_over(self) -> bool:
        """It repeats, or was lost."""
        return self.repeats is not None or self.run.outcome is not Outcome.REACHED_END

    @property
    def wandered_until_s(self) -> float:
        """When it was last seen to change from period to period; now, if it does not repeat."""
        return self.run.time_s if self._settled_s is None else self._settled_s

    def follow(self, until_s: float, cost_s: float = math.inf) -> None:
        """Follow it until it repeats, an instant is reached, or its cost from its beginning is."""
        frequency_hz = self._pace.frequency_hz
        periods = max(1, math.ceil(SLICE_S * frequency_hz))
        while not self.is_over and self.run.time_s < until_s and self.run.cost_s < cost_s:
            made = round(self.run.time_s * frequency_hz)
            # An end between two periods is reached, but nothing is looked for there.
            end_s = min((made + periods) / frequency_hz, until_s)
            stretch = follow_strobed(self.run, end_s)
            self.recent = np.concatenate([self.recent, stretch.states])[-self._kept :]
            self.repeats = self._pace.repeats_in(self.recent)
            if self.repeats is not None:
                since = wandered_until(self.recent, 2.0 * math.pi * frequency_hz, self.repeats.period)
                self._settled_s = self.run.time_s - (len(self.recent) - since) / frequency_hz

    def growth_over(self, length_s: float) -> Growth:
        """Follow it on, and see how a small change grows meanwhile; nothing, over no time."""
        self.run.follow_tangent()
        begin_s = self.run.time_s
        ends_s = [begin_s + length_s * (part + 1) / PARTS for part in range(PARTS)] if length_s > 0.0 else []
        stretches = [follow_strobed(self.run, end_s) for end_s in ends_s]
        self.run.drop_tangent()
        return growth_of(stretches)
