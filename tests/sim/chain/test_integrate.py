"""Whole runs of chains: against scipy, against the engine of one cell, and against the laws of mechanics."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import simpson, solve_ivp

from vibench.sim import (
    Accuracy,
    Harmonic,
    Hertz,
    HuntCrossley,
    LinearGap,
    LinearSweep,
    Outcome,
    PowerLaw,
    Sampled,
    gong2025,
    integrate,
)
from vibench.sim.chain import Chain, chain_of, chain_transmissibility, integrate_chain
from vibench.sim.chain._integrate import ChainRun
from vibench.sim.chain._tables import chain_tables

pytestmark = pytest.mark.timeout(300)

HARD = Harmonic(220.0, 40e-6)
STILL = Harmonic(100.0, 0.0)
UNITS = np.repeat([1e-4, 0.1], 3)
"""Errors are in units of 100 um and 0.1 m/s."""


def lively(cells, seed=1):
    """A state in which every cell moves, none in contact."""
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (cells, 6)) * np.repeat([2e-5, 0.15], 3)


def distance(first, second):
    return np.max(np.abs(first - second) / UNITS)


def law_force(cell, p, rate):
    deep, side = max(abs(p) - cell.gap_m, 0.0), np.sign(p)
    match cell.contact:
        case Hertz(stiffness=k):
            return side * k * deep**1.5
        case LinearGap(stiffness=k):
            return side * k * deep
        case HuntCrossley(stiffness=k, loss=loss):
            return side * k * deep**1.5 * (1.0 + loss * side * rate)
        case PowerLaw(reference=reference, terms=terms):
            return sum(force * (p / reference) ** n for n, force in terms)


def independent(chain, drive, duration_s, state):
    """The equations as written, by scipy's DOP853 restarted wherever a stop is touched or left."""
    size, first = 3 * chain.size, chain.cells[0]
    mass, stiffness, damping = chain.masses, chain.stiffness_matrix, chain.damping_matrix
    omega = 2.0 * np.pi * drive.frequency_hz

    def rates(t, s):
        force = -stiffness @ s[:size] - damping @ s[size:]
        base = drive.amplitude_m * np.sin(omega * t), drive.amplitude_m * omega * np.cos(omega * t)
        force[0] += first.stiffnesses[0] * base[0] + first.dampings[0] * base[1]
        for i, cell in enumerate(chain.cells):
            y, z = 3 * i + 1, 3 * i + 2
            contact = law_force(cell, s[y] - s[z], s[size + y] - s[size + z])
            force[y] -= contact
            force[z] += contact
        return np.concatenate([s[size:], force / mass])

    def crossing(i):
        def event(_, s):
            return abs(s[3 * i + 1] - s[3 * i + 2]) - chain.cells[i].gap_m

        event.terminal = True
        return event

    events = [crossing(i) for i, cell in enumerate(chain.cells) if not isinstance(cell.contact, PowerLaw)]
    now, t = np.concatenate([state[:, :3].ravel(), state[:, 3:].ravel()]), 0.0
    options = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-16, "max_step": 2e-5}
    while t < duration_s:
        run = solve_ivp(rates, (t, duration_s), now, events=events, **options)
        t, now = run.t[-1], run.y[:, -1]
        if run.status == 1:
            # Past the event by a step too short to matter, so that it is not found again.
            hop = min(1e-12, duration_s - t)
            t, now = t + hop, now + hop * rates(t, now)
    return np.concatenate([now[:size].reshape(-1, 3), now[size:].reshape(-1, 3)], axis=1)


def energy(chain, states):
    """Kinetic, elastic and contact energy of Hertz cells [J], the base at rest; shape (n,)."""
    q = states[:, :, :3].reshape(len(states), -1)
    v = states[:, :, 3:].reshape(len(states), -1)
    linear = 0.5 * (np.sum(chain.masses * v**2, axis=1) + np.sum((q @ chain.stiffness_matrix) * q, axis=1))
    p = states[:, :, 1] - states[:, :, 2]
    contact = [
        0.4 * cell.contact.stiffness * np.maximum(np.abs(p[:, i]) - cell.gap_m, 0.0) ** 2.5
        for i, cell in enumerate(chain.cells)
    ]
    return linear + np.sum(contact, axis=0)


@pytest.mark.parametrize("law", ["hertz", "hunt_crossley:0.5", "linear_gap:2e5", "linear", "power:3+5+7"])
def test_one_cell_by_windows_is_the_specimen_that_the_scalar_engine_follows(law):
    specimen = gong2025(contact=law)
    chain, start = chain_of(specimen, 1), 0.8 * lively(1, 8)
    for level, bound in ((Accuracy.STANDARD, 1e-5), (Accuracy.REFERENCE, 2e-8)):
        ours = ChainRun(chain, HARD, chain_tables(chain, HARD, level), level, most_impacts=100)
        ours.place(start, 0.0)
        assert ours.advance(0.008) is Outcome.REACHED_END
        theirs = integrate(specimen, HARD, 0.008, Accuracy.REFERENCE, start[0])
        assert ours.impacts == theirs.impacts.count
        assert distance(ours.motion[0], theirs.final_state) < bound


def test_cells_of_every_law_move_together_as_an_independent_integrator_states():
    paper = gong2025()
    chain = Chain(
        (
            replace(paper, contact=LinearGap(2e6), masses=(4e-3, 2e-3, 1e-3)),
            gong2025(contact="power:3+5+7"),
            replace(
                paper, contact=HuntCrossley(paper.contact.stiffness, 0.3), gap_m=30e-6, dampings=(0.3, 0, 0.1)
            ),
            gong2025(contact="power:29"),
            paper,
        )
    )
    theirs = independent(chain, HARD, 0.004, lively(5, 3))
    ours = integrate_chain(chain, HARD, 0.004, Accuracy.REFERENCE, lively(5, 3))
    assert np.all(ours.impacts.per_cell[[0, 2, 4]] > 0)
    assert distance(ours.final_state, theirs) < 1e-7


def test_two_cells_swinging_against_each_other_press_at_the_same_instants_and_as_one_on_a_doubled_spring():
    """Without the base's spring the pair is its own mirror image: the middle of the link stands still."""
    cell = gong2025(damping_time_s=0.0)
    freed = replace(cell, stiffnesses=(1e-6, *cell.stiffnesses[1:]))
    chain = Chain((freed, cell))
    half = replace(cell, stiffnesses=(2.0 * cell.stiffnesses[0], *cell.stiffnesses[1:]))
    state = lively(1, 5)[0]
    pair = integrate_chain(chain, STILL, 0.02, Accuracy.REFERENCE, np.stack([state, -state]))
    alone = integrate(half, STILL, 0.02, Accuracy.REFERENCE, state)
    assert alone.impacts.count > 15
    np.testing.assert_array_equal(pair.impacts.per_cell, alone.impacts.count)
    first, second = (pair.impacts.times_s[pair.impacts.cells == i] for i in (0, 1))
    np.testing.assert_allclose(first, second, atol=1e-9)
    # Sixteen impacts make four thousand of a difference.
    assert distance(pair.final_state[0], -pair.final_state[1]) < 1e-6
    assert distance(pair.final_state[0], alone.final_state) < 1e-6


def test_without_damping_and_drive_the_energy_of_a_chain_stays_through_a_thousand_impacts():
    chain = chain_of(gong2025(damping_time_s=0.0), 4)
    run = integrate_chain(chain, STILL, 0.5, Accuracy.REFERENCE, 1.5 * lively(4), sample_rate_hz=2e3)
    assert run.impacts.count > 1000
    held = energy(chain, run.states)
    np.testing.assert_allclose(held, held[0], rtol=2e-10 * run.impacts.count)


def test_what_the_drive_puts_in_and_the_dampers_take_is_what_the_energy_changes_by():
    chain = chain_of(gong2025(), 3)
    run = integrate_chain(chain, HARD, 0.02, Accuracy.REFERENCE, lively(3), sample_rate_hz=1e6)
    assert np.all(run.impacts.per_cell > 2)
    omega, first = 2.0 * np.pi * HARD.frequency_hz, chain.cells[0]
    base = HARD.amplitude_m * np.sin(omega * run.time_s)
    base_rate = HARD.amplitude_m * omega * np.cos(omega * run.time_s)
    v = run.states[:, :, 3:].reshape(len(run.time_s), -1)
    # The chain's own matrices hold the first link to a base at rest: only U and dU/dt are extra.
    push = first.stiffnesses[0] * base + first.dampings[0] * base_rate
    work = simpson(push * v[:, 0], x=run.time_s)
    taken = simpson(np.sum((v @ chain.damping_matrix) * v, axis=1), x=run.time_s)
    held = energy(chain, run.states[[0, -1]])
    assert taken > 0.1 * held[0]
    assert held[1] - held[0] == pytest.approx(work - taken, abs=1e-7 * taken)


def test_a_mirrored_start_and_drive_give_the_mirrored_motion_to_the_last_bits():
    chain, mirrored = chain_of(gong2025(), 3), Harmonic(HARD.frequency_hz, HARD.amplitude_m, np.pi)
    run = integrate_chain(chain, HARD, 0.01, Accuracy.STANDARD, lively(3))
    image = integrate_chain(chain, mirrored, 0.01, Accuracy.STANDARD, -lively(3))
    assert run.impacts.count > 5
    assert distance(run.final_state, -image.final_state) < 1e-8


def test_a_light_cell_leaves_the_heavy_one_alone_and_is_shaken_by_it_as_by_a_base():
    heavy, lightness = gong2025(), 1e-12
    light = replace(
        heavy,
        masses=tuple(lightness * m for m in heavy.masses),
        stiffnesses=tuple(lightness * k for k in heavy.stiffnesses),
        dampings=tuple(lightness * c for c in heavy.dampings),
        contact=Hertz(lightness * heavy.contact.stiffness),
    )
    duration_s, rate_hz = 0.01, 2e6
    run = integrate_chain(
        Chain((heavy, light)), HARD, duration_s, Accuracy.REFERENCE, lively(2), sample_rate_hz=rate_hz
    )
    alone = integrate(heavy, HARD, duration_s, Accuracy.REFERENCE, lively(2)[0])
    shaken = integrate(
        heavy, Sampled(run.states[:, 0, 0], rate_hz), duration_s, Accuracy.REFERENCE, lively(2)[1]
    )
    assert np.all(run.impacts.per_cell == [alone.impacts.count, shaken.impacts.count])
    assert np.all(run.impacts.per_cell > 2)
    assert distance(run.final_state[0], alone.final_state) < 1e-5
    assert distance(run.final_state[1], shaken.final_state) < 1e-4


def test_without_contact_a_long_run_ends_on_the_exact_transmissibility():
    chain, drive = chain_of(gong2025(contact="linear"), 5), Harmonic(260.0, 50e-6)
    run = integrate_chain(chain, drive, 100.0 + 0.3 / drive.frequency_hz)
    moved = chain_transmissibility(chain, drive.frequency_hz)[0, :, :3]
    expected = (moved * drive.amplitude_m * np.exp(2j * np.pi * 0.3)).imag
    np.testing.assert_allclose(run.final_state[:, :3], expected, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("drive", [HARD, Harmonic(220.0, 1e-9)])
def test_sampling_does_not_change_the_motion_by_one_bit(drive):
    chain, start = chain_of(gong2025(), 3), lively(3) if drive is HARD else np.zeros((3, 6))
    plain = integrate_chain(chain, drive, 0.1, initial_state=start)
    for rate in (777.0, 48_000.0):
        sampled = integrate_chain(chain, drive, 0.1, initial_state=start, sample_rate_hz=rate)
        np.testing.assert_array_equal(sampled.final_state, plain.final_state)
        np.testing.assert_array_equal(sampled.impacts.times_s, plain.impacts.times_s)
        assert len(sampled.time_s) == int(0.1 * rate) + 1


def test_samples_lie_on_the_motion_in_flight_and_in_contact():
    chain = chain_of(gong2025(), 2)
    run = integrate_chain(chain, HARD, 0.02, Accuracy.REFERENCE, lively(2), sample_rate_hz=50e3)
    p = run.states[:, :, 1] - run.states[:, :, 2]
    pressed = np.argwhere(np.abs(p) > 45e-6)
    assert len(pressed) > 20
    for index in (*pressed[:: len(pressed) // 4, 0], 123, 777):
        shorter = integrate_chain(chain, HARD, float(run.time_s[index]), Accuracy.REFERENCE, lively(2))
        assert distance(run.states[index], shorter.final_state) < 1e-6


def test_a_run_cut_within_a_contact_continues_as_if_it_had_not_been_cut():
    chain = chain_of(gong2025(), 2)
    whole = integrate_chain(chain, HARD, 0.01, Accuracy.REFERENCE, lively(2))
    cut_s = float(whole.impacts.times_s[3]) + 8e-6
    first = integrate_chain(chain, HARD, cut_s, Accuracy.REFERENCE, lively(2))
    p = first.final_state[:, 1] - first.final_state[:, 2]
    assert np.any(np.abs(p) > 45e-6)
    rest = integrate_chain(
        chain, HARD, 0.01 - cut_s, Accuracy.REFERENCE, first.final_state, start_time_s=cut_s
    )
    assert first.impacts.count + rest.impacts.count == whole.impacts.count
    assert distance(rest.final_state, whole.final_state) < 1e-6


def test_sixty_four_cells_driven_hard_stay_finite_and_strike_in_order():
    run = integrate_chain(chain_of(gong2025(), 64), Harmonic(220.0, 500e-6), 0.03, initial_state=lively(64))
    assert run.outcome is Outcome.REACHED_END
    assert np.all(np.isfinite(run.final_state))
    assert np.all(np.diff(run.impacts.times_s) >= 0.0)
    assert np.all(run.impacts.per_cell > 0)
    assert run.impacts.per_cell.sum() == run.impacts.count


def test_a_run_with_more_impacts_than_allowed_reports_it_and_keeps_what_it_has():
    run = integrate_chain(chain_of(gong2025(), 2), HARD, 2.0, max_impact_rate_hz=10.0)
    assert run.outcome is Outcome.TOO_MANY_IMPACTS
    assert run.impacts.count == 2 * (20 + 100)
    assert 0.0 < run.end_time_s < 2.0


def test_a_motion_too_large_for_any_statement_ends_as_not_finite():
    fast = [[0.0, 0.0, 0.0, 1e160, -1e160, 1e160]] * 2
    run = integrate_chain(chain_of(gong2025(), 2), Harmonic(220.0, 1e-6), 0.1, initial_state=fast)
    assert run.outcome is Outcome.NOT_FINITE


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"duration_s": -1.0}, r"^Duration -1\.0 s is not allowed: .*\.$"),
        ({"duration_s": np.inf}, r"^Duration inf s is not allowed: .*\.$"),
        ({"duration_s": 1.0, "start_time_s": -1.0}, r"^Start time -1\.0 s is not allowed: .*\.$"),
        ({"duration_s": 1.0, "sample_rate_hz": 0.0}, r"^Sample rate 0\.0 Hz is not allowed: .*\.$"),
        ({"duration_s": 1.0, "max_impact_rate_hz": -1.0}, r"^Impact rate -1\.0 Hz is not allowed: .*\.$"),
        ({"duration_s": 1e12}, r"^1e\+12 s of 2 cells are not allowed: .* 1e\+10 are the most; .*\.$"),
        (
            {"duration_s": 1.0, "drive": LinearSweep(100.0, 1e12, 1.0, 1e-6)},
            r"^1 s of 2 cells are not allowed",
        ),
        ({"duration_s": 1.0, "initial_state": np.zeros(6)}, r"shape \(6,\) is not allowed: .*\(2, 6\)\.$"),
        ({"duration_s": 1.0, "initial_state": np.full((2, 6), np.nan)}, r"is not allowed: give finite"),
    ],
)
def test_anything_that_is_not_allowed_is_refused_in_one_sentence(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        integrate_chain(chain_of(gong2025(), 2), **{"drive": HARD, **options})
