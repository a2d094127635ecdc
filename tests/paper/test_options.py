"""Every option changes its own setting, and an invalid value is refused in one sentence."""

import math

import numpy as np
import pytest

from vibench.analysis import InvalidRequest
from vibench.cli.paper.claim import at_least, claim, costly_claim
from vibench.cli.paper.collision_claims import sweep_of
from vibench.cli.paper.options import CLOSEST, OPTIONS, Case, case_with, parse_option
from vibench.cli.paper.reading import Evidence, Reading
from vibench.cli.paper.responses import Responses
from vibench.cli.paper.settings import SETTINGS, claims_by_setting
from vibench.cli.paper.textbook_methods import ode45, textbook_exponents
from vibench.sim import Harmonic, LinearSweep, Rest, spring_of

CASE = Case()
NOTHING = Evidence(lambda study: pytest.fail(f"asked for {study}"))


def case_for(*said, **options):
    return case_with(Case(**options), said)


def test_the_zeta_option_sets_the_damping_ratio_of_every_mass():
    case = case_for("zeta=0.0165")
    study = case.study(("hertz",), (5e-6,))
    for specimen in (case.specimen(), study.scene((0,) * 6, Rest()).specimen):
        m, k, c = (np.array(each) for each in (specimen.masses, specimen.stiffnesses, specimen.dampings))
        np.testing.assert_allclose(c / (2.0 * np.sqrt(k * m)), 0.0165, rtol=1e-12)
    undamped = case.study(("hertz",), (5e-6,), damping_times_s=(0.0,))
    assert undamped.scene((0,) * 6, Rest()).specimen.dampings == (0.0, 0.0, 0.0)
    assert "c_i = 2 · 0.0165 · m_i ω_i" in case.choices


@pytest.mark.parametrize("model", ["power:3", "power:47", "power:3@0.05+5@0.15+7@0.8"])
def test_a_fitted_model_has_the_contact_force_at_the_fitted_indentation(model):
    case = case_for("fit=0.45e-6")
    fitted, stops = (
        spring_of(case.specimen(each)).force(np.array([45.45e-6]), np.zeros(1))[0]
        for each in (model, "hertz")
    )
    k1_p = case.specimen().stiffnesses[1] * 45.45e-6
    assert fitted - k1_p == pytest.approx(stops - k1_p, rel=1e-9)
    assert case.study((model,), (5e-6,)).models == (f"{model}:4.5e-07",)
    assert CASE.model_name(model) == model
    assert case.model_name("hertz") == "hertz"


def test_the_sweep_option_gives_a_linear_sweep_up_or_down():
    assert sweep_of(CASE)[1] == LinearSweep(150.0, 350.0, 200.0, 5e-6)
    assert sweep_of(case_for("sweep=down"))[1] == LinearSweep(350.0, 150.0, 200.0, 5e-6)
    assert sweep_of(case_for("sweep-amplitude=4e-6"))[1].amplitude_m == 4e-6


@pytest.mark.parametrize("power", [1.0, 2.0, 3.0])
def test_the_sweep_amplitude_follows_the_requested_power_of_frequency(power):
    even, drive = sweep_of(case_for(f"sweep-falls={power}"))
    rate_hz = drive.sample_rate_hz
    for at_s in (0.0, 100.0, 199.0):
        cycles = drive.displacement_m[int(at_s * rate_hz) : int((at_s + 0.5) * rate_hz)]
        middle_hz = float(even.frequency_hz(np.array([at_s + 0.25]))[0])
        largest = math.sqrt(2.0) * float(np.std(cycles))
        assert largest == pytest.approx(5e-6 * (266.0 / middle_hz) ** power, rel=0.01)


@pytest.mark.thorough
def test_the_exponents_option_uses_ode45_only_for_colliding_points():
    case = case_for("exponents=ode45", duration_s=0.3, window_s=0.1)
    frequency_hz = np.array([30.0, 260.0])
    some = np.ones(2)
    curve = Responses(frequency_hz, some, some, some, np.array([-1.5, 110.0]), np.array([False, True]))
    found = Reading(NOTHING, case).exponents_of(curve, 5e-6)
    assert found[0] == -1.5
    drives = [Harmonic(260.0, 5e-6)]
    assert found[1] == textbook_exponents(case.specimen(), drives, ode45(), 0.2, 0.1)[0]
    assert Reading(NOTHING, CASE).exponents_of(curve, 5e-6)[1] == 110.0


def test_the_options_for_sum_and_logarithm_and_gap_are_applied():
    case = case_for("sum=3@0.1+7@0.9", "log=m", "gap=30e-6")
    assert (case.sum_model, case.logarithm_of, case.gap_m) == ("power:3@0.1+7@0.9", "m", 30e-6)


def test_every_option_accepts_its_own_example():
    for name, option in OPTIONS.items():
        assert parse_option(f"{name}={option.example}").of(CASE).name


@pytest.mark.parametrize("name", ["zeta", "gap", "fit", "compared", "sweep-amplitude", "sweep-falls"])
@pytest.mark.parametrize("value", ["-1", "nan", "inf", "", "much"])
def test_an_invalid_number_is_refused_with_a_readable_message_that_quotes_it(name, value):
    with pytest.raises(InvalidRequest) as refused:
        parse_option(f"{name}={value}")
    said = str(refused.value)
    assert value in said
    assert "\n" not in said


@pytest.mark.parametrize(
    ("said", "answer"),
    [
        ("zet=1", "is not an option of the paper; give one such as zeta=0.0165"),
        ("sum=3+4", "Exponents .* are not allowed"),
        ("log=km", "normalised, m, mm, um"),
        ("exponents=rk4", "exact or ode45"),
        ("sweep=sideways", "up or down"),
    ],
)
def test_an_unknown_option_value_is_refused_with_the_allowed_values(said, answer):
    with pytest.raises(InvalidRequest, match=answer):
        parse_option(said)


def test_claims_that_always_hold_have_no_row_in_the_settings_table():
    wanted = at_least("it", "", 1.0)

    @claim("", "", wanted)
    def always(_):
        return (1.0,)

    @claim("", "", wanted)
    def under_zeta(reading):
        return (float(reading.case.damping_ratio is not None),)

    @costly_claim("", "", wanted)
    def fit(reading):
        return (float(reading.case.fit_m < 1e-6),)

    table = claims_by_setting((always, under_zeta, fit), NOTHING, CASE)
    names = [CASE.name, *(each.name for each in SETTINGS), CLOSEST.name]
    assert list(table.headings) == ["claim", *names]
    held, zeta, fitted = table.rows
    assert held[1:] == ("1 of 3", "1 of 2", "1 of 2", "2 of 2", "1 of 2", "1 of 2", "2 of 3")
    assert zeta == ("under-zeta", "fails", "fails", "fails", "holds", "fails", "fails", "fails")
    assert fitted == ("fit", "fails", "", "", "", "", "", "holds")
