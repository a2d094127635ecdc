"""The verdict of a claim follows from its numbers: first with the defaults, then with each option."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, strategies as st

from vibench.analysis import InvalidRequest, LogarithmOf
from vibench.cli.paper.claim import Expectation, Verdict, about, at_least, at_most, claim, judgement
from vibench.cli.paper.options import AS_CHOSEN, Case, change, damping
from vibench.cli.paper.page import verdict_text
from vibench.cli.paper.reading import Evidence

CASE = Case()
DAMPED, VERY_DAMPED = damping(3e-5), damping(5e-5)


def no_studies(study):
    raise AssertionError(f"a synthetic measurement asked for {study}")


def make(measure, *wanted, tried=(), **more):
    return claim("section 3", "Read off.", *wanted, tried=tried, **more)(measure)


def judge(values_by_damping, *wanted, tried=(DAMPED, VERY_DAMPED)):
    def measure(reading):
        """It is so."""
        return values_by_damping[reading.case.damping_time_s]

    return judgement(make(measure, *wanted, tried=tried), Evidence(no_studies), CASE)


def test_the_key_and_text_of_a_claim_come_from_its_function():
    @claim("section 3", "Read off.", at_least("peak", "Hz", 95.0), draws=3)
    def first_peak(_reading):
        """The first peak
        is high.
        """

    assert (first_peak.key, first_peak.says, first_peak.draws) == ("first-peak", "The first peak is high.", 3)


def test_a_claim_within_its_bounds_holds_without_testing_options():
    found = judge({2e-5: (95.4,)}, about("peak", "Hz", 95.0, 1.0))
    assert found.verdict is Verdict.HOLDS
    assert [each.case.name for each in found.findings] == [AS_CHOSEN]


def test_a_claim_names_the_first_option_under_which_it_holds():
    found = judge({2e-5: (80.0,), 3e-5: (120.0,), 5e-5: (130.0,)}, at_least("exponent", "1/s", 100.0))
    assert found.verdict is Verdict.HOLDS_UNDER
    assert found.first_met.case.name == DAMPED.name
    assert len(found.findings) == 2


def test_a_claim_that_holds_under_no_option_fails_and_keeps_all_findings():
    found = judge({2e-5: (1.0,), 3e-5: (2.0,), 5e-5: (3.0,)}, at_most("share", "%", 0.5))
    assert found.verdict is Verdict.FAILS
    assert found.first_met is None
    assert [each.values for each in found.findings] == [(1.0,), (2.0,), (3.0,)]


def test_a_claim_that_holds_for_some_initial_states_gives_their_share():
    last_hz = (310.0, 288.0, 291.0, 330.0)
    sweep = make(lambda r: (last_hz[r.case.draw],), about("last", "Hz", 290.0, 5.0), tried=(DAMPED,), draws=4)
    found = judgement(sweep, Evidence(no_studies), CASE)
    assert found.verdict is Verdict.HOLDS_FOR_SHARE
    (only,) = found.findings
    assert (only.met_draws, only.values, only.spread(0)) == (2, (310.0,), (288.0, 330.0))
    assert verdict_text(found) == "holds for a share of starts: 2 of 4 (15 to 85 %)"


def test_a_claim_that_holds_for_no_initial_state_is_tested_under_options():
    def measure(reading):
        return (100.0 + reading.case.draw if reading.case.damping_time_s == 3e-5 else 10.0,)

    both = make(measure, at_least("exponent", "1/s", 50.0), tried=(DAMPED,), draws=3)
    found = judgement(both, Evidence(no_studies), CASE)
    assert found.verdict is Verdict.HOLDS_UNDER
    assert [len(each.draws) for each in found.findings] == [3, 3]


def test_random_initial_states_are_reproducible_and_within_a_millionth_of_the_gap():
    assert CASE.start == (0.0,) * 6
    moved = replace(CASE, draw=3)
    assert 0.0 < max(abs(value) for value in moved.start[:3]) <= 1e-6 * CASE.gap_m
    assert moved.start == replace(CASE, draw=3).start != replace(CASE, draw=4).start


def test_a_claim_fails_if_one_number_is_out_of_bounds():
    wanted = (about("first", "Hz", 201.0, 1.0), about("second", "Hz", 435.0, 1.0))
    assert judge({2e-5: (201.5, 435.5)}, *wanted, tried=()).verdict is Verdict.HOLDS
    assert judge({2e-5: (201.5, 437.0)}, *wanted, tried=()).verdict is Verdict.FAILS


def test_a_measured_value_of_nan_meets_no_expectation():
    anything = Expectation("peak", "Hz", -math.inf, math.inf)
    assert judge({2e-5: (math.nan,)}, anything, tried=()).verdict is Verdict.FAILS


@given(low=st.floats(-1e6, 1e6), width=st.floats(0, 1e6), value=st.floats(-2e6, 2e6))
def test_an_expectation_is_met_at_and_between_its_bounds(low, width, value):
    wanted = make(no_studies, Expectation("anything", "", low, low + width))
    assert wanted.is_met_by((low,))
    assert wanted.is_met_by((low + width,))
    assert wanted.is_met_by((value,)) == (low <= value <= low + width)


def test_expectation_bounds_in_the_wrong_order_are_refused():
    with pytest.raises(InvalidRequest, match="lower bound first"):
        Expectation("peak", "Hz", 2.0, 1.0)


def test_the_measurement_of_a_claim_must_give_a_number_for_each_expectation():
    with pytest.raises(InvalidRequest, match="requires 1 numbers, but 2"):
        judge({2e-5: (1.0, 2.0)}, at_least("one", "", 0.0))


def test_an_option_of_the_paper_changes_only_its_own_setting():
    assert DAMPED.of(CASE) == replace(CASE, name=DAMPED.name, damping_time_s=3e-5)
    for alternative, changes in (
        (change("log", LogarithmOf.NORMALISED), {"logarithm_of": LogarithmOf.NORMALISED}),
        (change("compared", 600.0), {"similarity_highest_hz": 600.0}),
        (change("sweep-amplitude", 4e-6), {"sweep_amplitude_m": 4e-6}),
    ):
        assert alternative.of(CASE) == replace(CASE, name=alternative.name, **changes)
    assert "4 µm" in change("sweep-amplitude", 4e-6).name


def test_numbers_of_a_claim_are_shown_with_their_units():
    assert about("peak", "Hz", 95.0, 1.0).sentence == "94 to 96 Hz"
    assert at_least("share", "%", 0.9).sentence == "≥ 90 %"
    assert at_most("largest", "1/s", 10.0).sentence == "≤ 10 1/s"
    assert at_least("share", "%", 0.9).number_text(0.5) == "50 %"
    assert at_least("share", "%", 0.9).number_text(math.nan) == "none"
