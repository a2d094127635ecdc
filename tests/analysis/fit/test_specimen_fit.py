"""A fit recovers the measured specimen, and its intervals have their stated coverage."""

import math
from dataclasses import replace

import numpy as np
import pytest

from vibench.analysis import Estimator, FrequencyResponse, InvalidRequest, NotEnoughData
from vibench.analysis.fit.lines import LINEAR, Parameter, parameter_value, with_values
from vibench.analysis.fit.specimen_fit import Assumption, fit_specimen
from vibench.analysis.frequency_response.results import FrequencyResponseSettings
from vibench.analysis.signals import student_half_width
from vibench.sim import base_transmissibility, gong2025

NOMINAL = gong2025()
TRUE = {
    Parameter.DAMPING_TIME: 3.1e-5,
    Parameter.F0: 318.0,
    Parameter.F1: 103.0,
    Parameter.F2: 395.0,
}
LINES_HZ = np.arange(60.0, 560.0, 4.0)
SD = 0.02


def transmission(specimen, rng, sd=SD, lines_hz=LINES_HZ, gain=1.0):
    """Return a transmission with line scatter ``sd`` in ln(magnitude) and in phase, stated as such."""
    scatter = sd * (rng.standard_normal(lines_hz.size) + 1j * rng.standard_normal(lines_hz.size))
    value = gain * base_transmissibility(specimen, lines_hz)[:, 0] * np.exp(scatter)
    spread = np.full(lines_hz.size, sd)
    return FrequencyResponse(
        frequency_hz=lines_hz,
        value=value,
        coherence=np.full(lines_hz.size, 0.99),
        n_eff=20.0,
        relative_sd_magnitude=spread,
        sd_phase_rad=spread,
        half_width=student_half_width(spread, 20.0, 0.95),
        coherence_significance=0.3,
        resolution_hz=0.0,
        segments_used=20,
        segments_excluded=0,
        settings=FrequencyResponseSettings(Estimator.DRIVE, 6400.0, 1600, "boxcar", 0.0, 0.95),
    )


def realisation_average(specimen, rng, sd, realisations):
    """Return a transmission whose scatter is estimated from few realisations; ``sd`` where |X/U| = 1."""
    exact = base_transmissibility(specimen, LINES_HZ)[:, 0]
    shape = (realisations, LINES_HZ.size)
    noise = sd * np.hypot(1.0, np.abs(exact)) * np.sqrt(realisations)
    each = exact + noise * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape))
    value = each.mean(axis=0)
    scatter = np.sum(np.abs(each - value) ** 2, axis=0) / (2 * (realisations - 1)) / realisations
    spread = np.sqrt(scatter) / np.abs(value)
    coherence = 1.0 / (1.0 + 2.0 * realisations * spread**2)
    told = {"value": value, "coherence": coherence, "n_eff": float(realisations)}
    return replace(transmission(specimen, rng), **told, relative_sd_magnitude=spread, sd_phase_rad=spread)


@pytest.fixture(scope="module")
def true():
    return with_values(NOMINAL, TRUE)


def test_scaled_gaps_and_dampings_keep_their_ratios():
    """Scaling keeps the ratio of the two gaps and of the dampings, even if one damping is zero."""
    own = replace(gong2025(gap_m=(60e-6, 30e-6)), dampings=(0.3, 0.0, 0.02))
    read = {name: parameter_value(own, name) for name in (*LINEAR, Parameter.GAP)}
    assert with_values(own, {}) == with_values(own, read)
    assert with_values(own, {}).dampings == pytest.approx(own.dampings, rel=1e-12)
    assert read[Parameter.GAP] == 30e-6
    wider = with_values(own, {Parameter.GAP: 45e-6})
    assert wider.gaps_m == pytest.approx((90e-6, 45e-6), rel=1e-12)
    assert wider.dampings == pytest.approx(own.dampings, rel=1e-12)
    duller = with_values(own, {Parameter.DAMPING_TIME: 3.0 * read[Parameter.DAMPING_TIME]})
    assert duller.dampings == pytest.approx((0.9, 0.0, 0.06), rel=1e-12)
    assert duller.gaps_m == own.gaps_m
    stiffer = with_values(own, {Parameter.F2: 2.0 * read[Parameter.F2]})
    assert stiffer.stiffnesses == pytest.approx(
        (own.stiffnesses[0], own.stiffnesses[1], 4.0 * own.stiffnesses[2]), rel=1e-12
    )
    assert stiffer.dampings == pytest.approx((0.3, 0.0, 0.08), rel=1e-12)


def test_a_noise_free_transmission_recovers_the_specimen(true):
    clean = transmission(true, np.random.default_rng(0), sd=1e-9)
    fit = fit_specimen(clean, NOMINAL)
    for name, value in TRUE.items():
        assert fit.value(name).value == pytest.approx(value, rel=1e-6)


@pytest.mark.thorough
def test_fit_intervals_have_their_stated_coverage_and_width(true):
    rng = np.random.default_rng(20250101)
    draws = 120
    fits = [fit_specimen(transmission(true, rng), NOMINAL) for _ in range(draws)]
    # Three standard deviations of the binomial number of covered values: 114 +- 7.2 of 120.
    slack = 3 * math.sqrt(draws * 0.95 * 0.05)
    for name, value in TRUE.items():
        found = [fit.value(name) for fit in fits]
        held = sum(each.low <= value <= each.high for each in found)
        assert abs(held - 0.95 * draws) <= slack, name
        scatter = np.std([each.value for each in found], ddof=1)
        assert np.mean([each.sd for each in found]) == pytest.approx(scatter, rel=0.3)
        # No bias: the mean of the fits is the true value within four standard errors.
        assert np.mean([each.value for each in found]) == pytest.approx(
            value, abs=4 * scatter / math.sqrt(draws)
        )
    assert np.mean([fit.reduced_chi_square for fit in fits]) == pytest.approx(1.0, abs=0.1)


@pytest.mark.thorough
def test_fit_intervals_hold_if_the_scatter_is_estimated_from_three_realisations(true):
    """Few spectral lines determine the damping, and the scatter of each line is known to 50 % only."""
    rng, held, draws = np.random.default_rng(2), [], 120
    for _ in range(draws):
        fit = fit_specimen(realisation_average(true, rng, 2e-3, 3), NOMINAL)
        assert fit.fits
        told = (fit.value(each) for each in (Parameter.DAMPING_TIME, Parameter.F1))
        held += [each.low <= TRUE[each.parameter] <= each.high for each in told]
    assert sum(held) > 0.95 * len(held) - 3 * math.sqrt(0.95 * 0.05 * len(held))


@pytest.mark.thorough
def test_noise_of_any_level_neither_rejects_a_true_model_nor_makes_the_fit_diverge(true):
    rng, said = np.random.default_rng(3), []
    for sd in np.geomspace(0.03, 0.5, 30):
        try:
            fit = fit_specimen(realisation_average(true, rng, sd, 4), NOMINAL)
        except NotEnoughData as error:
            said.append(str(error))
        else:
            assert fit.fits, (sd, fit.reduced_chi_square, fit.limit)
    assert 0 < len(said) < 30
    assert all(each.endswith("measure longer, or with a stronger drive") for each in said)


def test_the_high_pass_and_the_delay_of_a_channel_do_not_bias_the_fit(true):
    clean = transmission(true, np.random.default_rng(6), sd=1e-3)
    turned = 0.5 / LINES_HZ + 2 * np.pi * LINES_HZ * 20e-6
    fit = fit_specimen(replace(clean, value=clean.value * np.exp(1j * turned)), NOMINAL)
    for name, value in TRUE.items():
        assert fit.value(name).value == pytest.approx(value, abs=4 * fit.value(name).sd)
    assert fit.phase_rad == pytest.approx((0.5 / 100.0, 2 * np.pi * 100.0 * 20e-6), abs=3e-4)
    assert fit.reduced_chi_square < 1.5


def test_frequency_intervals_include_the_uncertainty_of_the_converter_clock(true):
    """A clock that runs 40 ppm fast lowers all frequencies by 40 ppm, without any scatter."""
    slow = transmission(true, np.random.default_rng(7), sd=1e-6)
    fit = fit_specimen(replace(slow, frequency_hz=LINES_HZ * (1 - 40e-6)), NOMINAL)
    for name, value in TRUE.items():
        found = fit.value(name)
        assert abs(found.value / value - 1) == pytest.approx(40e-6, rel=0.05), name
        assert found.low <= value <= found.high, name


def test_parameters_that_are_not_fitted_keep_their_described_values(true):
    fit = fit_specimen(transmission(true, np.random.default_rng(1)), true, (Parameter.DAMPING_TIME,))
    assert [each.parameter for each in fit.values] == [Parameter.DAMPING_TIME]
    assert fit.specimen.stiffnesses == pytest.approx(true.stiffnesses, rel=1e-12)
    with pytest.raises(InvalidRequest, match="f0_hz was not fitted"):
        fit.value(Parameter.F0)


WRONG = {
    Assumption.M0: {Parameter.M0: 1.03},
    Assumption.M1: {Parameter.M1: 1.03},
    Assumption.C0: {Parameter.C0: 3.0},
    Assumption.SENSITIVITY: {},
}


@pytest.mark.parametrize("assumption", WRONG)
def test_a_fit_with_one_wrong_assumption_is_rejected_and_the_assumption_is_named_as_suspect(true, assumption):
    factors = WRONG[assumption]
    other = with_values(true, {each: f * parameter_value(true, each) for each, f in factors.items()})
    gain = 1.01 if assumption is Assumption.SENSITIVITY else 1.0
    found = transmission(other, np.random.default_rng(2), sd=2e-3, gain=gain)
    fit = fit_specimen(found, NOMINAL, is_nonlinear=False)
    assert not fit.fits
    assert fit.values == ()
    assert fit.specimen == NOMINAL
    assert fit.suspects[0].assumption is assumption
    assert fit.suspects[0].mends
    assert not any(each.may_be_it for each in fit.suspects[1:])
    if factors:
        # A fit with the suspected parameter free finds its true value.
        (free,) = factors
        mended = fit_specimen(found, NOMINAL, (*LINEAR, free)).value(free)
        assert abs(mended.value - parameter_value(other, free)) < 4 * mended.sd


def test_causes_that_cannot_be_distinguished_are_named_together(true):
    """At one level of linear motion, a damper and friction have the same effect."""
    other = with_values(true, {Parameter.C0: 3.0 * parameter_value(true, Parameter.C0)})
    fit = fit_specimen(transmission(other, np.random.default_rng(2), sd=2e-3), NOMINAL)
    assert {each.assumption for each in fit.suspects if each.may_be_it} == {
        Assumption.C0,
        Assumption.FRICTION,
    }


@pytest.mark.thorough
def test_the_uncertainty_of_a_sensor_widens_the_intervals_that_depend_on_it(true):
    """A sensitivity error of 1 % is no contradiction if the calibration uncertainty is 1 %."""
    off = transmission(true, np.random.default_rng(8), sd=2e-3, gain=1.01)
    allowed = fit_specimen(off, NOMINAL, scale_sd=0.01)
    assert allowed.fits
    for name, value in TRUE.items():
        assert allowed.value(name).value == pytest.approx(value, abs=4 * allowed.value(name).sd)
    assert not fit_specimen(off, NOMINAL, scale_sd=0.001).fits


@pytest.mark.parametrize("averages", [3, 12])
def test_the_reduced_chi_square_of_a_true_model_is_one_even_with_few_averages(true, averages):
    rng = np.random.default_rng(30 + averages)
    lines_hz = np.arange(60.0, 560.0, 1.0)
    draws = 0.01 * (rng.standard_normal((averages, lines_hz.size, 2)))
    mean = draws.mean(axis=0)
    spread = np.sqrt(np.sum((draws - mean) ** 2, axis=(0, 2)) / (2 * (averages - 1)) / averages)
    clean = transmission(true, rng, sd=1e-12, lines_hz=lines_hz)
    found = replace(
        clean,
        value=clean.value * np.exp(mean[:, 0] + 1j * mean[:, 1]),
        relative_sd_magnitude=spread,
        sd_phase_rad=spread,
        n_eff=float(averages),
    )
    fit = fit_specimen(found, NOMINAL)
    assert fit.fits
    assert fit.reduced_chi_square == pytest.approx(1.0, abs=4 / math.sqrt(lines_hz.size))


def test_a_fit_finds_the_values_of_a_specimen_far_from_its_description():
    far = with_values(NOMINAL, {name: value * 1.07 for name, value in TRUE.items()})
    fit = fit_specimen(transmission(far, np.random.default_rng(3)), NOMINAL)
    for name in LINEAR:
        assert fit.value(name).value == pytest.approx(parameter_value(far, name), abs=4 * fit.value(name).sd)
    assert fit.reduced_chi_square < 1.5


def test_parameters_that_a_transmission_cannot_determine_are_refused(true):
    clean = transmission(true, np.random.default_rng(4))
    with pytest.raises(InvalidRequest, match="a transmission can determine"):
        fit_specimen(clean, NOMINAL, (Parameter.GAP,))
    with pytest.raises(InvalidRequest, match="a fit of no parameter was requested"):
        fit_specimen(clean, NOMINAL, ())
    with pytest.raises(InvalidRequest, match="at most one mass"):
        fit_specimen(clean, NOMINAL, (*LINEAR, Parameter.M0, Parameter.M1))


def test_a_fit_to_too_few_lines_is_refused(true):
    few = transmission(true, np.random.default_rng(5), lines_hz=LINES_HZ[:6])
    with pytest.raises(NotEnoughData, match="6 lines"):
        fit_specimen(few, NOMINAL)
