"""The similarity of response curves, checked against hand calculations."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from vibench.analysis import InvalidRequest, NotEnoughData, similarity
from vibench.analysis.overlay.similarity import LogarithmOf, SimilarityCurve

FREQUENCY_HZ = np.arange(10.0, 510.0, 5.0)


def curve(response, amplitude_m=5e-6):
    return SimilarityCurve(FREQUENCY_HZ[: len(response)], np.asarray(response, dtype=float), amplitude_m)


def test_a_curve_has_similarity_1_to_itself_even_where_its_logarithm_is_zero():
    itself = curve(np.geomspace(0.1, 10, 101)[:100])
    one = curve(np.ones(100))
    assert similarity(itself, itself).rate == 1
    assert similarity(one, one, LogarithmOf.NORMALISED).rate == 1


def test_the_difference_of_curves_matches_equation_6_of_the_paper():
    # 5 um x 2 = 0.01 mm, log10 = -2; 5 um x 0.2 = 0.001 mm, log10 = -3: the relative difference is 0.5.
    found = similarity(curve([2.0, 2.0]), curve([0.2, 2.0]), LogarithmOf.MILLIMETRES)
    assert found.difference == pytest.approx([0.5, 0.0])
    assert found.rate == 0.5
    backwards = similarity(curve([0.2]), curve([2.0]), LogarithmOf.MILLIMETRES)
    assert backwards.difference == pytest.approx([1 / 3])


def test_similarity_depends_on_the_argument_of_the_logarithm():
    reference, model = curve(np.full(50, 2.0)), curve(np.full(50, 1.5))
    rates = {of: similarity(reference, model, of).rate for of in LogarithmOf}
    # log10(0.75) = -0.125; the reference logarithms have magnitudes 0.3, 5, 2 and 1.
    assert rates == {
        LogarithmOf.NORMALISED: 0.0,
        LogarithmOf.METRES: 1.0,
        LogarithmOf.MILLIMETRES: 1.0,
        LogarithmOf.MICROMETRES: 0.0,
    }


@given(st.floats(0.01, 0.5), st.floats(0.01, 0.5), st.integers(0, 100))
def test_a_larger_threshold_never_finds_fewer_similar_points(first, second, seed):
    rng = np.random.default_rng(seed)
    reference, model = curve(rng.lognormal(size=60)), curve(rng.lognormal(size=60))
    narrow, wide = sorted((first, second))
    assert (
        similarity(reference, model, threshold=narrow).rate
        <= similarity(reference, model, threshold=wide).rate
    )


def test_points_without_a_value_are_left_out_of_the_similarity_and_counted():
    found = similarity(curve([2.0, np.nan, 2.0, 2.0]), curve([2.0, 2.0, np.nan, 0.2]))
    assert (found.left_out, found.rate) == (2, 0.5)
    with pytest.raises(NotEnoughData, match="no frequency"):
        similarity(curve([np.nan]), curve([1.0]))


def test_the_similarity_interval_covers_the_true_rate():
    # Points are independent: about 95 % of the intervals must contain the true rate.
    covered = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        alike = rng.random(100) < 0.7
        found = similarity(curve(np.full(100, 2.0)), curve(np.where(alike, 2.0, 0.02)), seed=seed)
        covered += found.low <= 0.7 <= found.high
    # A bootstrap of 20 blocks of five points gives intervals that are slightly too short.
    assert 0.87 <= covered / 200 <= 0.99


def test_clusters_of_similar_points_widen_the_similarity_interval():
    rng = np.random.default_rng(4)
    runs = np.repeat(rng.random(10) < 0.6, 10)
    mixed = rng.permutation(runs)
    widths = []
    for alike in (runs, mixed):
        found = similarity(curve(np.full(100, 2.0)), curve(np.where(alike, 2.0, 0.02)))
        widths.append(found.high - found.low)
    assert widths[0] > 1.5 * widths[1]


def test_curves_are_interpolated_for_similarity_and_never_extrapolated():
    power = SimilarityCurve(np.array([10.0, 100.0]), np.array([1.0, 100.0]), 1e-6)
    assert power.at(np.array([20.0])).response == pytest.approx([4.0])
    with pytest.raises(InvalidRequest, match="10 to 100 Hz"):
        power.at(np.array([5.0]))


@pytest.mark.parametrize(
    ("frequencies", "responses", "amplitude_m", "complaint"),
    [
        ([1.0, 2.0], [1.0], 1e-6, "equal length"),
        ([2.0, 1.0], [1.0, 1.0], 1e-6, "ascend"),
        ([1.0], [1.0], 0.0, "positive"),
    ],
)
def test_an_invalid_response_curve_is_refused(frequencies, responses, amplitude_m, complaint):
    with pytest.raises(InvalidRequest, match=complaint):
        SimilarityCurve(np.array(frequencies), np.array(responses), amplitude_m)


def test_curves_at_different_frequencies_are_refused():
    with pytest.raises(InvalidRequest, match=r"Curve\.at"):
        similarity(curve(np.ones(3)), SimilarityCurve(np.array([1.0, 2.0, 3.0]), np.ones(3), 1e-6))
