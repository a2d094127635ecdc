"""How the motion of a dwell repeats: its points at the drive's phase, and the verdict on them."""

from dataclasses import dataclass

import numpy as np

from ..chaos import MotionVerdict, Points, motion_verdict
from ..recordings import Channels, only_stretch, read_whole
from ._dwell import DwellResponse
from ._stroboscope import BAND_ABOVE, Section, stroboscope


@dataclass(frozen=True, eq=False)
class DwellMotion:
    """A dwell once a drive period."""

    section: Section
    verdict: MotionVerdict


def dwell_motion(channels: Channels, response: DwellResponse) -> DwellMotion:
    """Sample a dwell at the phase of its recorded drive and judge how it repeats.

    Raises
    ------
    UnusableData
        When samples were lost inside the dwell.

    """
    stretch = only_stretch(channels, "dwell")
    drive, _, velocity = read_whole(channels, stretch)
    section = stroboscope(
        drive,
        velocity,
        channels.sample_rate_hz,
        near_hz=response.drive.frequency_hz,
        delay_s=channels.response_delay_s,
    )
    verdict = motion_verdict(_points(section, response, channels.sample_rate_hz), section.drive_hz)
    return DwellMotion(section, verdict)


def _points(section: Section, response: DwellResponse, sample_rate_hz: float) -> Points:
    """Points over the size of the orbit, and the vibrometer's noise in the same measure."""
    sizes = np.array(
        [
            np.sqrt(2 * np.mean(section.orbit_displacement_m**2)),
            np.sqrt(2 * np.mean(section.orbit_velocity_m_per_s**2)),
        ]
    )
    velocity_noise = response.noise_density * np.sqrt(BAND_ABOVE * sample_rate_hz)
    value = np.column_stack((section.displacement_m, section.velocity_m_per_s)) / sizes
    return Points(value, np.array([response.noise_displacement_m, velocity_noise]) / sizes)
