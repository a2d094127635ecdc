"""The low-level check at the beginning of each run: decaying vibration passes, lasting vibration fails."""

import numpy as np
import pytest

from vibench.acquisition import CheckFailed
from vibench.acquisition.rig import BaseQuantity, RigModel, Role, channels_of
from vibench.acquisition.run.silence_watch import check_figures

RATE_HZ = 51_200.0
AMPLITUDE_VPP = 0.02
HUM_V = 5e-3


def sine(peak, count):
    return peak * np.sin(2 * np.pi * 160.0 * np.arange(count) / RATE_HZ)


@pytest.fixture
def check(rig):
    """Return a check that takes the drive voltage of the 0.1 s before the output; the sine is correct."""
    channels = channels_of(rig)
    terminal_v = 0.5 * AMPLITUDE_VPP * rig.generator.terminal_factor()
    accelerance = abs(complex(RigModel(rig).transfer(BaseQuantity.ACCELERATION, 160.0)))
    peaks = {Role.DRIVE_VOLTAGE: terminal_v, Role.BASE_ACCELERATION: terminal_v * accelerance}
    heard = np.stack([sine(peaks.get(each.role, 0.0) / each.units_per_volt, 15_360) for each in channels])

    def check(drive_v):
        quiet = np.zeros((len(channels), 5120))
        quiet[0] = drive_v / channels[0].units_per_volt
        return check_figures(rig, channels, quiet, heard, RATE_HZ, AMPLITUDE_VPP)

    return check


def test_a_signal_of_the_previous_run_that_decays_in_time_passes_the_check(check):
    tail = sine(0.5, 5120)
    tail[100:] = 0.0
    figures = check(tail)
    assert figures.drive_v == pytest.approx(figures.expected_drive_v, rel=1e-3)


def test_an_interfering_source_is_found_before_output(check):
    with pytest.raises(
        CheckFailed, match=r"the drive voltage shows 0\.005 V at 160 Hz before any signal is played"
    ):
        check(sine(HUM_V, 5120))
