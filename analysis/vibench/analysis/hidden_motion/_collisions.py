"""Every collision of a tracked motion: when, where, how hard, and how deep; followed between the samples."""

from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np

from vibench.sim.engine.run import native_engine

from ..signals.arrays import Reals
from ..tables import Labelled
from ._filtering import MotionModel
from ._prepared_motion import PreparedMotion
from ._tracking import TrackedPiece

_COLUMNS = 7
_MOST_STEPS = 400
"""A contact that lasts so many samples is no collision: m1 has come to rest on the stop."""


@dataclass(frozen=True, eq=False)
class Collisions(Labelled):
    """Contacts of m1 with its stops in the order of time, arrays of one value each."""

    OWN_UNITS: ClassVar = {"impulses": "N s", "speeds_before": "m s-1", "speeds_after": "m s-1"}

    samples: Reals
    """Touch, in samples of the motion."""
    durations_s: Reals
    sides: Reals
    """-1 at the lower stop, +1 at the upper one."""
    impulses: Reals
    """On m1, as a magnitude [N s]."""
    penetrations_m: Reals
    """Largest."""
    speeds_before: Reals
    speeds_after: Reals
    """Of p, towards and away from the stop [m/s]."""

    @property
    def count(self) -> int:
        """How many."""
        return self.samples.size


def collisions_of(model: MotionModel, motion: PreparedMotion, piece: TrackedPiece) -> Collisions:
    """Follow every contact that begins in a piece, from the smoothed flight before it to its end."""
    smoothed, tables = piece.smoothed, model.tables
    samples = smoothed.states.shape[0]
    rows = np.empty((samples + 1, _COLUMNS))
    engine = native_engine()
    work = engine.new(
        "ContactSearch",
        states=smoothed.states,
        touched=smoothed.touched.astype(np.float64),
        acceleration=motion.accelerations(smoothed.first, smoothed.first + samples + _MOST_STEPS + 1),
        small_flow=tables.small_flow,
        stop=tables.stop,
        step=tables.step_s,
        small_steps=tables.small_steps,
        longest=_MOST_STEPS,
        contacts=rows,
    )
    found = rows[: engine.call("follow_contacts", work)].copy()
    found[:, 0] += smoothed.first
    return Collisions(*found.T)


def joined_collisions(parts: list[Collisions]) -> Collisions:
    """Put those of several pieces after one another."""
    names = [each.name for each in fields(Collisions)]
    return Collisions(
        **{name: np.concatenate([getattr(each, name) for each in parts] or [np.empty(0)]) for name in names}
    )
