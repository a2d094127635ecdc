"""The free Hertz collision has a closed form; so has its speed law."""

import math

import numpy as np
import pytest
from scipy.special import gamma

from vibench.sim import gong2025
from vibench.sim.contact.contact import HELD, LEFT, advance_contact, begin_contact, contact_workspace
from vibench.sim.flight.flight import FORCE_TERMS
from vibench.sim.model.state import VY, VZ, Y
from vibench.sim.slots.parameters import SIDE, STATE_SIZE, parameters

DURATION_CONSTANT = 0.8 * math.sqrt(math.pi) * gamma(0.4) / gamma(0.9)
LOOSE = {"k0": 0.0, "k1": 0.0, "k2": 0.0, "c0": 0.0, "c1": 0.0, "c2": 0.0, "contact_stiffness": 4.9e9}


def free_collision(speed, tolerance, limit=1.0):
    """m1 strikes m2 at ``speed`` while both hang on nothing; gives code, duration and state."""
    par = parameters(gong2025())._replace(**LOOSE)
    state = np.zeros(STATE_SIZE)
    total = par.mass1 + par.mass2
    state[Y], state[VY], state[VZ] = par.upper, speed * par.mass2 / total, -speed * par.mass1 / total
    begin_contact(state, 1.0, par, tolerance)
    force = np.zeros(FORCE_TERMS)
    code, duration = advance_contact(state, 0.0, limit, force, 0.0, par, tolerance, contact_workspace())
    return code, duration, state


def closed_form(speed):
    par = parameters(gong2025())
    deepest = (1.25 * par.reduced_mass * speed**2 / 4.9e9) ** 0.4
    return deepest, DURATION_CONSTANT * deepest / speed


def test_the_constant_of_the_collision_time_is_hertzs():
    assert pytest.approx(2.943275184, rel=1e-9) == DURATION_CONSTANT


@pytest.mark.parametrize(
    ("speed", "deepest_um", "duration_us"),
    [
        (0.01, 0.2327, 68.50),
        (0.05, 0.8434, 49.65),
        (0.1, 1.4685, 43.22),
        (0.3, 3.5365, 34.70),
        (1.0, 9.2656, 27.27),
    ],
)
@pytest.mark.parametrize(("tolerance", "allowed"), [(1e-4, 1e-4), (1e-6, 4e-6), (1e-10, 4e-10)])
def test_a_free_collision_lasts_as_hertz_says_and_loses_nothing(
    speed, deepest_um, duration_us, tolerance, allowed
):
    code, duration, state = free_collision(speed, tolerance)
    deepest, lasting = closed_form(speed)
    assert deepest == pytest.approx(deepest_um * 1e-6, rel=3e-4)
    assert lasting == pytest.approx(duration_us * 1e-6, rel=2e-4)
    assert (code, state[SIDE]) == (LEFT, 0.0)
    assert duration == pytest.approx(lasting, rel=allowed)
    assert state[VZ] - state[VY] == pytest.approx(speed, rel=allowed)


def test_the_slowest_touch_is_resolved_too():
    _, duration, state = free_collision(1e-9, 1e-6)
    assert duration == pytest.approx(closed_form(1e-9)[1], rel=0.2)
    assert state[SIDE] == 0.0


def test_a_contact_that_outlasts_its_limit_is_held_exactly_there():
    limit = 0.4 * closed_form(0.1)[1]
    code, reached, state = free_collision(0.1, 1e-6, limit)
    assert (code, reached, state[SIDE]) == (HELD, limit, 1.0)


def test_a_collision_that_loses_sight_of_numbers_ends():
    code, _, _ = free_collision(math.nan, 1e-6)
    assert code not in (LEFT, HELD)
