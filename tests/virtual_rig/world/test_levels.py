"""The default rig's levels: at the paper's voltages the specimen does what the paper's did.

Gong et al. 2025, section 5: white noise and dwells at 0.05, 1.5 and 10 V, a sweep from 150 to 350 Hz
in 200 s at 1.5 V. The generator's setting is taken as peak to peak, the peak of noise as all of it; the
sweep's setting grows with the square of frequency (constant base displacement) to 1.5 V at its end.
"""

from pathlib import Path

import numpy as np
import pytest

from vibench.acquisition.rig import BaseQuantity, RigModel, amplifier_of, load_rig, shaker_of, specimen_of
from vibench.sim.shaker.loaded_shaker import MOTION_COLUMNS, LoadedShaker
from vibench.virtual_rig.world.time_grid import USUAL_GRID

RIG = load_rig(Path(__file__).parents[3] / "hardware_configs" / "virtual_rig.toml")
STEP_S = USUAL_GRID.step_s
SECOND = int(USUAL_GRID.rate_hz)
BAND_HZ = np.arange(50, 601)
WEAK_VPP, MODERATE_VPP, STRONG_VPP = 0.05, 1.5, 10.0
DWELL_HZ = 260.0


def switched_on():
    return LoadedShaker(amplifier_of(RIG), shaker_of(RIG), specimen_of(RIG), STEP_S)


def moved(plant, drive):
    return plant.move(drive, np.zeros(len(drive)), len(drive))


def noise(amplitude_vpp, realisation):
    """One second of flat random-phase noise whose peak is the full setting, lines every hertz."""
    lines = np.zeros(SECOND // 2 + 1, dtype=complex)
    lines[BAND_HZ] = np.exp(2j * np.pi * np.random.default_rng(realisation).random(len(BAND_HZ)))
    drive = np.fft.irfft(lines)
    return 0.5 * amplitude_vpp * drive / np.max(np.abs(drive))


def transmission(amplitude_vpp, realisations):
    """Acceleration of m0 over that of the base (h1), smoothed over 9 Hz, shape of BAND_HZ, and the plant."""
    plant, cross, power = switched_on(), 0.0, 0.0
    for realisation in range(realisations):
        drive = noise(amplitude_vpp, realisation)
        moved(plant, drive)
        moved(plant, drive)
        motion = moved(plant, drive)
        base = np.fft.rfft(motion.base_acceleration)[BAND_HZ]
        answer = np.fft.rfft(motion.m0_velocity)[BAND_HZ] * 2j * np.pi * BAND_HZ
        cross, power = cross + base.conj() * answer, power + np.abs(base) ** 2
    smoothing = np.ones(9) / 9
    return np.exp(np.convolve(np.log(np.abs(cross / power)), smoothing, "same")), plant


def peak_hz(gain, low_hz, high_hz):
    inside = (low_hz <= BAND_HZ) & (high_hz >= BAND_HZ)
    return BAND_HZ[inside][np.argmax(gain[inside])]


def sine(amplitude_vpp, frequency_hz, first_s, seconds):
    time_s = first_s + STEP_S * np.arange(seconds * SECOND)
    return 0.5 * amplitude_vpp * np.sin(2 * np.pi * frequency_hz * time_s)


@pytest.mark.parametrize("quantity", [BaseQuantity.FORCE, BaseQuantity.CURRENT, BaseQuantity.STROKE])
def test_the_strongest_sine_stays_within_the_shakers_limits_from_fifty_hertz_up(quantity):
    limits = RIG.shaker.limits
    allowed = {
        BaseQuantity.FORCE: limits.force_n.value,
        BaseQuantity.CURRENT: limits.current_a.value,
        BaseQuantity.STROKE: limits.stroke_m.value,
    }[quantity]
    reached = np.abs(RigModel(RIG).transfer(quantity, np.arange(50.0, 801.0))) * STRONG_VPP / 2
    assert np.max(reached) < 0.95 * allowed


def test_weak_noise_never_makes_an_impact_and_strong_noise_makes_hundreds():
    weak, strong = switched_on(), switched_on()
    truth = moved(weak, noise(WEAK_VPP, 1)).ends
    moved(strong, noise(STRONG_VPP, 1))
    p = truth[:, MOTION_COLUMNS.index("y")] - truth[:, MOTION_COLUMNS.index("z")]
    assert weak.impacts == 0
    assert np.max(np.abs(p)) < 0.3 * RIG.specimen.gap_m
    assert strong.impacts > 300
    assert strong.structure["limited_steps"] == strong.structure["bumps"] == 0


def test_weak_noise_shows_the_three_linear_resonances():
    gain, plant = transmission(WEAK_VPP, 4)
    assert plant.impacts == 0
    for expected_hz, low_hz, high_hz in ((95, 70, 150), (266, 220, 320), (500, 450, 550)):
        assert peak_hz(gain, low_hz, high_hz) == pytest.approx(expected_hz, abs=4)


def test_dwells_go_from_linear_to_strongly_colliding_with_lines_beside_the_drive_that_were_not_there():
    impacts, beside, clear = [], [], []
    for amplitude_vpp in (WEAK_VPP, MODERATE_VPP, STRONG_VPP):
        plant = switched_on()
        moved(plant, sine(amplitude_vpp, DWELL_HZ, 0, 6))
        velocity = moved(plant, sine(amplitude_vpp, DWELL_HZ, 6, 5)).m0_velocity
        spectrum = np.abs(np.fft.rfft(velocity * np.hanning(len(velocity))))
        frequency_hz = np.fft.rfftfreq(len(velocity), STEP_S)
        near = (frequency_hz > 150) & (frequency_hz < 240)
        at_drive = np.abs(frequency_hz - DWELL_HZ) < 2
        impacts.append(plant.impacts / 11)
        beside.append(np.max(spectrum[near]))
        clear.append(beside[-1] / np.max(spectrum[at_drive]))
    assert impacts[0] == 0
    assert 100 < impacts[1] < 0.8 * impacts[2]
    assert clear[0] < 1e-4
    assert min(clear[1:]) > 0.02
    # Between the two that collide it is a matter of the draw: both are chaotic.
    assert beside[0] < 1e-3 * min(beside[1:])
