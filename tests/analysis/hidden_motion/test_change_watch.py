"""The sequential test for a change of the specimen, and its baseline."""

import math
from datetime import UTC, datetime

import numpy as np
import pytest

from vibench.analysis.hidden_motion import (
    BLOCK_S,
    FALSE_ALARM_S,
    Baseline,
    ChangeWatch,
    Hidden,
    KnownNumber,
    Level,
    baseline_path,
    keep_baseline,
    kept_baseline,
)
from vibench.sim import gong2025

USUAL = Level(mean=1.0, sd=0.02)
OUT, WITHIN = 9.0, 1.01


def alarms_after(levels, usual=USUAL):
    watch = ChangeWatch(usual)
    return next((number for number, each in enumerate(levels, 1) if watch.take(each)), None)


def test_a_deviation_that_lasts_half_a_second_triggers_the_change_alarm():
    assert alarms_after([OUT] * 20) == 5
    assert alarms_after([math.inf] * 20) == 5
    assert alarms_after(([OUT] * 4 + [WITHIN] * 25) * 10) is None


def test_the_alarm_for_a_specimen_change_is_given_once():
    watch = ChangeWatch(USUAL)
    assert sum(watch.take(OUT) for _ in range(100)) == 1
    assert watch.has_changed


def test_the_rate_of_false_change_alarms_is_within_its_bound():
    """Lorden's bound on the false alarm rate is met; with 30 % of blocks out, alarms are frequent."""
    rng = np.random.default_rng(8)
    day = np.where(rng.random(10 * 36_000) < 0.01, OUT, WITHIN)
    assert alarms_after(day) is None
    blocks_between = FALSE_ALARM_S / BLOCK_S
    # If a share q of n blocks is out by chance, five in a row occur about n q^5 times.
    assert 0.01**5 * blocks_between < 0.01
    often = [alarms_after(np.where(rng.random(4000) < 0.3, OUT, WITHIN)) for _ in range(20)]
    assert all(often)


def test_the_usual_residual_of_the_twin_is_learnt_in_two_seconds():
    rng = np.random.default_rng(9)
    watch = ChangeWatch()
    levels = 0.9 + 0.02 * rng.standard_normal(20)
    assert not any(watch.take(each) for each in (math.inf, *levels))
    assert watch.usual.mean == pytest.approx(np.mean(levels))
    assert watch.usual.limit == pytest.approx(1.5 * np.mean(levels))
    assert [watch.take(2.0) for _ in range(5)][-1]


def test_a_baseline_file_is_stored_and_an_unreadable_file_is_ignored(tmp_path, monkeypatch, virtual_rig):
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(tmp_path))
    path = baseline_path(virtual_rig, gong2025())
    assert path != baseline_path(virtual_rig, gong2025(gap_m=46e-6))
    assert kept_baseline(path) is None
    baseline = Baseline(
        bench="virtual rig",
        since=datetime.now(UTC),
        numbers={Hidden.M1: KnownNumber(value=2.1e-3, low=2.0e-3, high=2.2e-3)},
        levels={"dwell, 1.5 Vpp": USUAL},
    )
    keep_baseline(baseline, path)
    assert kept_baseline(path) == baseline
    path.write_text('{"numbers": 3}')
    assert kept_baseline(path) is None
