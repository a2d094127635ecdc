"""Jumps of a swept response: at known positions, and of a hardening specimen."""

from functools import partial

import numpy as np
import pytest

from tests.analysis.sine.sweep_in_memory import sweep_response
from vibench.analysis import InvalidRequest
from vibench.analysis.sine.sweep_analysis import collisions, hysteresis, jumps, smooth_jumps
from vibench.sim import (
    BalanceOptions,
    BifurcationKind,
    FrequencyPath,
    LinearSweep,
    base_transmissibility,
    gong2025,
    integrate,
    spring_of,
    structure_of,
)
from vibench.sim.periodic.balance_branch import balance, balance_branch_within

TIME_S = 0.1 * np.arange(2000)
FREQUENCY_HZ = 150 + TIME_S
BAND_HZ = (92.0, 108.0)


def response(at_hz, decibel, noise, seed=0):
    smooth = 2 + np.sin(TIME_S / 40)
    stepped = smooth * np.where(at_hz <= FREQUENCY_HZ, 10 ** (decibel / 20), 1)
    return stepped * np.exp(noise * np.random.default_rng(seed).standard_normal(TIME_S.size))


@pytest.mark.parametrize("decibel", [-10.0, 3.0])
@pytest.mark.parametrize("noise", [1e-3, 0.02])
def test_the_frequency_bounds_of_a_jump_contain_the_jump_and_no_other_jump_is_found(decibel, noise):
    for seed in range(10):
        at_hz = np.random.default_rng(seed).uniform(180, 320)
        found = jumps(TIME_S, FREQUENCY_HZ, response(at_hz, decibel, noise, seed))
        assert len(found) == 1
        assert found[0].lower_hz <= at_hz <= found[0].upper_hz
        assert found[0].upper_hz - found[0].lower_hz < 1
        assert found[0].decibel == pytest.approx(decibel, abs=0.7)


def test_a_steep_resonance_and_noise_are_not_reported_as_jumps():
    resonance = 1 / np.abs(1 - (FREQUENCY_HZ / 266) ** 2 + 0.02j * FREQUENCY_HZ / 266)
    noise = np.random.default_rng(1).standard_normal(TIME_S.size)
    assert jumps(TIME_S, FREQUENCY_HZ, resonance * np.exp(0.01 * noise)) == ()
    assert jumps(TIME_S, FREQUENCY_HZ, np.exp(0.3 * noise)) == ()


@pytest.mark.parametrize("step_hz", [0.2, 0.4, 0.6, 1.1, 3.0])
@pytest.mark.parametrize("ratio", [0.003, 0.017, 0.06])
@pytest.mark.parametrize("noise", [1e-4, 1e-2])
def test_a_resonance_sampled_by_few_intervals_is_not_a_jump(step_hz, ratio, noise):
    frequency_hz = np.arange(220.0, 310.0, step_hz)
    r = frequency_hz / 266
    resonance = np.abs((1 + 2j * ratio * r) / (1 - r**2 + 2j * ratio * r))
    scatter = noise * np.random.default_rng(0).standard_normal(r.size)
    assert jumps(frequency_hz, frequency_hz, resonance * np.exp(scatter)) == ()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("start_hz", "stop_hz", "duration_s"), [(220, 310, 8), (50, 600, 20), (600, 50, 60), (80, 110, 20)]
)
def test_the_ringing_of_a_linear_specimen_is_not_a_jump(start_hz, stop_hz, duration_s):
    """The description is right, has mode frequencies 2 % off, or is missing."""
    specimen, rate, amplitude_m = gong2025(), 8192.0, 1e-8
    run = integrate(
        specimen, LinearSweep(start_hz, stop_hz, duration_s, amplitude_m), duration_s, sample_rate_hz=rate
    )
    slope = (stop_hz - start_hz) / duration_s
    phase = 2 * np.pi * (start_hz * run.time_s + 0.5 * slope * run.time_s**2)
    base = -amplitude_m * (2 * np.pi * (start_hz + slope * run.time_s)) ** 2 * np.sin(phase)
    noise = 1e-9 * np.random.default_rng(0).standard_normal(phase.size)
    low_hz, high_hz = sorted((start_hz, stop_hz))

    def described(frequency_hz, error):
        return base_transmissibility(specimen, frequency_hz / error)[:, 0]

    for linear in (partial(described, error=1.0), partial(described, error=1.02), None):
        found = sweep_response(
            np.sin(phase), base, run.states[:, 3] + noise, rate, low_hz=low_hz, high_hz=high_hz, linear=linear
        )
        assert smooth_jumps(found, collisions(found)) == ()


def test_a_step_between_two_irregular_frequency_ranges_is_not_a_jump():
    rough = np.zeros(TIME_S.size, dtype=bool)
    assert jumps(TIME_S, FREQUENCY_HZ, response(250.0, -10, 0.01), rough) == ()
    half = FREQUENCY_HZ < 250
    assert len(jumps(TIME_S, FREQUENCY_HZ, response(250.0, -10, 0.01), half)) == 1


def test_sweep_arrays_of_different_length_are_refused():
    with pytest.raises(InvalidRequest, match="equally long"):
        jumps(TIME_S, FREQUENCY_HZ[1:], TIME_S)


@pytest.fixture(scope="module")
def hardening():
    """Sweeps up and down through the first resonance of a specimen with a cubic spring as stops."""
    specimen, amplitude_m, rate = gong2025(contact="power:3"), 2e-8, 4096.0
    found = []
    for start_hz, stop_hz in (BAND_HZ, BAND_HZ[::-1]):
        drive = LinearSweep(start_hz, stop_hz, 40.0, amplitude_m)
        run = integrate(specimen, drive, 40.0, sample_rate_hz=rate)
        phase = 2 * np.pi * (start_hz * run.time_s + 0.5 * (stop_hz - start_hz) / 40.0 * run.time_s**2)
        omega = 2 * np.pi * (start_hz + (stop_hz - start_hz) / 40.0 * run.time_s)
        base = -amplitude_m * omega**2 * np.sin(phase)
        low, high = BAND_HZ
        found.append(
            sweep_response(
                np.sin(phase), base, run.states[:, 3], rate, low_hz=low, high_hz=high, interval_s=0.2
            )
        )
    return specimen, amplitude_m, found


@pytest.mark.thorough
def test_a_hardening_specimen_jumps_up_and_down_at_the_folds_of_its_branch(hardening):
    specimen, amplitude_m, (up, down) = hardening
    parts, options = (structure_of(specimen), spring_of(specimen)), BalanceOptions(fewest=1, most=1)
    start = balance(*parts, BAND_HZ[0], amplitude_m, options)
    branch = balance_branch_within(*parts, start, FrequencyPath((amplitude_m,)), *BAND_HZ, options)
    folds = sorted(e.frequency_hz for e in branch.events if e.kind is BifurcationKind.FOLD)
    assert len(folds) == 2
    up_jumps = jumps(up.time_s, up.frequency_hz, up.response_ii)
    down_jumps = jumps(down.time_s, down.frequency_hz, down.response_ii)
    assert len(up_jumps) == len(down_jumps) == 1
    # The upward sweep (0.5 Hz/s) leaves the upper fold late, since the jump is slow.
    assert up_jumps[0].frequency_hz == pytest.approx(folds[-1], rel=0.02)
    assert up_jumps[0].decibel < 0 < down_jumps[0].decibel
    found = hysteresis(up, down, up_jumps, down_jumps)
    ((width, low, high),) = found.widths_hz
    assert low <= width <= high
    assert width == pytest.approx(folds[-1] - folds[0], abs=1.5)
    between = (found.frequency_hz > folds[0] + 1) & (found.frequency_hz < folds[-1] - 1)
    assert found.differs[between].all()
    assert not found.differs[found.frequency_hz > folds[-1] + 3].any()


@pytest.mark.thorough
def test_hysteresis_needs_an_up_sweep_and_then_a_down_sweep(hardening):
    _, _, (up, down) = hardening
    with pytest.raises(InvalidRequest, match="in this order"):
        hysteresis(down, up, (), ())
