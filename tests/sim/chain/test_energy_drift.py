"""Energy conservation of undamped chains."""

import numpy as np
import pytest

from vibench.sim import Harmonic, Outcome, Sampled, gong2025, integrate
from vibench.sim.chain import chain_energies, chain_of, integrate_chain

pytestmark = pytest.mark.timeout(300)
STILL = Harmonic(100.0, 0.0)
SEEDS = range(8)


def drifts(contact, cells, duration_s):
    """Return the relative energy errors of undamped chains."""
    chain = chain_of(gong2025(damping_time_s=0.0, contact=contact), cells)
    found = []
    for seed in SEEDS:
        start = np.random.default_rng(seed).normal(size=(cells, 6)) * np.repeat([3e-5, 0.15], 3)
        run = integrate_chain(chain, STILL, duration_s, "standard", start)
        found.append(chain_energies(chain, run.final_state).sum() / chain_energies(chain, start).sum() - 1.0)
    return np.array(found)


@pytest.mark.thorough
@pytest.mark.parametrize("cells", [2, 4])
def test_undamped_chains_with_hertz_contacts_have_small_energy_errors_without_bias(cells):
    found = drifts("hertz", cells, 0.5)
    assert np.abs(found).max() < 2e-5
    assert found.min() < 0.0 < found.max()


@pytest.mark.parametrize("accuracy", ["quick", "standard", "reference"])
@pytest.mark.parametrize("cells", [1, 2])
@pytest.mark.parametrize(
    "contact",
    [
        "hertz",
        "hunt_crossley:0",
        "linear_gap:2e5",
        "power:3",
        "power:5",
        "power:29",
        "power:47",
        "power:3+5+7",
    ],
)
def test_energy_is_conserved_for_every_contact_law_and_drive_and_accuracy_level(contact, cells, accuracy):
    """Energy errors were once 2e-2 with a sampled drive and 2e-3 with a power law."""
    specimen = gong2025(damping_time_s=0.0, contact=contact)
    chain = chain_of(specimen, cells)
    moving = np.random.default_rng(1).normal(size=(cells, 6)) * np.repeat([3e-5, 0.15], 3)
    deep = np.zeros((cells, 6))
    deep[0, 1] = (1.2 if contact == "power:47" else 1.4) * specimen.gap_m
    for start in (moving, deep):
        before = chain_energies(chain, start).sum()
        for drive in (STILL, Sampled(np.zeros(408), 1e4)):
            run = integrate_chain(chain, drive, 0.04, accuracy, start)
            assert run.outcome is Outcome.REACHED_END
            assert chain_energies(chain, run.final_state).sum() == pytest.approx(before, rel=1e-5)


@pytest.mark.thorough
def test_a_motion_deep_inside_a_steep_contact_is_integrated_at_reference_accuracy():
    """At reference accuracy, the step control once asked for less than rounding, and the run stalled."""
    specimen = gong2025(damping_time_s=0.0, contact="power:47")
    chain = chain_of(specimen, 1)
    start = np.array([0.0, 1.5 * specimen.gap_m, 0.0, 0.0, 0.0, 0.0])
    run = integrate(specimen, STILL, 0.02, "reference", start)
    assert run.outcome is Outcome.REACHED_END
    after, before = (chain_energies(chain, each[None]).sum() for each in (run.final_state, start))
    assert after == pytest.approx(before, rel=1e-6)


@pytest.mark.parametrize("contact", ["power:5", "power:29", "hertz", "linear_gap:2e5"])
@pytest.mark.parametrize(
    ("gaps", "duration_s"), [(3.0, 2e-3), (1e3, 2e-3), pytest.param(1e6, 2e-4, marks=pytest.mark.thorough)]
)
def test_a_failed_chain_run_ends_at_its_last_valid_state(contact, gaps, duration_s):
    """A run deep in contact once continued from an unfinished window, with 1e172 times the energy."""
    specimen = gong2025(damping_time_s=0.0, contact=contact)
    start = np.zeros((2, 6))
    start[0, 1] = gaps * specimen.gap_m
    chain = chain_of(specimen, 2)
    for drive in (STILL, Sampled(np.zeros(64), 1e4)):
        run = integrate_chain(chain, drive, duration_s, "standard", start)
        ratio = chain_energies(chain, run.final_state).sum() / chain_energies(chain, start).sum()
        assert run.outcome is not Outcome.REACHED_END or ratio == pytest.approx(1.0, abs=0.01)
        assert ratio < 1.01
