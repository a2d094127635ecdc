"""Branches by shooting match independent exact solutions and the exact flow."""

import math

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import fsolve

from vibench.sim import (
    AmplitudePath,
    ArcEnd,
    BifurcationKind,
    FrequencyPath,
    Harmonic,
    gong2025,
    integrate,
    steady_response,
)
from vibench.sim.branches import BranchOrigin, MotionSearch, shoot_branches
from vibench.sim.periodic.branch import OrbitShape
from vibench.sim.periodic.shooting import PeriodMap
from vibench.sim.specimen.specimen import state_scales

pytestmark = pytest.mark.timeout(300)
"""The first test compiles the kernels: a minute of processor time, possibly beside other compilations."""

FEW = MotionSearch(places=2, starts=2)
LEVEL = FrequencyPath((5e-6,))


def error(specimen, drive, found, k):
    """Return the scaled distance between a branch point and its image after one period."""
    mapping = PeriodMap(specimen, found.shape, found.periods)
    state = found.branch.states[k]
    return float(np.abs((mapping.image(state, drive) - state) / state_scales(specimen, drive)).max())


@pytest.fixture(scope="module")
def near_the_first_resonance():
    """Branches of the paper's specimen around its first resonance, from 88 to 101 Hz at 5 um."""
    return list(shoot_branches(gong2025(), LEVEL, 88.0, 101.0, MotionSearch(places=3, starts=4)))


class PiecewiseLinear:
    """The specimen between linear stops as two linear systems, solved by matrix exponentials."""

    def __init__(self, specimen, drive):
        mass, damping, stiffness = specimen.mass_matrix, specimen.damping_matrix, specimen.stiffness_matrix
        self.b, stop = np.array([0.0, 1.0, -1.0]), specimen.contact.stiffness
        self.gap, self.omega, self.mass = specimen.gap_m, 2.0 * math.pi * drive.frequency_hz, mass
        self.damping, self.stiffness = damping, stiffness
        self.pressed, self.push = stiffness + stop * np.outer(self.b, self.b), stop * self.gap * self.b
        self.force = np.zeros(3, complex)
        self.force[0] = (specimen.stiffnesses[0] + 1j * self.omega * specimen.dampings[0]) * (
            drive.amplitude_m / 1j
        )

    def fly(self, state, start, length):
        """Return the state after a time without contact."""
        return self.step(state, start, length, self.stiffness, np.zeros(3))

    def press(self, state, start, length):
        """Return the state after a time in contact with the stop at positive p."""
        return self.step(state, start, length, self.pressed, self.push)

    def step(self, state, start, length, stiffness, push):
        inverse = np.linalg.inv(self.mass)
        system = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ stiffness, -inverse @ self.damping]])
        x = np.linalg.solve(
            stiffness - self.omega**2 * self.mass + 1j * self.omega * self.damping, self.force
        )
        rest = np.concatenate([np.linalg.solve(stiffness, push), np.zeros(3)])

        def steady(time):
            turned = x * np.exp(1j * self.omega * time)
            return np.concatenate([turned.real, (1j * self.omega * turned).real]) + rest

        return expm(system * length) @ (state - steady(start)) + steady(start + length)

    def motion(self, state, touch, contact):
        """Return entry state, time and duration of the contact, one per half period of a mirrored motion."""
        half = math.pi / self.omega

        def equations(unknowns):
            entry, start, length = unknowns[:6] * 1e-6, unknowns[6] * 1e-3, unknowns[7] * 1e-5
            entry = entry * np.repeat([1.0, 1e3], 3)
            leaving = self.press(entry, start, length)
            back = self.fly(leaving, start + length, half - length)
            p_in, p_out = self.b @ entry[:3], self.b @ leaving[:3]
            moved = (back + entry) / np.repeat([1e-6, 1e-3], 3)
            return np.array([*moved, (p_in - self.gap) / 1e-6, (p_out - self.gap) / 1e-6])

        guess = np.array([*(state[:3] / 1e-6), *(state[3:] / 1e-3), touch / 1e-3, contact / 1e-5])
        found, _, code, said = fsolve(equations, guess, xtol=1e-13, full_output=True)
        assert code == 1 or np.abs(equations(found)).max() < 1e-7, said
        entry = found[:6] * np.repeat([1e-6, 1e-3], 3)
        return entry, found[6] * 1e-3, found[7] * 1e-5


@pytest.mark.thorough
def test_a_branch_with_linear_stops_matches_the_piecewise_exact_solution():
    specimen, amplitude = gong2025(contact="linear_gap"), 20e-6
    found = next(shoot_branches(specimen, FrequencyPath((amplitude,)), 128.0, 140.0, FEW))
    assert found.shape is OrbitShape.MIRRORED
    branch = found.branch
    checked = 0
    for k in range(0, len(branch.frequencies_hz), 8):
        drive = Harmonic(float(branch.frequencies_hz[k]), amplitude)
        run = integrate(
            specimen, drive, 2.0 / drive.frequency_hz, "reference", branch.states[k], 2e5 * drive.frequency_hz
        )
        p = run.states[:, 1] - run.states[:, 2]
        inside = p > specimen.gap_m
        enters = int(np.flatnonzero(inside[1:] & ~inside[:-1])[0]) + 1
        lasts = int(np.argmin(inside[enters:])) / (2e5 * drive.frequency_hz)
        piecewise = PiecewiseLinear(specimen, drive)
        entry, start, contact = piecewise.motion(run.states[enters], run.time_s[enters], lasts)
        half = math.pi / piecewise.omega
        leaving = piecewise.press(entry, start, contact)
        turn = math.ceil((start + contact) * drive.frequency_hz) / drive.frequency_hz
        ahead = turn - start - contact
        if ahead < half - contact:
            exact = piecewise.fly(leaving, start + contact, ahead)
        else:
            opposite = -piecewise.press(
                -piecewise.fly(leaving, start + contact, half - contact), start, contact
            )
            exact = piecewise.fly(opposite, start + half + contact, ahead - half)
        difference = (exact - branch.states[k]) / state_scales(specimen, drive)
        assert np.abs(difference).max() < 1e-7
        checked += 1
    assert checked > 5


@pytest.mark.thorough
def test_every_branch_point_is_periodic_within_its_error(near_the_first_resonance):
    specimen = gong2025()
    for found in near_the_first_resonance:
        branch = found.branch
        # End points are excluded: the period map is singular where a branch joins another one.
        inner = range(1, len(branch.frequencies_hz) - 1)
        assert max(error(specimen, Harmonic(branch.frequencies_hz[k], 5e-6), found, k) for k in inner) < 2e-9
        assert np.median(branch.left_out) < 1e-6


@pytest.mark.slow
def test_an_isolated_branch_of_period_three_is_found_from_random_states(near_the_first_resonance):
    (isolated,) = (each for each in near_the_first_resonance if each.is_isolated)
    assert isolated.periods == 3
    assert isolated.branch.begin is isolated.branch.end is ArcEnd.CLOSED
    assert isolated.origin is BranchOrigin.SEARCH
    folds = [e.frequency_hz for e in isolated.branch.events if e.kind is BifurcationKind.FOLD]
    assert sorted(folds) == pytest.approx([94.188, 98.815], abs=0.01)
    assert 0.2 < isolated.branch.is_stable.mean() < 0.8
    # The motion does not repeat after one drive period.
    k = int(np.flatnonzero(isolated.branch.is_stable)[0])
    drive = Harmonic(float(isolated.branch.frequencies_hz[k]), 5e-6)
    once = PeriodMap(gong2025()).image(isolated.branch.states[k], drive)
    assert np.abs((once - isolated.branch.states[k]) / state_scales(gong2025(), drive)).max() > 1e-3


@pytest.mark.thorough
def test_the_asymmetric_branch_begins_and_ends_at_symmetry_breaking(near_the_first_resonance):
    mirrored = near_the_first_resonance[0]
    assert (mirrored.periods, mirrored.shape) == (1, OrbitShape.MIRRORED)
    (broken,) = (e for e in near_the_first_resonance if e.origin is BranchOrigin.SYMMETRY_BREAKING)
    own = [e.frequency_hz for e in mirrored.branch.events if e.kind is BifurcationKind.SYMMETRY_BREAKING]
    joins = [e.frequency_hz for e in broken.branch.events if e.kind is BifurcationKind.SYMMETRY_BREAKING]
    assert broken.has_twin
    assert broken.branch.begin is broken.branch.end is ArcEnd.JOINED
    assert sorted(joins) == pytest.approx(sorted(own), abs=0.02)


@pytest.mark.thorough
def test_the_linear_motion_at_a_grazing_point_just_reaches_the_stop():
    specimen = gong2025()
    free = gong2025(contact="linear")
    linear = steady_response(free, Harmonic(60.0, 1e-6), "reference", 20.0, 1.0)
    at_gap = specimen.gap_m / linear.relative_i
    found = next(shoot_branches(specimen, AmplitudePath(60.0), 0.9 * at_gap, 1.1 * at_gap, FEW))
    grazing = next(e for e in found.branch.events if e.kind is BifurcationKind.GRAZING)
    assert grazing.amplitude_m == pytest.approx(at_gap, rel=1e-5)


@pytest.mark.slow
def test_a_rigid_stop_branch_is_exact_until_a_grazing_contact():
    specimen = gong2025(contact="rigid:0.8")
    found = list(shoot_branches(specimen, FrequencyPath((20e-6,)), 110.0, 150.0, FEW))
    assert found
    for each in found:
        branch = each.branch
        inner = range(1, len(branch.frequencies_hz) - 1)
        worst = max(error(specimen, Harmonic(float(branch.frequencies_hz[k]), 20e-6), each, k) for k in inner)
        assert worst < 2e-9
        if branch.end is ArcEnd.STEP_TOO_SHORT:
            assert branch.events[-1].kind is BifurcationKind.GRAZING


@pytest.mark.thorough
def test_each_branch_point_uses_the_recorded_level_at_its_frequency():
    specimen = gong2025()
    path = FrequencyPath((18e-6, 20e-6, 21e-6), (125.0, 130.0, 140.0))
    found = next(shoot_branches(specimen, path, 126.0, 138.0, FEW))
    branch = found.branch
    assert branch.amplitudes_m == pytest.approx([path.drive(f)[1] for f in branch.frequencies_hz])
    assert np.ptp(branch.amplitudes_m) > 1e-6
    for k in range(0, len(branch.frequencies_hz), 10):
        drive = Harmonic(float(branch.frequencies_hz[k]), float(branch.amplitudes_m[k]))
        assert error(specimen, drive, found, k) < 2e-9


@pytest.mark.parametrize(
    ("amplitudes", "frequencies"), [((), ()), ((1e-6, 2e-6), ()), ((1e-6, 2e-6), (2.0, 1.0)), ((0.0,), ())]
)
def test_an_invalid_recorded_level_is_refused(amplitudes, frequencies):
    with pytest.raises(ValueError, match="not allowed"):
        FrequencyPath(amplitudes, frequencies)
