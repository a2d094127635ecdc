"""Flows and maps whose exponents are known, from closed forms and from the literature."""

import math

import pytest
from numba import njit

from tests.sim.exponents.dynamical_exponents import flow_exponents, map_exponents


@njit
def quadratic(time, state, parameters, out):
    """Lorenz's flow (kind 0) and Roessler's (kind 1)."""
    x, y, z = state
    kind, a, b, c = parameters
    if kind == 0.0:
        out[0], out[1], out[2] = a * (y - x), x * (b - z) - y, x * y - c * z
    else:
        out[0], out[1], out[2] = -y - z, x + a * y, b + z * (x - c)


@njit
def quadratic_jacobian(time, state, parameters, out):
    x, y, z = state
    kind, a, b, c = parameters
    out[:] = 0.0
    if kind == 0.0:
        out[0, 0], out[0, 1] = -a, a
        out[1, 0], out[1, 1], out[1, 2] = b - z, -1.0, -x
        out[2, 0], out[2, 1], out[2, 2] = y, x, -c
    else:
        out[0, 1] = out[0, 2] = -1.0
        out[1, 0], out[1, 1] = 1.0, a
        out[2, 0], out[2, 2] = z, x - c


@njit
def duffing(time, state, parameters, out):
    """x'' + damping x' + linear x + cubic x^3 = amplitude cos(omega t)."""
    damping, linear, cubic, amplitude, omega = parameters
    x, v = state
    out[0] = v
    out[1] = amplitude * math.cos(omega * time) - damping * v - linear * x - cubic * x**3


@njit
def duffing_jacobian(time, state, parameters, out):
    damping, linear, cubic, _, _ = parameters
    out[0, 0], out[0, 1] = 0.0, 1.0
    out[1, 0], out[1, 1] = -linear - 3.0 * cubic * state[0] ** 2, -damping


@njit
def henon(state, parameters, out):
    out[0], out[1] = 1.0 - parameters[0] * state[0] ** 2 + state[1], parameters[1] * state[0]
    return 1.0


@njit
def henon_jacobian(state, parameters, out):
    out[0, 0], out[0, 1] = -2.0 * parameters[0] * state[0], 1.0
    out[1, 0], out[1, 1] = parameters[1], 0.0


LORENZ = [0.0, 10.0, 28.0, 8.0 / 3.0]
ROESSLER = [1.0, 0.2, 0.2, 5.7]
DUFFINGS = {
    # Parameters, and the largest exponent.
    "ueda": ([0.05, 0.0, 1.0, 7.5, 1.0], 0.1034),
    "two wells, 0.4 cos t": ([0.25, -1.0, 1.0, 0.4, 1.0], 0.15738),
    "two wells, 0.5 cos 1.2 t": ([0.3, -1.0, 1.0, 0.5, 1.2], 0.1068),
    "two wells, 7 cos t": ([0.15, -1.0, 1.0, 7.0, 1.0], 0.10542),
}


def lorenz(readings, reading=0.5):
    return flow_exponents(
        quadratic, quadratic_jacobian, [1.0, 2.0, 20.0], LORENZ, reading, readings, tolerance=1e-8
    )


def roessler(readings):
    return flow_exponents(
        quadratic, quadratic_jacobian, [1.0, 1.0, 0.0], ROESSLER, 0.5, readings, tolerance=1e-8
    )


def forced(parameters, readings, tolerance=1e-8):
    quarter = 0.5 * math.pi / parameters[-1]
    return flow_exponents(
        duffing, duffing_jacobian, [0.5, 0.0], parameters, quarter, readings, tolerance=tolerance
    )


@pytest.mark.thorough
def test_lorenz_has_the_exponents_of_the_literature():
    found = lorenz(6000)
    assert found.is_long_enough
    assert found.exponents[0] == pytest.approx(0.9056, abs=4.0 * found.standard_errors[0])
    assert found.standard_errors[0] < 0.01
    assert abs(found.exponents[1]) < 1e-3
    assert found.exponents.sum() == pytest.approx(-(10.0 + 1.0 + 8.0 / 3.0), rel=1e-7)
    assert found.dimension == pytest.approx(2.062, abs=2e-3)


@pytest.mark.thorough
def test_roessler_has_the_exponents_of_the_literature():
    found = roessler(20_000)
    assert found.exponents[0] == pytest.approx(0.0714, abs=4.0 * found.standard_errors[0])
    assert found.standard_errors[0] < 0.004
    assert abs(found.exponents[1]) < 1e-3
    assert found.exponents[2] == pytest.approx(-5.394, abs=0.03)


@pytest.mark.parametrize("name", DUFFINGS)
def test_a_forced_oscillator_has_the_exponent_of_the_literature(name):
    parameters, known = DUFFINGS[name]
    found = forced(parameters, 10_000)
    assert found.is_long_enough
    assert found.exponents[0] == pytest.approx(known, abs=4.0 * found.standard_errors[0])
    assert found.standard_errors[0] < 0.006
    assert found.exponents.sum() == pytest.approx(-parameters[0], rel=1e-6)


def test_a_linear_oscillator_has_the_exponents_of_its_eigenvalues():
    found = forced([0.3, 1.0, 0.0, 2.0, 0.7], 800)
    assert found.exponents == pytest.approx([-0.15, -0.15], abs=2e-3)
    overdamped = forced([5.0, 4.0, 0.0, 2.0, 0.7], 800)
    assert overdamped.exponents == pytest.approx([-1.0, -4.0], rel=1e-6)


def test_a_stricter_tolerance_keeps_the_volume_better():
    ueda, _ = DUFFINGS["ueda"]
    loose, strict = (abs(forced(ueda, 200, tolerance).exponents.sum() + 0.05) for tolerance in (1e-3, 1e-6))
    assert strict < 0.02 * loose


def test_henon_has_the_exponents_of_the_literature():
    found = map_exponents(henon, henon_jacobian, [0.1, 0.1], [1.4, 0.3], 1, 200_000)
    assert found.exponents[0] == pytest.approx(0.41922, abs=4.0 * found.standard_errors[0])
    assert found.standard_errors[0] < 2e-3
    assert found.exponents.sum() == pytest.approx(math.log(0.3), rel=1e-9)
    assert found.dimension == pytest.approx(1.258, abs=3e-3)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"changes": 4}, "1 to the size of the state"),
        ({"readings": 1}, "from 2 or more"),
        ({"reading": 0.0}, "Reading 0.0"),
        ({"tolerance": 2.0}, "below 1"),
    ],
)
def test_numbers_that_make_no_run_are_refused(options, message):
    given = {"reading": 0.5, "readings": 10, **options}
    with pytest.raises(ValueError, match=message):
        flow_exponents(quadratic, quadratic_jacobian, [1.0, 2.0, 20.0], LORENZ, **given)


def test_readings_so_rare_that_changes_run_together_are_refused():
    with pytest.raises(ValueError, match="take readings more often"):
        lorenz(10, reading=5.0)


def test_a_motion_that_leaves_the_finite_numbers_is_refused():
    with pytest.raises(ValueError, match="left the finite numbers"):
        map_exponents(henon, henon_jacobian, [10.0, 10.0], [1.4, 0.3], 1, 100)


LONG = {
    # Means and errors of runs a hundred times longer than those above, by other programs.
    "lorenz": (0.90583, 0.00014),
    "roessler": (0.07124, 0.00013),
    "ueda": (0.10331, 0.00027),
    "two wells, 0.4 cos t": (0.15738, 0.00034),
    "two wells, 0.5 cos 1.2 t": (0.1068, 0.0011),
}


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", LONG)
def test_a_long_run_agrees_with_other_programs_to_a_part_in_a_thousand(name):
    known, error = LONG[name]
    match name:
        case "lorenz":
            found = lorenz(200_000)
        case "roessler":
            found = roessler(1_000_000)
        case _:
            found = forced(DUFFINGS[name][0], 400_000)
    assert found.is_long_enough
    assert found.standard_errors[0] < 1e-3
    assert found.exponents[0] == pytest.approx(known, abs=4.0 * math.hypot(error, found.standard_errors[0]))
