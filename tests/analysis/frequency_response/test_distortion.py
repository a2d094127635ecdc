"""A recorded odd multisine separates even distortion, odd distortion and noise."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from tests.analysis import synthetic_recordings as synthetic
from vibench.acquisition.plan import OddMultisine
from vibench.analysis import analyse
from vibench.analysis.frequency_response.noise_response import distortion
from vibench.analysis.report._transmission import distortion_caption, distortion_figure

REPETITION_HZ, PERIODS, REALISATIONS, SETTLE_S = 4.0, 4, 4, 0.5
NOISE_M_PER_S = 2e-5


@pytest.fixture(scope="module")
def analyse_with(tmp_path_factory):
    """Return a function that analyses a mass with twice the base motion and a distorted velocity.

    `through` is the transmission, `base_gain` the base sensor's gain; both may vary by realisation.
    """

    @cache
    def record_and_analyse(
        distorted,
        realisations=REALISATIONS,
        drive_noise_m=0.0,
        through=lambda hz, number: np.full(hz.size, 2.0),
        base_gain=lambda number: 1.0,
    ):
        plan = OddMultisine(
            amplitude_vpp=0.2,
            band_start_hz=60.0,
            band_stop_hz=400.0,
            repetition_hz=REPETITION_HZ,
            realisations=realisations,
            periods=PERIODS,
            settle_s=SETTLE_S,
        )
        rng = np.random.default_rng(51)
        played_s = PERIODS / REPETITION_HZ
        time_s = np.arange(round((SETTLE_S + played_s) * synthetic.RATE)) / synthetic.RATE
        omega = 2 * np.pi * REPETITION_HZ * np.array(plan.excited_lines)
        motions, velocities, parts = [], [], []
        for number in range(realisations):
            angles = np.outer(omega, time_s) + rng.uniform(0, 2 * np.pi, (omega.size, 1))
            ratio = through(omega / (2 * np.pi), number)
            velocity = 1e-6 * omega * np.abs(ratio) @ np.cos(angles + np.angle(ratio)[:, None])
            velocity += distorted(velocity / 0.01) * 0.01 + NOISE_M_PER_S * rng.standard_normal(time_s.size)
            motions.append(
                (1e-6 * np.sin(angles).sum(axis=0), -1e-6 * base_gain(number) * omega**2 @ np.sin(angles))
            )
            velocities.append(velocity)
            start_s = number * time_s.size / synthetic.RATE + SETTLE_S
            parts.append(synthetic.Part("realisation", start_s, start_s + played_s, {"realisation": number}))
        motion, acceleration = np.concatenate(motions, axis=1)
        base = synthetic.Motion(motion + drive_noise_m * rng.standard_normal(motion.size), acceleration)
        folder = tmp_path_factory.mktemp("odd")
        return analyse(
            synthetic.write_recording(folder, plan, base, np.concatenate(velocities), parts, name="odd")
        )

    return record_and_analyse


def square(velocity):
    return 0.05 * velocity**2


def cube(velocity):
    return 0.02 * velocity**3


@pytest.mark.thorough
def test_the_driven_spectral_lines_are_taken_from_the_plan_despite_drive_noise(analyse_with):
    quiet, noisy = (analyse_with(np.zeros_like, drive_noise_m=noise) for noise in (0.0, 2e-6))
    driven = np.rint(noisy.response.frequency_response.frequency_hz / REPETITION_HZ)
    np.testing.assert_array_equal(driven, quiet.excitation.excited_lines)
    off = noisy.response.frequency_response.magnitude / 2 - 1
    assert np.max(np.abs(off)) < 0.01
    assert not set(driven) & set(noisy.response.periodic.detection.order)


@pytest.mark.thorough
def test_a_square_nonlinearity_distorts_even_lines_and_a_cubic_nonlinearity_distorts_odd_lines(analyse_with):
    even, odd = (distortion(analyse_with(each).response.periodic) for each in (square, cube))
    noise = even.detection_noise_m_per_s
    assert even.even_m_per_s > 20 * noise > 20 * even.odd_m_per_s / 3
    assert odd.odd_m_per_s > 20 * noise > 20 * odd.even_m_per_s / 3
    # A cubic term scatters the realisations; the noise is unchanged.
    assert odd.distortion_share > 10 * odd.noise_share
    assert odd.noise_share == pytest.approx(even.noise_share, rel=0.2)


def test_the_remainder_of_an_undistorted_response_is_only_the_added_noise(analyse_with):
    found = distortion(analyse_with(np.zeros_like).response.periodic)
    # White noise of variance s^2 adds 4 s^2 / (averaged samples) to a squared amplitude.
    expected = NOISE_M_PER_S * np.sqrt(4 * REPETITION_HZ / (synthetic.RATE * PERIODS))
    assert found.detection_noise_m_per_s == pytest.approx(expected, rel=0.1)
    assert found.odd_m_per_s < expected > found.even_m_per_s
    assert found.distortion_share < 2 * found.noise_share


def _mode(natural_hz, hz, damping=0.08):
    ratio = hz / natural_hz
    return 2 + 1 / (1 - ratio**2 + 2j * damping * ratio)


@pytest.mark.parametrize(
    ("drifting", "named"),
    [
        ({"through": lambda hz, number: np.full(hz.size, 2 + 0.004 * number)}, "gain"),
        ({"base_gain": lambda number: 1 - 0.003 * number}, "gain"),
        ({"through": lambda hz, number: _mode(200 * (1 + 0.002 * number), hz)}, "frequencies"),
        ({"through": lambda hz, number: _mode(200, hz, 0.08 + 0.002 * number)}, "all lines together"),
    ],
)
def test_drift_between_realisations_is_not_reported_as_distortion(analyse_with, drifting, named):
    analysis = analyse_with(np.zeros_like, **drifting)
    found = distortion(analysis.response.periodic)
    assert found.distortion_share < 3 * found.noise_share
    (remark,) = [each.text for each in analysis.checks if each.what == "Drift"]
    assert named in remark
    assert ("gain" in remark) == (named == "gain"), "a mode that moves is not a drift of a gain"
    caption = distortion_caption(analysis.response.periodic)
    assert "drift" in caption
    assert ("; at most" in caption) == (named != "gain")


@pytest.mark.parametrize(
    "distorted",
    [
        np.zeros_like,
        cube,
        square,
        lambda v: 0.2 * v**3,  # few spectral lines scatter by less than 3 %
        lambda v: v * (np.abs(v) > 2.0),
    ],
)
def test_distortion_is_not_reported_as_drift(analyse_with, distorted):
    assert "Drift" not in [each.what for each in analyse_with(distorted).checks]


def test_the_distortion_figure_shows_all_lines_and_its_caption_states_the_levels(analyse_with):
    analysis = analyse_with(square)
    periodic = analysis.response.periodic
    drawn = distortion_figure(analysis, periodic)
    shares, quiet = drawn.figure.axes
    shown = {each.get_label(): each.get_ydata() for each in (*shares.get_lines(), *quiet.get_lines())}
    even = periodic.detection.order % 2 == 0
    np.testing.assert_array_equal(
        shown["even lines, not driven"], periodic.detection.response_amplitude[even]
    )
    assert shown["nonlinear distortion"].size == periodic.frequency_response.frequency_hz.size
    assert f"{1e6 * distortion(periodic).even_m_per_s:.3g} µm/s on even lines" in drawn.caption


def test_distortion_is_reported_as_unknown_for_one_realisation(analyse_with):
    periodic = analyse_with(np.zeros_like, realisations=1).response.periodic
    assert distortion(periodic).distortion_share is None
    assert "one realisation cannot show distortion" in distortion_caption(periodic)


def test_noise_larger_than_the_transmission_is_reported_in_whole_percent(analyse_with):
    periodic = analyse_with(np.zeros_like, realisations=1).response.periodic
    noisy = replace(periodic, noise_variance=np.full_like(periodic.noise_variance, 1e3))
    share = 100 * distortion(noisy).noise_share
    assert share > 1000
    caption = distortion_caption(noisy)
    assert f"relative to the transmission (median): {share:.0f} % due to channel noise" in caption
    assert "channel noise or chaos of the specimen" in caption, "chaos is not called noise"


def test_a_shifting_narrow_mode_is_reported_as_drift(analyse_with):
    """A linear specimen whose mode at 264 Hz shifted by 0.3 % was once reported with 1.2 % distortion."""

    def through(hz, number):
        ratio = hz / (260 * (1 + 0.0015 * number))
        return 1 + 1 / (1 - ratio**2 + 2j * 0.0005 * ratio)

    found = distortion(analyse_with(np.zeros_like, through=through).response.periodic)
    assert found.drift.gain_share == 0.0
    assert found.drift.frequency_share == pytest.approx(0.0015 * np.std(range(REALISATIONS), ddof=1), rel=0.1)
