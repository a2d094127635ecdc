"""Changing what holds a motion a little, which tells whether it would be stable without its feedback."""

from itertools import pairwise
from math import isfinite, nan

import numpy as np

from vibench.sim.feedback.stability import (
    OpenLoopMultiplier,
    PerturbedMotion,
    envelope_deviation,
    open_loop_multiplier,
)

from ..excitation.steps import Segment
from ..instruments import Samples
from ..plan import Phase, RunState
from ..recording import BranchStabilityNote, Stability
from .branch_player import BranchPlayer, LoopLook
from .branch_solver import Coefficients, LoopSetting
from .control_action import Controller, PhaseSamples
from .feedback_channels import FeedbackChannels

_EACH = 5
"""Periods of a change: short beside growth, long beside what the upper modes need to follow."""
_LEAD, _TRIAL = 3, 8
"""Changes before those that count, and changes by which their size is found."""
_CHANGED = (0, 2)
"""Coefficients that are changed: the first, and the third, at which the specimen pushes the table."""
_FIRST_SIZE, _MOST_SIZE = 0.002, 0.05
"""Of the first coefficient: the change of the trial, and the largest."""
_SAME, _ERRORS = 0.01, 3.0
"""A motion that differs by this part, and so many standard errors, from what it was is another one."""
_NEVER = 1e-9


def perturbed_stability(
    player: BranchPlayer, channels: FeedbackChannels, setting: LoopSetting, number: int, before: LoopLook
) -> Controller[BranchStabilityNote]:
    """Go through small changes of what is played twice, the second time with the other sign, and back.

    Their size, by a trial, is such that base and m0 change by as much as the plan says at most; the held
    motion is looked at afterwards.
    """
    plan, frequency_hz = player.plan, setting.frequency_hz
    period = channels.sample_rate_hz / frequency_hz
    count = plan.perturbed_periods // (2 * _EACH)
    changes = _changes(count, number)
    first_v = _FIRST_SIZE * abs(setting.reference_v[0])
    told = yield from _changed(player, setting, first_v * changes[:_TRIAL], None)
    seen = max(envelope_deviation(each, period) for each in _joined(told, channels))
    size_v = first_v * min(plan.perturbation / max(seen, _NEVER), _MOST_SIZE / _FIRST_SIZE)
    segment = plan.perturbed(number, frequency_hz, size_v)
    course = np.concatenate([-changes[-_LEAD:], changes, -changes, np.zeros((1, len(_CHANGED)))])
    told = yield from _changed(player, setting, size_v * course, segment)
    after = yield from player.looked(setting, abs(before.base_m[0]))
    return stability_note(_fitted(told, channels, period, count), number, plan.perturbation, before, after)


def _changes(count: int, seed: int) -> Coefficients:
    """Give corners of a square at random, shape (count, coefficients)."""
    corners = np.random.default_rng(seed).integers(0, 4, (count, len(_CHANGED)))
    return np.asarray(np.exp(1j * np.pi * (0.25 + 0.5 * corners)))


def _changed(
    player: BranchPlayer, setting: LoopSetting, course: Coefficients, segment: Segment | None
) -> Controller[list[PhaseSamples]]:
    """Go from change to change along half cosines, without a step."""
    told = []
    state = RunState.SETTLING if segment is None else RunState.RECORDING
    length_s = _EACH / setting.frequency_hz
    for change in course:
        volts = setting.reference_v.copy()
        volts[list(_CHANGED)] += change
        tone = player.tone(LoopSetting(setting.frequency_hz, volts), length_s)
        told.append((yield from player.run(Phase(state, tone, length_s, segment))))
    return told


def _joined(told: list[PhaseSamples], channels: FeedbackChannels) -> tuple[Samples, Samples]:
    """Join base and m0 of all phases."""
    rows = [channels.rows(each) for each in told]
    return np.concatenate([base for _, base, _ in rows]), np.concatenate([m0 for _, _, m0 in rows])


def _fitted(
    told: list[PhaseSamples], channels: FeedbackChannels, period: float, count: int
) -> OpenLoopMultiplier:
    """Fit what was recorded; nothing is known where samples are missing between phases (a run was held)."""
    if any(one.first_sample + one.volts.shape[1] != two.first_sample for one, two in pairwise(told)):
        return OpenLoopMultiplier(nan, nan)
    base, m0 = _joined(told, channels)
    return open_loop_multiplier(
        PerturbedMotion(base, m0, period, round(_LEAD * _EACH * period), count * _EACH)
    )


def stability_note(
    found: OpenLoopMultiplier, number: int, asked: float, before: LoopLook, after: LoopLook
) -> BranchStabilityNote:
    """Judge a fit; a motion that is another one afterwards was not the one that it is about."""
    error = float(np.hypot(before.m0_u[0], after.m0_u[0]) / abs(before.m0_m[0]))
    moved = float(abs(abs(after.m0_m[0] / before.m0_m[0]) - 1))
    low, high = found.bounds
    stability = Stability.OPEN
    if moved <= max(_SAME, _ERRORS * error):
        # Comparisons with what is not a number are false: not determined.
        stability = Stability.STABLE if high < 1 else Stability.UNSTABLE if low > 1 else Stability.OPEN
    known = isfinite(found.size) and isfinite(found.error)
    return BranchStabilityNote(
        point=number,
        stability=stability,
        multiplier=found.size if known else None,
        multiplier_u=found.error if known else None,
        perturbation=asked,
        moved=moved,
    )
