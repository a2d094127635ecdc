"""Bisection of the frequency range that contains a jump."""

import pytest
from hypothesis import given, strategies as st

from vibench.acquisition.control.jump_controller import JumpBracket, is_on_branch, side
from vibench.acquisition.control.settling_controller import SettledPoint
from vibench.acquisition.recording import JumpSide


def search_jump(jump_hz, resolution_hz, before_hz=100.0, after_hz=110.0, height=0.4):
    """Search a jump between two smooth branches; return its bracket and the requested frequencies."""

    def response(frequency_hz):
        is_before = (frequency_hz < jump_hz) == (before_hz < after_hz)
        return (1.0 if is_before else height) * (1 + 0.01 * abs(frequency_hz - before_hz))

    before, after = (SettledPoint(each_hz, response(each_hz)) for each_hz in (before_hz, after_hz))
    asked = []
    search = JumpBracket([before], after)
    while not search.is_narrow(resolution_hz):
        asked.append(search.frequency_hz)
        search.narrow(SettledPoint(asked[-1], response(asked[-1])))
    return search, asked


@given(jump_hz=st.floats(100.01, 109.99), resolution_hz=st.floats(0.05, 4.0), height=st.floats(0.1, 0.6))
def test_a_jump_bracket_contains_the_jump_and_is_no_wider_than_requested(jump_hz, resolution_hz, height):
    for ends in ((100.0, 110.0), (110.0, 100.0)):
        jump, asked = search_jump(jump_hz, resolution_hz, *ends, height)
        low, high = sorted((jump.before.frequency_hz, jump.after.frequency_hz))
        assert low - 1e-9 <= jump_hz <= high + 1e-9
        assert abs(jump.after.frequency_hz - jump.before.frequency_hz) <= resolution_hz * (1 + 1e-9)
        assert len(asked) <= 8


def test_a_narrow_enough_bracket_needs_no_measurement():
    jump, asked = search_jump(105.0, 10.0)
    assert asked == []
    assert (jump.before.frequency_hz, jump.after.frequency_hz) == (100.0, 110.0)


@pytest.mark.parametrize(("response", "expected"), [(1.2, True), (1 / 1.2, True), (1.3, False), (0.6, False)])
def test_two_points_that_differ_by_less_than_half_the_jump_factor_in_db_are_on_one_branch(response, expected):
    assert is_on_branch(SettledPoint(100, response), SettledPoint(100, 1.0), factor=1.5) is expected


@pytest.mark.parametrize(
    ("response", "expected"),
    [(3.6, JumpSide.BEFORE), (4.1, JumpSide.BEFORE), (5.0, JumpSide.AFTER), (1.6, JumpSide.AFTER)],
)
def test_a_point_on_a_third_branch_counts_as_being_after_the_jump(response, expected):
    assert side(SettledPoint(177, response), SettledPoint(175, 3.6), SettledPoint(180, 5.4)) is expected


def test_a_chaotic_motion_of_the_same_size_counts_as_another_branch():
    linear, chaotic = SettledPoint(100, 1.0, period=1), SettledPoint(100, 1.05, period=0)
    assert not is_on_branch(chaotic, linear, factor=1.5)
    assert is_on_branch(SettledPoint(100, 1.4, period=0), chaotic, factor=1.5)
