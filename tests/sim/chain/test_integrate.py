"""Runs of chains match scipy, and invalid or failing runs are reported."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.sim.as_written import distance
from vibench.sim import (
    Accuracy,
    Harmonic,
    HuntCrossley,
    LinearGap,
    LinearSweep,
    Outcome,
    PowerLaw,
    Sampled,
    gong2025,
    spring_of,
)
from vibench.sim.chain import Chain, chain_of, integrate_chain

pytestmark = pytest.mark.timeout(300)

HARD = Harmonic(220.0, 40e-6)


def state_of(cells, seed=1):
    """Return a state in which every cell moves without contact."""
    return np.random.default_rng(seed).uniform(-1.0, 1.0, (cells, 6)) * np.repeat([2e-5, 0.15], 3)


def reference_state(chain, drive, duration_s, state):
    """Return the final state by scipy's DOP853, restarted at every beginning and end of a contact."""
    size, first = 3 * chain.size, chain.cells[0]
    mass, stiffness, damping = chain.masses, chain.stiffness_matrix, chain.damping_matrix
    omega, springs = 2.0 * np.pi * drive.frequency_hz, [spring_of(cell) for cell in chain.cells]

    def rates(t, s):
        force = -stiffness @ s[:size] - damping @ s[size:]
        base = drive.amplitude_m * np.sin(omega * t), drive.amplitude_m * omega * np.cos(omega * t)
        force[0] += first.stiffnesses[0] * base[0] + first.dampings[0] * base[1]
        for i, spring in enumerate(springs):
            y, z = 3 * i + 1, 3 * i + 2
            contact = spring.force(s[y] - s[z], s[size + y] - s[size + z])
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
            # A tiny step past the event, so that it is not found again.
            hop = min(1e-12, duration_s - t)
            t, now = t + hop, now + hop * rates(t, now)
    return np.concatenate([now[:size].reshape(-1, 3), now[size:].reshape(-1, 3)], axis=1)


@pytest.mark.thorough
def test_coupled_cells_with_every_contact_law_match_an_independent_integrator():
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
    theirs = reference_state(chain, HARD, 0.004, state_of(5, 3))
    ours = integrate_chain(chain, HARD, 0.004, Accuracy.REFERENCE, state_of(5, 3))
    assert np.all(ours.impacts.per_cell[[0, 2, 4]] > 0)
    assert distance(ours.final_state, theirs) < 1e-7


def test_sixty_four_strongly_driven_cells_stay_finite():
    run = integrate_chain(chain_of(gong2025(), 64), Harmonic(220.0, 500e-6), 0.03, initial_state=state_of(64))
    assert run.outcome is Outcome.REACHED_END
    assert np.all(np.isfinite(run.final_state))
    assert np.all(np.diff(run.impacts.times_s) >= 0.0)
    assert np.all(run.impacts.per_cell > 0)
    assert run.impacts.per_cell.sum() == run.impacts.count


def test_a_chain_run_with_too_many_impacts_gives_a_reason_and_keeps_its_results():
    run = integrate_chain(chain_of(gong2025(), 2), HARD, 2.0, max_impact_rate_hz=10.0)
    assert run.outcome is Outcome.TOO_MANY_IMPACTS
    assert run.impacts.count == 2 * (20 + 100)
    assert 0.0 < run.end_time_s < 2.0


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"duration_s": -1.0}, r"^Duration -1\.0 s is not allowed: .*\.$"),
        ({"duration_s": np.inf}, r"^Duration inf s is not allowed: .*\.$"),
        ({"duration_s": 1.0, "start_time_s": -1.0}, r"^Start time -1\.0 s is not allowed: .*\.$"),
        ({"duration_s": 1.0, "sample_rate_hz": 0.0}, r"^Sample rate 0\.0 Hz is not allowed: .*\.$"),
        ({"duration_s": 1.0, "max_impact_rate_hz": -1.0}, r"^Impact rate -1\.0 Hz is not allowed: .*\.$"),
        ({"duration_s": 1e12}, r"^1e\+12 s of 2 cells are not allowed: .* at most 1e\+10 are allowed\. .*"),
        (
            {"duration_s": 1.0, "drive": LinearSweep(100.0, 1e12, 1.0, 1e-6)},
            r"^1 s of 2 cells are not allowed",
        ),
        *(
            ({"duration_s": 1.0, "drive": drive}, r"shorten the run or extend the drive\.$")
            for drive in (LinearSweep(80.0, 300.0, 0.1, 1e-6), Sampled(np.ones(400), 2e3))
        ),
        ({"duration_s": 1.0, "initial_state": np.zeros(6)}, r"shape \(6,\) is not allowed: .*\(2, 6\)\.$"),
        ({"duration_s": 1.0, "initial_state": np.full((2, 6), np.nan)}, r"is not allowed: give finite"),
    ],
)
def test_invalid_chain_runs_are_refused_with_a_readable_message(options, sentence):
    with pytest.raises(ValueError, match=sentence):
        integrate_chain(chain_of(gong2025(), 2), **{"drive": HARD, **options})
