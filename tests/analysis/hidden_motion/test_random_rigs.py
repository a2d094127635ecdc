"""Specimens nobody has seen, described wrong: all are followed, and the bounds of what is found cover.

HIDDEN_RIGS=N and HIDDEN_SEED=S in the environment ask for N other rigs.
"""

import os
from dataclasses import replace

import numpy as np
import pytest

from vibench.acquisition import open_recording
from vibench.analysis.hidden_motion import hidden_motion
from vibench.analysis.hidden_motion._parameters import value_of
from vibench.analysis.hidden_motion._tracking_model import tracked_specimen
from vibench.sim import HuntCrossley, gong2025

RIGS, SEED = int(os.environ.get("HIDDEN_RIGS", "9")), int(os.environ.get("HIDDEN_SEED", "99"))
SCORED_FROM = 20_480


def about(rng, values, share):
    return tuple(float(each * (1 + share * rng.uniform(-1, 1))) for each in values)


def true_specimen(rng):
    gaps = (float(rng.uniform(35e-6, 55e-6)), float(rng.uniform(35e-6, 55e-6)))
    usual = gong2025(damping_time_s=float(rng.uniform(1.2e-5, 2.6e-5)), gap_m=gaps)
    stiffness = usual.contact.stops.contact_stiffness * float(rng.uniform(0.8, 1.2))
    return replace(
        usual,
        masses=about(rng, usual.masses, 0.05),
        stiffnesses=about(rng, usual.stiffnesses, 0.05),
        contact=HuntCrossley(stiffness, float(rng.uniform(0, 0.4))),
    )


def described_wrong(rng, true):
    (m0, m1, m2), (k0, k1, k2) = true.masses, true.stiffnesses
    return replace(
        true,
        masses=(m0, m1 * (1 + 0.02 * rng.standard_normal()), m2),
        stiffnesses=(
            k0 * (1 + 0.003 * rng.standard_normal()),
            k1,
            k2 * (1 + 0.003 * rng.standard_normal()),
        ),
        dampings=about(rng, true.dampings, 0.2),
        gap_m=true.gap_m * (1 + 0.02 * rng.standard_normal()),
        lower_gap_m=true.lower_gap_m * (1 + 0.02 * rng.standard_normal()),
        contact=gong2025().contact,
    )


@pytest.mark.slow
@pytest.mark.timeout(1700)
def test_random_specimens_described_wrong_are_followed_and_bounds_cover(world_recording):
    rng = np.random.default_rng(SEED)
    parts = []
    for number in range(RIGS):
        true = true_specimen(rng)
        wrong = described_wrong(rng, true)
        kind, level = (
            (float(rng.uniform(245, 275)), float(rng.uniform(1.2, 3))),
            ("sweep", float(rng.uniform(1.2, 3))),
            ("noise", float(rng.uniform(4, 10))),
        )[number % 3]
        recorded = world_recording(kind, level, duration_s=2.6, seed=7000 + number, specimen=true)
        with open_recording(recorded.path) as recording:
            motion = hidden_motion(recording, wrong)
        p = motion.tracked.p
        error = (p - recorded.p[motion.first_sample :][: p.size])[SCORED_FROM:]
        followed = ~np.isnan(error)
        assert np.mean(followed) > 0.98, (number, kind, level)
        assert np.sqrt(np.mean(error[followed] ** 2)) < 0.1e-6, (number, kind, level)
        told = tracked_specimen(true)
        parts += [
            abs(value_of(told, each.what) - each.value) / each.half_width
            for each in motion.parameters
            if each.is_determined
        ]
    bounds, covered = len(parts), sum(part < 1.0 for part in parts)
    # Three standard deviations of a binomial of 95 % below its mean; and no wider by far than that asks.
    assert covered > 0.95 * bounds - 3 * np.sqrt(0.95 * 0.05 * bounds)
    assert np.median(parts) > 0.1
    assert bounds > 9 * RIGS
