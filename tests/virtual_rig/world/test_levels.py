"""Levels of the default rig: at the paper's voltages impacts occur as in the paper.

Gong et al. 2025, section 5: white noise from 0.05 to 10 V. The setting is taken as the peak-to-peak value,
also of noise. Tests of the demo check the resonances and dwells.
"""

import numpy as np
import pytest

from vibench.acquisition.rig import BaseQuantity, RigModel, amplifier_of, load_rig, shaker_of, specimen_of
from vibench.sim.shaker.loaded_shaker import MOTION_COLUMNS, LoadedShaker
from vibench.virtual_rig.world.time_grid import USUAL_GRID

RIG = load_rig("virtual_rig")
STEP_S = USUAL_GRID.step_s
SECOND = int(USUAL_GRID.rate_hz)
BAND_HZ = np.arange(50, 601)
WEAK_VPP, STRONG_VPP = 0.05, 10.0


def new_plant():
    return LoadedShaker(amplifier_of(RIG), shaker_of(RIG), specimen_of(RIG), STEP_S)


def motion_of(plant, drive):
    return plant.move(drive, np.zeros(len(drive)), len(drive))


def noise(amplitude_vpp, realisation):
    """Return one second of random-phase noise with lines every hertz; its peak is the full setting."""
    lines = np.zeros(SECOND // 2 + 1, dtype=complex)
    lines[BAND_HZ] = np.exp(2j * np.pi * np.random.default_rng(realisation).random(len(BAND_HZ)))
    drive = np.fft.irfft(lines)
    return 0.5 * amplitude_vpp * drive / np.max(np.abs(drive))


@pytest.mark.parametrize("quantity", [BaseQuantity.FORCE, BaseQuantity.CURRENT, BaseQuantity.STROKE])
def test_the_strongest_sine_at_fifty_hertz_and_above_stays_within_the_limits_of_the_shaker(quantity):
    limits = RIG.shaker.limits
    allowed = {
        BaseQuantity.FORCE: limits.force_n.value,
        BaseQuantity.CURRENT: limits.current_a.value,
        BaseQuantity.STROKE: limits.stroke_m.value,
    }[quantity]
    reached = np.abs(RigModel(RIG).transfer(quantity, np.arange(50.0, 801.0))) * STRONG_VPP / 2
    assert np.max(reached) < 0.95 * allowed


def test_weak_noise_causes_no_impact_and_strong_noise_causes_hundreds_of_impacts():
    weak, strong = new_plant(), new_plant()
    truth = motion_of(weak, noise(WEAK_VPP, 1)).ends
    motion_of(strong, noise(STRONG_VPP, 1))
    p = truth[:, MOTION_COLUMNS.index("y")] - truth[:, MOTION_COLUMNS.index("z")]
    assert weak.impacts == 0
    assert np.max(np.abs(p)) < 0.3 * RIG.specimen.gap_m
    assert strong.impacts > 300
    assert strong.structure["limited_steps"] == strong.structure["bumps"] == 0
