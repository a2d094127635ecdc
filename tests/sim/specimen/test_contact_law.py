"""Contact laws: parameters, fits, and names in requests."""

import math
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from pydantic import TypeAdapter

from vibench.sim import Hertz, HuntCrossley, LinearGap, NoContact, PowerLaw, RigidStops, gong2025, spring_of
from vibench.sim.specimen.contact_laws import (
    CONTACT_LAWS,
    ContactLaw,
    fit_linear_gap,
    fit_power_law,
    law_by_name,
)

HERTZ = Hertz(4.9e9)
GAP = 45e-6


@pytest.mark.parametrize("name", ["power:3", "power:5", "power:47", "power:201", "power:3+5+7"])
def test_a_fitted_power_law_has_the_force_of_hertz_at_one_micrometre(name):
    spring = spring_of(gong2025(contact=name))
    hertz = spring_of(gong2025())
    there, still = np.array([GAP + 1e-6]), np.zeros(1)
    assert spring.force(there, still) == pytest.approx(hertz.force(there, still), rel=1e-12)


@settings(deadline=None)
@given(st.floats(1e-6, 60e-6))
def test_the_force_of_a_sum_of_three_powers_lies_between_the_lowest_and_the_highest_power(p):
    at, still = np.array([p]), np.zeros(1)
    third, sum_, seventh = (
        float(spring_of(gong2025(contact=name)).force(at, still)[0])
        for name in ("power:3", "power:3+5+7", "power:7")
    )
    assert min(third, seventh) <= sum_ * (1 + 1e-12)
    assert sum_ <= max(third, seventh) * (1 + 1e-12)


@pytest.mark.parametrize(
    ("text", "law"),
    [
        ("hertz", HERTZ),
        ("linear", NoContact()),
        ("linear_gap:2e6", LinearGap(2e6)),
        ("linear_gap", fit_linear_gap(HERTZ.stiffness)),
        ("hunt_crossley:0.3", HuntCrossley(HERTZ.stiffness, 0.3)),
        ("rigid:0.8", RigidStops(0.8)),
        ("power:5", fit_power_law([5], HERTZ.stiffness, GAP)),
        ("power:7+3", fit_power_law([3, 7], HERTZ.stiffness, GAP)),
        ("power:3@0.25+7@0.75", fit_power_law([3, 7], HERTZ.stiffness, GAP, shares=[0.25, 0.75])),
    ],
)
def test_a_contact_law_is_found_by_its_name(text, law):
    assert law_by_name(text, HERTZ.stiffness, GAP) == law


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("steel", r"Contact 'steel' is not known: give one of hertz, linear"),
        ("power:", r"Contact 'power:' is not known"),
        ("power:3:1e300", r"displacement inf N is not allowed"),
        ("power:x", r"Contact 'power:x' is not known"),
        ("power:4", r"Exponents \[4\] are not allowed: give odd"),
        ("power:1", r"Exponents \[1\] are not allowed"),
        ("power:3+3", r"Exponents \[3, 3\] are not allowed"),
        ("power:3+5+7+9+11+13+15", "at most 6"),
        ("power:3@0.5+5@0.6", "with the sum 1"),
        ("rigid:1.2", r"Restitution 1\.2 is not allowed"),
        ("rigid", r"Contact 'rigid' is not known"),
        ("hunt_crossley:-1", r"loss -1\.0 s/m is not allowed"),
        ("linear_gap:nan", "Stop stiffness nan N/m is not allowed"),
    ],
)
def test_the_name_of_an_unknown_contact_law_is_refused_with_a_readable_message(text, sentence):
    with pytest.raises(ValueError, match=sentence):
        law_by_name(text, HERTZ.stiffness, GAP)


@pytest.mark.parametrize(
    "name", ["hertz", "linear", "linear_gap", "hunt_crossley:0.5", "rigid:0.7", "power:3+5+7"]
)
def test_a_contact_law_round_trips_through_a_file(name):
    law = gong2025(contact=name).contact
    adapter = TypeAdapter(ContactLaw)
    assert adapter.validate_json(adapter.dump_json(law)) == law


@pytest.mark.parametrize("gap_m", [1e-300, 1e-16, 1e16, 1e300, (1e-300, math.inf), (1e-5, 1e300)])
def test_a_gap_that_rounding_errors_exceed_is_refused(gap_m):
    with pytest.raises(ValueError, match=r"it must be from 1e-15 to 1e\+15, and finite at one stop"):
        gong2025(gap_m=gap_m)


def test_a_power_law_without_terms_is_refused():
    with pytest.raises(ValueError, match="without terms is not allowed"):
        PowerLaw(46e-6, ())


def test_the_contact_law_union_and_registry_contain_the_same_laws():
    assert {law.__dataclass_fields__["kind"].default for law in get_args(ContactLaw)} == set(CONTACT_LAWS)
