"""Coarser time grids of the virtual rig: their error, and grids that are refused."""

import numpy as np
import pytest

from vibench.acquisition import ConfigurationError, LimitExceeded, validate
from vibench.acquisition.plan import Dwell, Measurement, require_within_limits
from vibench.acquisition.rig import Rig, amplifier_of, highest_carried_hz, load_rig, shaker_of, specimen_of
from vibench.acquisition.rig._configuration import COARSEST_GRID_RATE_HZ, WATCHED_HZ, level_error
from vibench.sim.shaker.loaded_shaker import MOTION_COLUMNS, LoadedShaker
from vibench.virtual_rig.world.sensors import low_pass_gain, low_pass_poles, running_filter
from vibench.virtual_rig.world.time_grid import TimeGrid
from vibench.virtual_rig.world.world import World

RIG = load_rig("virtual_rig")
COARSE = TimeGrid(COARSEST_GRID_RATE_HZ)


def rig_with(sample_rate_hz, **virtual):
    content = RIG.model_dump(mode="json", exclude_none=True)
    content["daq"]["sample_rate_hz"] = sample_rate_hz
    content["virtual"] |= virtual
    return validate(content, Rig, "rig.toml")


def new_plant(grid):
    return LoadedShaker(amplifier_of(RIG), shaker_of(RIG), specimen_of(RIG), grid.step_s)


def phasors(frequency_hz, amplitude_v, grid):
    """Return the complex amplitude of base and m0 in the fifth second, shape (2,) [m]."""
    plant, count = new_plant(grid), int(grid.rate_hz)
    edges = 2 * np.pi * frequency_hz * grid.step_s * np.arange(5 * count + 1)
    drive = -amplitude_v * np.diff(np.cos(edges)) / (edges[1] - edges[0])
    truth = plant.move(drive, np.zeros(len(drive)), len(drive)).ends[-count:]
    seen = truth[:, [MOTION_COLUMNS.index("base_displacement"), MOTION_COLUMNS.index("x")]]
    return 2 * np.exp(-2j * np.pi * frequency_hz * grid.step_s * np.arange(count)) @ seen / count


@pytest.mark.parametrize("frequency_hz", [60.0, 201.0, 266.0, 480.0, WATCHED_HZ])
def test_the_errors_of_the_base_and_the_specimen_on_the_coarsest_grid_are_as_stated(frequency_hz):
    coarse, fine = (phasors(frequency_hz, 5e-3, TimeGrid(rate_hz)) for rate_hz in (COARSE.rate_hz, 409_600.0))
    # Near 266 Hz the reaction force of the specimen at resonance adds to the error.
    allowed = max(level_error(frequency_hz, COARSE.rate_hz), 6e-3)
    assert abs(coarse[0]) == pytest.approx(abs(fine[0]), rel=allowed)
    assert coarse[1] / coarse[0] == pytest.approx(fine[1] / fine[0], rel=1e-4)


def test_a_resonance_beyond_the_grid_is_left_out_and_not_folded_into_the_band():
    analogue, band_hz = low_pass_poles(None, 30e3), np.linspace(50.0, 2500.0, 200)
    running = running_filter(analogue, COARSE.step_s)
    z = np.exp(-2j * np.pi * band_hz * COARSE.step_s)
    gain = np.polyval(running.numerator[::-1], z) / np.polyval(running.denominator[::-1], z)
    error = gain / low_pass_gain(analogue, band_hz) - 1
    assert np.max(np.abs(error)) < 5e-3
    assert np.max(np.abs(error[band_hz < WATCHED_HZ])) < 5e-4
    rang = running.run(np.concatenate([np.ones(1), np.zeros(100)]))
    assert np.all(rang[6:] == 0.0)


def test_impacts_are_resolved_inside_a_coarse_step():
    rates = []
    for grid in (TimeGrid(), COARSE):
        plant = new_plant(grid)
        count = 3 * int(grid.rate_hz)
        plant.move(0.75 * np.sin(2 * np.pi * 250 * grid.step_s * np.arange(count)), np.zeros(count))
        rates.append(plant.impacts / 3)
    assert rates[1] == pytest.approx(rates[0], rel=0.1)
    assert rates[0] > 200


@pytest.mark.parametrize("rate_hz", [6400.0, 12_799.0, 204_800.0])
def test_a_time_grid_whose_error_is_too_large_is_refused_and_the_error_is_stated(rate_hz):
    with pytest.raises(
        ConfigurationError, match=r"grid_rate_hz = .*12800 to 102400 steps.*0\.8% too small at 500 Hz"
    ):
        rig_with(5120.0, grid_rate_hz=rate_hz)


def test_a_sample_rate_too_high_for_a_coarse_grid_is_refused():
    with pytest.raises(ConfigurationError, match=r"allows at most 6400 samples a second.*51200"):
        rig_with(51_200.0, grid_rate_hz=COARSE.rate_hz)
    world = World(rig_with(6400.0, grid_rate_hz=COARSE.rate_hz), terminal=None)
    with pytest.raises(ConfigurationError, match=r"51200 Hz is not possible .* 12800 steps.*500 to 6400 Hz"):
        world.sample((), 51_200.0)


def test_a_plan_above_the_band_of_a_coarse_grid_is_refused_before_output():
    def dwell(frequency_hz):
        excitation = Dwell(frequency_hz=frequency_hz, amplitude_vpp=0.1, duration_s=1)
        return Measurement(name="dwell", excitation=excitation)

    coarse = rig_with(6400.0, grid_rate_hz=COARSE.rate_hz)
    carried_hz = highest_carried_hz(COARSE.rate_hz)
    assert level_error(carried_hz, COARSE.rate_hz) == pytest.approx(0.01)
    require_within_limits(dwell(carried_hz - 1), coarse)
    with pytest.raises(LimitExceeded, match=r"would be 600 Hz, but must be at most 549.*1% too low"):
        require_within_limits(dwell(600), coarse)
    require_within_limits(dwell(600), rig_with(6400.0))
