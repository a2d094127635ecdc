"""Noise analysis requests: resolution, averages, estimator and quantity of the result."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from tests.analysis import synthetic_recordings as synthetic
from vibench.acquisition import Overload
from vibench.analysis import (
    Estimator,
    FrequencyResponseRequest,
    InvalidRequest,
    MagnitudeScale,
    NotEnoughData,
    Window,
    analyse,
    parse_view,
)
from vibench.analysis.frequency_response.results import longest_segment
from vibench.analysis.signals import effective_averages, hop_samples, taper

RATE = 6400.0


@pytest.fixture(scope="module")
def streamed(streamed_file):
    """Path of one recording of streamed noise."""
    return streamed_file()


def response(path, **asked):
    return analyse(path, FrequencyResponseRequest(**asked)).response


@pytest.mark.thorough
@pytest.mark.parametrize("noisy", ["base", "m0"])
def test_a_biased_estimate_has_a_remark_on_the_noise(streamed_noise, tmp_path, noisy):
    plan, base, velocity, parts = streamed_noise
    rng = np.random.default_rng(4)
    if noisy == "base":
        extra = 0.3 * np.std(base.acceleration) * rng.standard_normal(velocity.size)
        base = synthetic.Motion(base.displacement_m, base.acceleration + extra)
    else:
        velocity = velocity + 0.3 * np.std(velocity) * rng.standard_normal(velocity.size)
    path = synthetic.write_recording(tmp_path, plan, base, velocity, parts)
    for estimator, biased_by in ((Estimator.H1, "base"), (Estimator.H2, "m0"), (Estimator.HV, noisy)):
        # A wrong noise ratio makes the HV estimate biased by noise on the other channel.
        ratio = {"noise_ratio": 1e6 if noisy == "base" else 0.0} if estimator is Estimator.HV else {}
        checks = analyse(path, FrequencyResponseRequest(estimator=estimator, **ratio)).checks
        remarks = [each.text for each in checks if each.what == "Estimator"]
        assert bool(remarks) == (biased_by == noisy), estimator
        assert all(estimator.value in each and "drive" in each for each in remarks)


@pytest.mark.parametrize("quiet", [1.0, 0.5, 1e-3])
def test_noise_that_is_switched_on_and_off_has_a_remark(streamed_noise, tmp_path, quiet):
    """Decays across the ends of segments bias damping: six bounds for a mode of 1 % and bursts of 5 s."""
    plan, base, velocity, parts = streamed_noise
    gate = np.where(np.arange(velocity.size) % (10 * synthetic.RATE) < 5 * synthetic.RATE, 1.0, quiet)
    base = synthetic.Motion(gate * base.displacement_m, gate * base.acceleration)
    checks = analyse(synthetic.write_recording(tmp_path, plan, base, gate * velocity, parts)).checks
    assert ("Steady drive" in [each.what for each in checks]) == (quiet < 0.1)


@pytest.mark.parametrize("window", list(Window))
def test_the_requested_resolution_is_the_noise_bandwidth_of_a_line(streamed, window):
    found = response(streamed, resolution_hz=3.0, window=window).frequency_response
    assert found.resolution_hz == pytest.approx(3.0, rel=1e-3)
    assert found.settings.window == window.value


@pytest.mark.thorough
@pytest.mark.parametrize("averages", [4.0, 25.0])
def test_the_requested_number_of_averages_is_reached_and_hardly_exceeded(streamed, averages):
    found = response(streamed, averages=averages).frequency_response
    assert averages <= found.n_eff < 1.25 * averages


@given(
    samples=st.integers(2_000, 20_000),
    averages=st.floats(2, 40),
    window=st.sampled_from(Window),
    overlap=st.floats(0, 0.8),
)
def test_the_longest_allowed_segment_gives_the_requested_averages(samples, averages, window, overlap):
    segment = longest_segment(samples, averages, window, overlap)
    if segment < 32:
        return
    hop = hop_samples(segment, overlap)
    used = np.ones((samples - segment) // hop + 1, dtype=bool)
    # The hop is rounded to whole samples, so one segment may be missing at the end.
    assert effective_averages(taper(window, segment), hop, used) > 0.93 * averages * (1 - 1 / used.size)


def test_segments_that_touch_lost_or_overloaded_samples_are_left_out_and_counted(streamed_file):
    hole = (round(3 * RATE), round(3 * RATE) + 50)
    overload = Overload("m0_velocity", round(9 * RATE), round(9 * RATE) + 19)
    elsewhere = Overload("m0_velocity", round(9.5 * RATE), round(9.5 * RATE) + 4)
    found = response(streamed_file(hole=hole, overloads=(overload, elsewhere)), segment_s=0.5, overlap=0.0)
    assert (found.lost_samples, found.overloaded_samples) == (50, 25)
    assert found.left_out == found.frequency_response.segments_excluded == 3
    assert found.frequency_response.segments_used == 37
    np.testing.assert_allclose(found.frequency_response.value, 2, rtol=1.5e-2)


@pytest.mark.thorough
def test_an_overloaded_realisation_is_left_out(noise_file):
    overload = Overload("base_acceleration", round(3.2 * RATE), round(3.2 * RATE) + 4)
    path = noise_file(overloads=(overload,))
    found = response(path)
    assert found.left_out == 1
    assert found.overloaded_samples == 5
    (check,) = (each for each in analyse(path).checks if each.what == "Overloads")
    assert check.text.endswith("hits with such samples are left out of the transmission")
    both = (overload, Overload("m0_velocity", round(7.2 * RATE), round(7.2 * RATE)))
    with pytest.raises(NotEnoughData, match="6 samples near full scale"):
        response(noise_file(overloads=both))


@pytest.mark.thorough
def test_a_request_for_periodic_noise_may_set_an_estimator_but_not_a_resolution(noise_file):
    found = response(noise_file(), estimator=Estimator.HV, noise_ratio=1e-6, confidence=0.8)
    assert found.frequency_response.settings.estimator is Estimator.HV
    assert found.frequency_response.settings.confidence == 0.8
    with pytest.raises(InvalidRequest, match=r"repeats every 0\.25 s.*lines are 4 Hz apart.*streamed noise"):
        response(noise_file(), resolution_hz=1.0)


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (
            {"resolution_hz": 1.0, "averages": 9.0},
            "a resolution and a number of averages were given; give one",
        ),
        ({"resolution_hz": 0.0}, "must be finite and more than 0"),
        ({"segment_s": np.inf}, "a segment length of inf was requested; it must be finite"),
        ({"averages": 1.0}, "needs more than 1"),
        ({"estimator": Estimator.HV}, "without a noise ratio"),
        ({"noise_ratio": 1.0}, "only hv"),
        ({"overlap": 1.0}, "below 1"),
        ({"confidence": 95.0}, "between 0 and 1"),
    ],
)
def test_an_invalid_noise_request_names_the_allowed_values(asked, said):
    with pytest.raises(InvalidRequest, match=said):
        FrequencyResponseRequest(**asked)


@pytest.mark.parametrize(
    ("asked", "length"),
    [
        ({"resolution_hz": 0.05}, "30 s"),
        ({"resolution_hz": 1e-308}, "inf s"),
        ({"segment_s": 1e308}, "inf s"),
    ],
)
def test_a_frequency_resolution_too_fine_for_the_record_is_refused(streamed, asked, length):
    with pytest.raises(
        NotEnoughData, match=f"20 s of noise were recorded, less than two segments of the {length}"
    ):
        response(streamed, **asked)


@pytest.mark.thorough
def test_a_displacement_ratio_is_converted_to_the_requested_quantities(streamed):
    found = response(streamed).frequency_response
    view = parse_view("velocity/acceleration", MagnitudeScale.DECIBEL)
    shown = view.apply(found)
    np.testing.assert_allclose(shown.value, found.value / (2j * np.pi * found.frequency_hz), rtol=1e-12)
    np.testing.assert_allclose(shown.magnitude, found.magnitude * view.factor(found.frequency_hz), rtol=1e-12)
    np.testing.assert_allclose(view.place(shown.magnitude), shown.decibel)
    assert view.unit == "s"
    np.testing.assert_allclose(parse_view("velocity").apply(found).value, found.value)
    with pytest.raises(InvalidRequest, match="such as velocity/acceleration"):
        parse_view("speed")
