"""Chains driven by sweeps and samples, the energy of their cells, and unit cells of several cells."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.sim.as_written import distance
from vibench.sim import (
    Accuracy,
    LinearSweep,
    LogarithmicSweep,
    Outcome,
    Sampled,
    gong2025,
    integrate,
)
from vibench.sim.chain import (
    Chain,
    band_frequencies_hz,
    band_gaps,
    bloch_factor,
    chain_energies,
    chain_of,
    integrate_chain,
)

pytestmark = pytest.mark.timeout(300)


def noise(seed, count, rate_hz, rms_m):
    """Return noise band-limited to 40 to 600 Hz."""
    spectrum = np.fft.rfft(np.random.default_rng(seed).normal(size=count))
    frequency = np.fft.rfftfreq(count, 1.0 / rate_hz)
    spectrum[(frequency < 40.0) | (frequency > 600.0)] = 0.0
    samples = np.fft.irfft(spectrum, count)
    return Sampled(rms_m * samples / samples.std(), rate_hz)


@pytest.mark.parametrize(
    "drive",
    [
        LinearSweep(80.0, 300.0, 0.2, 5e-6),
        LogarithmicSweep(400.0, 60.0, 0.2, 5e-6),
        noise(1, 4001, 20e3, 4e-6),
        noise(2, 401, 2e3, 4e-6),
    ],
)
def test_a_cell_of_negligible_mass_does_not_disturb_its_neighbour(drive):
    """The heavy cell moves like the single specimen, which is integrated by other code."""
    heavy, lightness = gong2025(), 1e-12
    light = replace(
        heavy,
        masses=tuple(lightness * m for m in heavy.masses),
        stiffnesses=tuple(lightness * k for k in heavy.stiffnesses),
        dampings=tuple(lightness * c for c in heavy.dampings),
        contact=replace(heavy.contact, stiffness=lightness * heavy.contact.stiffness),
    )
    ours = integrate_chain(Chain((heavy, light)), drive, 0.1, Accuracy.REFERENCE, sample_rate_hz=5e3)
    theirs = integrate(heavy, drive, 0.1, Accuracy.REFERENCE, sample_rate_hz=5e3)
    assert ours.outcome is Outcome.REACHED_END
    struck = theirs.impacts.times_s
    # Every impact multiplies a difference by about four, so only the first impacts are compared.
    near = theirs.time_s < (struck[8] if len(struck) > 8 else 0.1)
    assert near.sum() > 100
    assert distance(ours.states[near, 0], theirs.states[near]) < 1e-5


@pytest.mark.parametrize("drive", [LinearSweep(80.0, 300.0, 0.1, 20e-6), noise(3, 2001, 20e3, 20e-6)])
def test_a_chain_run_that_is_split_or_sampled_equals_the_whole_run(drive):
    chain = chain_of(gong2025(), 2)
    whole = integrate_chain(chain, drive, 0.06, Accuracy.REFERENCE)
    sampled = integrate_chain(chain, drive, 0.06, Accuracy.REFERENCE, sample_rate_hz=7e3)
    assert whole.impacts.count > 10
    np.testing.assert_array_equal(sampled.final_state, whole.final_state)
    cut_s = float(whole.impacts.times_s[-3]) - 1e-4
    first = integrate_chain(chain, drive, cut_s, Accuracy.REFERENCE)
    rest = integrate_chain(
        chain, drive, 0.06 - cut_s, Accuracy.REFERENCE, first.final_state, start_time_s=cut_s
    )
    assert distance(rest.final_state, whole.final_state) < 1e-4


def test_base_motion_stores_energy_only_in_the_first_cell():
    chain = chain_of(gong2025(), 2)
    moved = chain_energies(chain, np.zeros((4, 2, 6)), np.full(4, 1e-5))
    np.testing.assert_allclose(moved[:, 0], 0.5 * chain.cells[0].stiffnesses[0] * 1e-10)
    np.testing.assert_array_equal(moved[:, 1], 0.0)


UNEQUAL = Chain((gong2025(damping_time_s=0.0), gong2025(damping_time_s=0.0)))


def test_a_unit_cell_of_two_equal_cells_has_the_folded_bands_of_one_cell():
    one, two = chain_of(UNEQUAL.cells[0], 1), UNEQUAL
    np.testing.assert_allclose(np.array(band_gaps(two))[:-1], np.array(band_gaps(one))[:-1], rtol=1e-9)
    half = band_frequencies_hz(one, [0.35, np.pi - 0.35])
    np.testing.assert_allclose(band_frequencies_hz(two, [0.7])[0], np.sort(half.ravel()), rtol=1e-9)
    np.testing.assert_allclose(
        bloch_factor(two, [150.0, 400.0]), bloch_factor(one, [150.0, 400.0]) ** 2, rtol=1e-9
    )


@given(seed=st.integers(0, 10_000), cells=st.integers(1, 4))
@settings(max_examples=25, deadline=None)
def test_waves_in_chains_of_unequal_cells_propagate_in_bands_and_decay_in_gaps(seed, cells):
    random = np.random.default_rng(seed)
    unit = Chain(
        tuple(
            replace(
                gong2025(damping_time_s=0.0),
                masses=tuple(random.uniform(1e-3, 9e-3, 3)),
                stiffnesses=tuple(random.uniform(1e3, 3e4, 3)),
            )
            for _ in range(cells)
        )
    )
    phase = random.uniform(0.3, 2.8)
    for frequency_hz in band_frequencies_hz(unit, [phase])[0]:
        factor = bloch_factor(unit, [frequency_hz])[0]
        assert abs(factor) == pytest.approx(1.0, abs=1e-5)
        assert abs(np.angle(factor)) == pytest.approx(phase, abs=1e-5)
    natural = Chain(unit.cells * 12).natural_frequencies_hz
    for gap in band_gaps(unit):
        middle = 0.5 * (gap.lower_hz + min(gap.upper_hz, 2.0 * gap.lower_hz))
        assert abs(bloch_factor(unit, [middle])[0]) < 1.0
        # Each free end of a chain of asymmetric unit cells may have one mode in a band gap.
        inside = (natural > gap.lower_hz * (1 + 1e-9)) & (natural < gap.upper_hz * (1 - 1e-9))
        assert np.count_nonzero(inside) <= 2
