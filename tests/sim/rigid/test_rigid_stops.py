"""Runs with rigid stops match closed forms of bouncing and sticking and an event-driven integrator."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from tests.sim.as_written import distance
from vibench.sim import (
    Accuracy,
    Harmonic,
    Hertz,
    HuntCrossley,
    LinearSweep,
    Outcome,
    RigidStops,
    Sampled,
    Specimen,
    gong2025,
    integrate,
    steady_response,
)

STILL = Harmonic(100.0, 0.0)
STICKING = Harmonic(200.0, 50e-6)
"""Drive under which m1 chatters and sticks 200 times a second on stops of restitution 0.8."""
BOUNCING = Harmonic(130.0, 20e-6)


def rigid(restitution, **options):
    return gong2025(**{"damping_time_s": 3e-5, "contact": f"rigid:{restitution}", **options})


def relative(states):
    return states[..., 1] - states[..., 2], states[..., 4] - states[..., 5]


class Oracle:
    """Reference solution by scipy's DOP853 with events, restarted at every impact and release."""

    CHATTER_ENDS = 2e-18
    """Lowest resolved bounce height [m]: forty rounding errors of y and z."""

    def __init__(self, specimen, drive):
        self.s, self.drive, self.rho = specimen, drive, specimen.contact.restitution
        self.times = []

    def links(self, state):
        x, y, z, vx, vy, vz = state
        _, k1, k2 = self.s.stiffnesses
        _, c1, c2 = self.s.dampings
        return k2 * (z - x) + c2 * (vz - vx), k1 * (y - z) + c1 * (vy - vz)

    def rates(self, t, state):
        (m0, m1, m2), (k0, _, _), (c0, _, _) = self.s.masses, self.s.stiffnesses, self.s.dampings
        omega, a0 = 2.0 * math.pi * self.drive.frequency_hz, self.drive.amplitude_m
        pull, inner = self.links(state)
        base = k0 * (a0 * math.sin(omega * t) - state[0]) + c0 * (a0 * omega * math.cos(omega * t) - state[3])
        if self.side:
            bound = -pull / (m1 + m2)
            return [*state[3:5], state[5], (pull + base) / m0, bound, bound]
        return [*state[3:], (pull + base) / m0, -inner / m1, (inner - pull) / m2]

    def press(self, state, side):
        (_, m1, m2), (pull, inner) = self.s.masses, self.links(state)
        return side * (pull / m2 - inner * (1.0 / m1 + 1.0 / m2))

    def run(self, duration_s, start):
        t, state, self.side = 0.0, np.array(start, dtype=float), 0.0
        step = 1e-4
        while t < duration_s:
            # The flight after a bounce is short, so its steps must be short too.
            until_s = min(t + 50.0 * step, duration_s)
            if self.side:
                events = [lambda t, s: -self.press(s, self.side)]
            else:
                events = [lambda t, s, q=q: q * (s[1] - s[2]) - self.s.gap_m for q in (1.0, -1.0)]
            for event in events:
                event.terminal, event.direction = True, 1.0
            part = solve_ivp(
                self.rates,
                (t, until_s),
                state,
                "DOP853",
                rtol=1e-12,
                atol=1e-16,
                max_step=step,
                events=events,
            )
            t, state, step = part.t[-1], part.y[:, -1].copy(), 1e-4
            if part.status == 0:
                continue
            if self.side:
                self.side = 0.0
            else:
                step = self.strike(t, state)
        return state

    def strike(self, t, state):
        side = math.copysign(1.0, state[1] - state[2])
        _, m1, m2 = self.s.masses
        before = state[4] - state[5]
        after = -self.rho * before
        self.times.append(t)
        mean = (m1 * state[4] + m2 * state[5]) / (m1 + m2)
        press = self.press(state, side)
        if press > 0.0 and after**2 < 2.0 * press * self.CHATTER_ENDS:
            after, self.side = 0.0, side
        state[4], state[5] = mean + m2 / (m1 + m2) * after, mean - m1 / (m1 + m2) * after
        state[1] = state[2] + side * self.s.gap_m
        return abs(after) / (2.0 * abs(press)) if after and press > 0.0 else 1e-4


@pytest.mark.parametrize(
    ("restitution", "drive"), [(1.0, BOUNCING), (0.8, BOUNCING), (0.5, STICKING), (0.0, STICKING)]
)
def test_rigid_stop_motion_agrees_with_an_event_driven_integrator(restitution, drive):
    specimen = rigid(restitution)
    oracle = Oracle(specimen, drive)
    theirs = oracle.run(0.02, np.zeros(6))
    ours = integrate(specimen, drive, 0.02, Accuracy.REFERENCE)
    assert ours.outcome is Outcome.REACHED_END
    assert ours.impacts.count > 5
    # The two integrators end chatter at different bounces, so only nearest impacts are compared.
    nearest = np.abs(ours.impacts.times_s[:, None] - np.asarray(oracle.times)).min(axis=1)
    assert nearest.max() < 1e-9
    assert distance(ours.final_state, theirs) < 1e-9


def falling_ball(restitution):
    """Return a light m1 in a heavy, constantly accelerated frame, in which m1 feels gravity."""
    specimen = Specimen(
        masses=(1.0, 1e-13, 1.0),
        stiffnesses=(1e5, 1e-18, 1e5),
        dampings=(0.0, 0.0, 0.0),
        gap_m=1e-3,
        contact=RigidStops(restitution),
    )
    gravity, rate = 10.0, 2e4
    time_s = np.arange(8001) / rate
    base = Sampled(0.5 * gravity * time_s**2, rate)
    sag = np.array([2.0 / 1e5, 3.0 / 1e5, 3.0 / 1e5]) * gravity
    return specimen, base, gravity, np.concatenate([-sag, np.zeros(3)])


@pytest.mark.parametrize("restitution", [0.0, 0.3, 0.8, 0.95, 1.0])
def test_a_bouncing_ball_impacts_at_the_closed_form_times_and_comes_to_rest(restitution):
    specimen, base, gravity, start = falling_ball(restitution)
    run = integrate(specimen, base, 0.38, Accuracy.REFERENCE, start, sample_rate_hz=1e3)
    times = run.impacts.times_s
    falls = math.sqrt(2.0 * specimen.gap_m / gravity)
    hops = 2.0 * falls * restitution ** np.arange(1, len(times))
    assert run.outcome is Outcome.REACHED_END
    expected = falls + np.concatenate([[0.0], np.cumsum(hops)])
    # The tolerance covers a residual gap of 1e-12 and the rounding of the frame position.
    speeds = gravity * falls * restitution ** np.arange(len(times))
    assert np.all(np.abs(times - expected) < 1e-9 + 4e-15 / speeds)
    p, rate = relative(run.states)
    if restitution == 1.0:
        assert len(times) == 1 + math.floor((0.38 - falls) / (2.0 * falls))
        return
    rests = falls * (1.0 + 2.0 * restitution / (1.0 - restitution))
    held = run.time_s > rests
    assert np.all(p[held] == pytest.approx(-specimen.gap_m, abs=1e-16))
    assert np.all(rate[held] == 0.0)
    if rests < 0.38:
        assert held.sum() > 1
        # The infinite series of bounces is cut off at 1e-5 of the first speed.
        assert times[-1] > rests - 1e-5 * falls / (1.0 - restitution)


def held_stretch(run, gap_m):
    """Return first and last index of the longest interval in which m1 stays on a stop."""
    p, rate = relative(run.states)
    held = (np.abs(np.abs(p) - gap_m) < 1e-15) & (rate == 0.0)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], held.astype(int), [0]])))
    starts, ends = edges[::2], edges[1::2] - 1
    longest = np.argmax(ends - starts)
    return starts[longest], ends[longest]


def bound_motion(specimen, drive, state, begin_s, end_s):
    """Return x, z, vx, vz of m0 and the joined m1 and m2, by an augmented matrix exponential."""
    (m0, m1, m2), (k0, _, k2), (c0, _, c2) = specimen.masses, specimen.stiffnesses, specimen.dampings
    omega, pair = 2.0 * math.pi * drive.frequency_hz, m1 + m2
    system = np.zeros((6, 6))
    system[0, 2] = system[1, 3] = 1.0
    system[2] = [-(k0 + k2) / m0, k2 / m0, -(c0 + c2) / m0, c2 / m0, k0 / m0, c0 / m0]
    system[3, :4] = [k2 / pair, -k2 / pair, c2 / pair, -c2 / pair]
    system[4, 5], system[5, 4] = 1.0, -(omega**2)
    base = drive.amplitude_m * np.array([math.sin(omega * begin_s), omega * math.cos(omega * begin_s)])
    return (expm(system * (end_s - begin_s)) @ np.concatenate([state[[0, 2, 3, 5]], base]))[:4]


def test_m1_and_m2_move_as_one_body_while_they_stick():
    specimen = rigid(0.0)
    run = integrate(specimen, STICKING, 0.1, sample_rate_hz=1e5)
    first, last = held_stretch(run, specimen.gap_m)
    assert run.time_s[last] - run.time_s[first] > 1e-3
    expected = bound_motion(specimen, STICKING, run.states[first], run.time_s[first], run.time_s[last])
    np.testing.assert_allclose(run.states[last][[0, 2, 3, 5]], expected, rtol=1e-9)


def test_m1_is_released_from_a_rigid_stop_when_the_contact_force_vanishes():
    specimen = rigid(0.0)
    run = integrate(specimen, STICKING, 0.1, sample_rate_hz=1e6)
    first, last = held_stretch(run, specimen.gap_m)
    (_, m1, m2), (_, k1, k2), (_, _, c2) = specimen.masses, specimen.stiffnesses, specimen.dampings
    x, y, z, vx, _, vz = run.states[first : last + 1].T
    side = np.sign(y - z)[0]
    reaction = side * m1 / (m1 + m2) * (k2 * (z - x) + c2 * (vz - vx)) - k1 * specimen.gap_m
    assert np.all(reaction > 0.0)
    assert reaction[-1] < 1e-2 * reaction.max()
    p, rate = relative(run.states[last + 1 : last + 20])
    assert np.all(np.diff(side * rate) < 0.0)
    assert np.all(side * p < specimen.gap_m)


def bound_response(specimen, frequency_hz):
    """Return abs(x / U) with m1 and m2 as one body."""
    (m0, m1, m2), (k0, _, k2), (c0, _, c2) = specimen.masses, specimen.stiffnesses, specimen.dampings
    s = 2j * math.pi * frequency_hz
    link = k2 + c2 * s
    carried = link * s**2 * (m1 + m2) / (link + s**2 * (m1 + m2))
    return abs((k0 + c0 * s) / (k0 + c0 * s + s**2 * m0 + carried))


@pytest.mark.parametrize("restitution", [0.0, 0.5])
@pytest.mark.parametrize("mode", [0, 1])
def test_resonances_with_a_vanishing_gap_match_the_joined_masses(restitution, mode):
    specimen = rigid(restitution, gap_m=1e-10)
    resonance = float(specimen.bound_frequencies_hz[mode])
    for frequency_hz in (0.99 * resonance, resonance):
        response = steady_response(specimen, Harmonic(frequency_hz, 1e-6), duration_s=1.5, window_s=0.1)
        assert response.outcome is Outcome.REACHED_END
        assert response.response_ii == pytest.approx(bound_response(specimen, frequency_hz), rel=2e-3)


def test_stiff_contacts_converge_to_rigid_stops_in_proportion_to_the_contact_time():
    rigid_end = integrate(rigid(1.0), BOUNCING, 0.01, Accuracy.REFERENCE)
    errors = []
    for stiffness in (1e13, 1e15, 1e17):
        specimen = replace(rigid(1.0), contact=Hertz(stiffness))
        run = integrate(specimen, BOUNCING, 0.01, Accuracy.REFERENCE)
        assert run.impacts.count == rigid_end.impacts.count == 3
        errors.append(distance(run.final_state, rigid_end.final_state))
    # The duration of a Hertz contact is proportional to stiffness^(-2/5).
    rates = -np.diff(np.log10(errors)) / 2.0
    assert errors[-1] < 1e-4
    np.testing.assert_allclose(rates, 0.4, atol=0.03)


@pytest.mark.parametrize("loss", [0.02, 1.0])
def test_a_stiff_lossy_contact_matches_a_rigid_stop_with_the_same_restitution(loss):
    speed, faint = 0.3, (1e-2, 2e-2, 3e-2)
    specimen = Specimen((1.0, 2.1e-3, 2.0e-3), faint, (0.0, 0.0, 0.0), 45e-6, HuntCrossley(1e17, loss))
    # r - ln(1 + loss r) / loss changes equally during approach and rebound (solved by Newton).
    held = loss * speed - math.log1p(loss * speed)
    after = speed
    for _ in range(60):
        after -= (-loss * after - math.log1p(-loss * after) - held) * (1.0 - loss * after) / (loss**2 * after)
    hard = replace(specimen, contact=RigidStops(after / speed))
    start = [0.0, 40e-6, 0.0, 0.0, speed, 0.0]
    soft_run, hard_run = (integrate(one, STILL, 1e-4, Accuracy.REFERENCE, start) for one in (specimen, hard))
    assert soft_run.impacts.count == hard_run.impacts.count == 1
    np.testing.assert_allclose(soft_run.final_state[4:], hard_run.final_state[4:], atol=1e-6 * speed)
    # The tolerance covers the 1 us duration of the soft contact.
    assert np.abs(soft_run.final_state[:3] - hard_run.final_state[:3]).max() < 1e-6 * speed


def test_the_accuracy_level_has_no_effect_without_chatter():
    finals = [integrate(rigid(0.8), BOUNCING, 2.0, level).final_state for level in Accuracy]
    np.testing.assert_array_equal(finals[0], finals[2])
    np.testing.assert_array_equal(finals[1], finals[2])


@pytest.mark.parametrize("restitution", [0.0, 0.6])
def test_each_accuracy_level_meets_its_tolerance_with_chatter(restitution):
    finals = {level: integrate(rigid(restitution), STICKING, 0.03, level).final_state for level in Accuracy}
    for level in (Accuracy.QUICK, Accuracy.STANDARD):
        assert distance(finals[level], finals[Accuracy.REFERENCE]) < level.tolerance


@pytest.mark.parametrize(("restitution", "drive"), [(0.8, BOUNCING), (0.5, STICKING), (0.0, STICKING)])
def test_with_rigid_stops_a_sampled_sine_gives_the_same_motion_as_the_sine(restitution, drive):
    specimen, rate = rigid(restitution), 40_000.0
    sine = drive.amplitude_m * np.sin(2.0 * np.pi * drive.frequency_hz * np.arange(1300) / rate)
    sampled = integrate(specimen, Sampled(sine, rate), 0.03, Accuracy.REFERENCE, sample_rate_hz=1e4)
    harmonic = integrate(specimen, drive, 0.03, Accuracy.REFERENCE, sample_rate_hz=1e4)
    assert abs(sampled.impacts.count - harmonic.impacts.count) <= 3
    assert max(map(distance, sampled.states, harmonic.states)) < 1e-4
    assert distance(sampled.final_state, harmonic.final_state) < 1e-6


@settings(max_examples=15, deadline=None)
@given(first_s=st.floats(0.0, 0.03), restitution=st.sampled_from([0.0, 0.6, 0.8]))
@example(first_s=0.020404096147730984, restitution=0.6).via(
    "a release whose speed is rounding of either sign"
)
def test_a_run_split_during_sticking_equals_the_whole_run(first_s, restitution):
    specimen = rigid(restitution)
    for drive in (STICKING, LinearSweep(180.0, 220.0, 0.03, 50e-6)):
        whole = integrate(specimen, drive, 0.03, Accuracy.REFERENCE)
        first = integrate(specimen, drive, first_s, Accuracy.REFERENCE)
        second = integrate(
            specimen, drive, 0.03 - first_s, Accuracy.REFERENCE, first.final_state, start_time_s=first_s
        )
        assert distance(second.final_state, whole.final_state) < 1e-5


@pytest.mark.parametrize("p", [45.1e-6, -46e-6])
def test_an_initial_state_inside_a_rigid_stop_is_refused(p):
    with pytest.raises(ValueError, match=r"A start at y - z = .* is not allowed: rigid stops are at"):
        integrate(rigid(0.5), STILL, 0.1, initial_state=[0.0, p, 0.0, 0.0, 0.0, 0.0])


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.95, 1.0])
@pytest.mark.parametrize("gap_m", [1e-12, 1e-8, 45e-6])
def test_m1_never_gets_beyond_a_rigid_stop(restitution, gap_m):
    specimen = rigid(restitution, gap_m=gap_m)
    for frequency_hz, amplitude_m in ((50.0, 50e-6), (200.0, 1e-3), (400.0, 1e-2)):
        drive = Harmonic(frequency_hz, amplitude_m)
        run = integrate(specimen, drive, 0.02, sample_rate_hz=1e6, max_impact_rate_hz=1e6)
        p, _ = relative(run.states)
        rounding = 1e-15 * np.abs(run.states[:, :3]).max()
        assert np.abs(p).max() <= gap_m * (1.0 + 1e-9) + rounding
