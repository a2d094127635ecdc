import numpy as np
import pytest

from vibench.analysis.live import LevelVerdict
from vibench.analysis.live._ring import HOLD_S, LevelMeters

RATE = 1000.0


def block(peaks, samples=100):
    values = np.zeros((len(peaks), samples), dtype=np.float32)
    values[:, 3] = peaks
    return values


def test_level_meters_show_fractions_of_full_scale():
    meters = LevelMeters(np.array([5.0, 10.0]), RATE)
    square = np.array([[2.5, -2.5] * 50, [1.0, -1.0] * 50], dtype=np.float32)
    first, second = meters.add(square)
    assert (first.peak_share, first.rms_share) == (pytest.approx(0.5), pytest.approx(0.5))
    assert second.peak_share == pytest.approx(0.1)
    assert first.verdict is LevelVerdict.GOOD


def test_level_meters_hold_a_peak_for_a_limited_time():
    meters = LevelMeters(np.array([5.0]), RATE)
    meters.add(block([4.9]))
    for _ in range(int(HOLD_S * 10) - 1):
        (level,) = meters.add(block([1.0]))
        assert level.held_share == pytest.approx(0.98)
        assert level.verdict is LevelVerdict.OVER
    meters.add(block([1.0]))
    (level,) = meters.add(block([1.0]))
    assert level.held_share == pytest.approx(0.2)
    assert level.verdict is LevelVerdict.GOOD


def test_a_channel_is_called_quiet_only_after_three_seconds_at_a_low_level():
    meters = LevelMeters(np.array([5.0]), RATE)
    verdicts = [meters.add(block([0.04]))[0].verdict for _ in range(31)]
    assert verdicts[:29] == [LevelVerdict.GOOD] * 29
    assert verdicts[30] is LevelVerdict.QUIET
    assert meters.add(block([0.06]))[0].verdict is LevelVerdict.GOOD


def test_lost_samples_leave_the_level_meters_unchanged():
    meters = LevelMeters(np.array([5.0]), RATE)
    before = meters.add(block([1.0]))
    assert meters.add(np.full((1, 10), np.nan, dtype=np.float32)) == before
