"""Every collision of a tracked motion: when, where, how hard, and how deep; followed between the samples."""

from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np

from vibench.sim.kernels import kernel

from ..signals import Flags, Reals
from ..tables import Labelled
from ._filter_kernels import (
    LOWER,
    STATES,
    UPPER,
    VY,
    VZ,
    Y,
    Z,
    flow_step,
    kick,
)
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
    rows = np.empty((smoothed.states.shape[0] + 1, _COLUMNS))
    count = _follow_contacts(
        smoothed.states,
        smoothed.touched,
        motion.accelerations(smoothed.first, smoothed.first + smoothed.states.shape[0] + _MOST_STEPS + 1),
        tables.small_flow,
        tables.stop,
        tables.step_s,
        tables.small_steps,
        rows,
    )
    found = rows[:count].copy()
    found[:, 0] += smoothed.first
    return Collisions(*found.T)


def joined_collisions(parts: list[Collisions]) -> Collisions:
    """Put those of several pieces after one another."""
    names = [each.name for each in fields(Collisions)]
    return Collisions(
        **{name: np.concatenate([getattr(each, name) for each in parts] or [np.empty(0)]) for name in names}
    )


@kernel
def _follow_contacts(
    states: Reals,
    touched: Flags,
    acceleration: Reals,
    small_flow: Reals,
    stop: Reals,
    step_s: float,
    small_steps: int,
    rows: Reals,
) -> int:
    """Fill a row for each contact; gives how many."""
    state, scratch = np.empty(STATES), np.empty((STATES, STATES))
    nothing = np.empty((0, STATES))
    small_s = step_s / small_steps
    count, ready_at = 0, 1
    for k in range(1, states.shape[0]):
        if not touched[k] or k < ready_at or count == rows.shape[0]:
            continue
        p = states[k - 1, Y] - states[k - 1, Z]
        if p > stop[UPPER] or -p > stop[LOWER]:
            continue
        state[:] = states[k - 1]
        side, impulse, deepest, began, before = 0.0, 0.0, 0.0, 0.0, 0.0
        at, is_over = k - 1, False
        while not is_over and at + 1 < acceleration.size and at - k < _MOST_STEPS:
            base, rise = acceleration[at], acceleration[at + 1] - acceleration[at]
            for n in range(small_steps):
                last = state[Y] - state[Z]
                rate = state[VY] - state[VZ]
                pushed = kick(state, stop, 0.5 * small_s, nothing)
                flow_step(
                    state, small_flow, base + rise * n / small_steps, rise / small_steps, scratch, nothing
                )
                pushed += kick(state, stop, 0.5 * small_s, nothing)
                p = state[Y] - state[Z]
                place = at + n / small_steps
                if side == 0.0 and (p > stop[UPPER] or -p > stop[LOWER]):
                    side = 1.0 if p > 0.0 else -1.0
                    gap = stop[UPPER] if p > 0.0 else stop[LOWER]
                    part = (gap - side * last) / (side * (p - last))
                    began, before = place + part / small_steps, side * rate
                if side != 0.0:
                    gap = stop[UPPER] if side > 0.0 else stop[LOWER]
                    impulse += abs(pushed)
                    deepest = max(deepest, side * p - gap)
                    if side * p <= gap:
                        part = (side * last - gap) / (side * (last - p))
                        ended = place + part / small_steps
                        rows[count, 0] = began
                        rows[count, 1] = (ended - began) * step_s
                        rows[count, 2] = side
                        rows[count, 3] = impulse
                        rows[count, 4] = deepest
                        rows[count, 5] = before
                        rows[count, 6] = -side * (state[VY] - state[VZ])
                        count += 1
                        side, impulse, deepest = 0.0, 0.0, 0.0
                        is_over = n + 1 == small_steps or at + 1 >= states.shape[0]
            at += 1
            # The step is over in flight: what follows begins with a smoothed state again.
            is_over = is_over or side == 0.0
        ready_at = at + 1
    return count
