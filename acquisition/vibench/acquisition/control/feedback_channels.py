"""The three channels that feedback listens to, in their units."""

from dataclasses import dataclass
from math import pi

import numpy as np

from ..errors import ConfigurationError
from ..instruments import Samples
from ..recording import bridged, coupling_cut_hz, found_dropouts
from ..rig import Channel, Role
from .control_action import PhaseSamples
from .stroboscope import Phasors, Stroboscope


@dataclass(frozen=True)
class FeedbackChannels:
    """Finds drive, base and m0 in the samples."""

    drive: int
    """Row of the drive's channel."""
    base: int
    response: int
    drive_units_per_volt: float
    """Behind its divider."""
    base_units_per_volt: float
    """[m/s2 per V]"""
    response_units_per_volt: float
    """[m/s per V]"""
    response_delay_s: float
    """Of the vibrometer; taken out of every phase [s]."""
    base_cut_hz: float
    """-3 dB of the channel's coupling, taken out of every phase too; 0 where direct voltage passes [Hz]."""
    response_cut_hz: float
    sample_rate_hz: float

    def rows(self, samples: PhaseSamples) -> tuple[Samples, Samples, Samples]:
        """Give drive [V], base acceleration [m/s2] and m0 velocity [m/s], each of shape (samples,).

        Where the vibrometer lost its light the motion is bridged.
        """
        response = samples.volts[self.response] * self.response_units_per_volt
        return (
            samples.volts[self.drive] * self.drive_units_per_volt,
            samples.volts[self.base] * self.base_units_per_volt,
            bridged(response, found_dropouts(response, self.sample_rate_hz)),
        )

    def stroboscope(self, near_hz: float, drives: int = 1) -> Stroboscope:
        """Begin to look once a period of the motion, which is so many of the drive."""
        return Stroboscope(near_hz, self.sample_rate_hz, drives)

    def transmissibility(
        self, base: Phasors, response: Phasors, frequency_hz: float, harmonic: float = 1.0
    ) -> complex:
        """Displacement of m0 over that of the base, from velocity and the fundamental of the acceleration.

        Of a harmonic of m0, half or a third of the drive's frequency too, over the size of the base's
        fundamental and its phase times as much. Zero where the base shows nothing at all.
        """
        if not np.any(base):
            return 0j
        acceleration = complex(np.mean(base)) * (1.0 - 1j * self.base_cut_hz / frequency_hz)
        velocity = complex(np.mean(response)) * (1.0 - 1j * self.response_cut_hz / (harmonic * frequency_hz))
        # The displacement of the base is opposite to its acceleration.
        turned = 2 * pi * frequency_hz * self.response_delay_s - np.angle(-acceleration)
        moved = -2j * pi * frequency_hz * np.exp(1j * harmonic * turned) / harmonic
        return complex(moved * velocity / abs(acceleration))


def feedback_channels_of(channels: tuple[Channel, ...], sample_rate_hz: float) -> FeedbackChannels:
    """Find the channels that feedback needs; raises ConfigurationError when one is missing."""
    drive, base, response = (
        _row(channels, role) for role in (Role.DRIVE_VOLTAGE, Role.BASE_ACCELERATION, Role.M0_VELOCITY)
    )
    return FeedbackChannels(
        drive=drive,
        base=base,
        response=response,
        drive_units_per_volt=channels[drive].units_per_volt,
        base_units_per_volt=channels[base].units_per_volt,
        response_units_per_volt=channels[response].units_per_volt,
        response_delay_s=channels[response].delay_s,
        base_cut_hz=coupling_cut_hz(channels[base].coupling),
        response_cut_hz=coupling_cut_hz(channels[response].coupling),
        sample_rate_hz=sample_rate_hz,
    )


def _row(channels: tuple[Channel, ...], role: Role) -> int:
    roles = [channel.role for channel in channels]
    if role not in roles:
        raise ConfigurationError(
            f"feedback listens to {role.value}, and this rig has no such channel. Nothing was played; add it "
            "to daq.channels, or use an excitation without feedback"
        )
    return roles.index(role)
