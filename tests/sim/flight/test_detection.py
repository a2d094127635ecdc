"""No touch is missed, however short: polynomials whose peak is known to the last digit."""

import numpy as np
from hypothesis import given, settings, strategies as st

from vibench.sim.flight.detection import NEVER, SERIES_TERMS, first_contact

GAP = 45e-6
LENGTH = 4e-5


def parabola(peak, at, bend):
    """p = peak - bend (t - at)^2 / 2 as a series."""
    series = np.zeros(SERIES_TERMS)
    series[:3] = [peak - 0.5 * bend * at**2, bend * at, -0.5 * bend]
    return series


@settings(deadline=None)
@given(
    over=st.floats(1e-16, 1e-7),
    at=st.floats(1e-6, LENGTH),
    bend=st.floats(10.0, 5e4),
    slack=st.floats(1.0, 30.0),
    side=st.sampled_from([-1.0, 1.0]),
)
def test_a_peak_beyond_the_stop_is_found_at_its_first_crossing(over, at, bend, slack, side):
    crossing = at - np.sqrt(2.0 * over / bend)
    if crossing <= 0.0:
        return
    found = first_contact(side * parabola(GAP + over, at, bend), LENGTH, GAP, GAP, slack * bend, GAP)
    assert 0.0 < found <= crossing + 1e-14
    short = 0.5 * bend * ((at - found) ** 2 - (at - crossing) ** 2)
    assert short < 2e-16, "the touch was called before the gap had closed"


@settings(deadline=None)
@given(share=st.floats(0.1, 0.9), back=st.floats(0.05, 0.4), slack=st.floats(1.0, 30.0))
def test_a_stop_on_one_side_alone_is_found_after_p_was_away_from_it(share, back, slack):
    """While p moves towards the side that has no stop, the other one is watched all the same."""
    at, bend = share * back, GAP / (back * LENGTH) ** 2
    series = parabola(-0.5 * GAP, at * LENGTH, bend)  # up from the lower stop's side, and down to -GAP
    bound = slack * bend
    below = first_contact(series, LENGTH, GAP, np.inf, bound, GAP)
    above = first_contact(-series, LENGTH, np.inf, GAP, bound, GAP)
    far = first_contact(series, LENGTH, GAP, 1.0, bound, GAP)
    assert below == above
    assert abs(below - (at + back) * LENGTH) < 1e-9 * LENGTH
    assert abs(below - far) < 1e-9 * LENGTH


@settings(deadline=None)
@given(
    under=st.floats(1e-15, 1e-6),
    at=st.floats(0.0, LENGTH),
    bend=st.floats(10.0, 5e4),
    slack=st.floats(1.0, 30.0),
)
def test_a_peak_short_of_the_stop_is_no_touch(under, at, bend, slack):
    assert first_contact(parabola(GAP - under, at, bend), LENGTH, GAP, GAP, slack * bend, GAP) == NEVER


@settings(deadline=None)
@given(speed=st.floats(1e-6, 1.0), slack=st.floats(1.0, 10.0))
def test_a_stop_that_is_being_left_is_no_touch_until_the_return(speed, slack):
    pull = -1e5
    series = np.zeros(SERIES_TERMS)
    series[:3] = [GAP, -speed, -0.5 * pull]
    found = first_contact(series, LENGTH, GAP, GAP, slack * abs(pull), GAP)
    back = 2.0 * speed / abs(pull)
    deepest = speed**2 / (2.0 * abs(pull))
    if back < LENGTH * 0.999 and deepest < GAP:
        # Within the distance that counts as touching, or within rounding of the return.
        assert abs(found - back) * speed < 1e-16 + 1e-9 * back * speed
    elif back > LENGTH * 1.001 and deepest < GAP:
        assert found == NEVER


def test_the_opposite_stop_is_watched_while_p_runs_away_from_the_near_one():
    series = np.zeros(SERIES_TERMS)
    series[:2] = [0.5 * GAP, -10.0]
    found = first_contact(series, LENGTH, GAP, GAP, 1.0, GAP)
    assert abs(found - 1.5 * GAP / 10.0) < 1e-15
