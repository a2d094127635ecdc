"""The three channels that feedback uses, converted from volts to their units."""

from dataclasses import dataclass
from math import pi

import numpy as np

from ..errors import ConfigurationError, LimitExceeded
from ..instruments import Samples
from ..plan import needed_vpp
from ..recording import bridge, coupling_cut_hz, find_dropouts, first_undecided
from ..rig import RESPONSE_ROLES, Channel, OnTable, Rig, Role
from .control_action import PhaseSamples
from .steadiness import Phasors

_DERIVATIVES = {Role.M0_ACCELERATION: -1, Role.M0_DISPLACEMENT: 1}


@dataclass(frozen=True)
class FeedbackChannels:
    """Rows of drive, base and m0 in the array of samples, with their scales and corrections."""

    drive: int
    """Index of the drive voltage's row in the samples."""
    base: int
    response: int
    drive_units_per_volt: float
    """Drive voltage per volt at the input, including the divider [V/V]."""
    base_units_per_volt: float
    """Base acceleration per volt at the input [m/s2 per V]."""
    response_units_per_volt: float
    """Quantity of m0's sensor, in its SI unit, per volt at the input."""
    response_delay_s: float
    """Delay of m0's sensor [s]; all phase angles from this sensor are corrected for it."""
    base_cut_hz: float
    """-3 dB frequency of the base channel's AC coupling, whose effect is corrected [Hz]; 0 for DC."""
    response_cut_hz: float
    sample_rate_hz: float
    response_derivatives: int = 0
    """Number of differentiations from m0's signal to its velocity; -1 for an acceleration (integrated)."""

    def rows(self, samples: PhaseSamples) -> tuple[Samples, Samples, Samples]:
        """Return drive [V], base acceleration [m/s2] and the signal of m0, each of shape (samples,).

        Drop-outs of a vibrometer are filled from the motion before them.
        """
        response = samples.volts[self.response] * self.response_units_per_volt
        if self.response_derivatives == 0:
            response = bridge(response, find_dropouts(response, self.sample_rate_hz))
        return (
            samples.volts[self.drive] * self.drive_units_per_volt,
            samples.volts[self.base] * self.base_units_per_volt,
            response,
        )

    def velocity_over_response(self, frequency_hz: Samples) -> Phasors:
        """Return the ratio of m0's velocity to its sensor signal; 0 at 0 Hz, except for a velocity sensor."""
        is_known = (frequency_hz > 0) | (self.response_derivatives == 0)
        omega = 2j * pi * np.where(frequency_hz > 0, frequency_hz, 1.0)
        return np.asarray(np.where(is_known, omega**self.response_derivatives, 0.0))

    def transmissibility(
        self, base: Phasors, response: Phasors, frequency_hz: float, harmonic: float = 1.0
    ) -> complex:
        """Return the ratio of m0's displacement to the base displacement; zero if the base does not move.

        Another ``harmonic`` of m0 (also 1/2 or 1/3) is divided by the amplitude of the base's fundamental.
        From the phase of that harmonic, ``harmonic`` times the phase of the base is subtracted.
        """
        if not np.any(base):
            return 0j
        acceleration = complex(np.mean(base)) * (1.0 - 1j * self.base_cut_hz / frequency_hz)
        velocity = complex(np.mean(response)) * (1.0 - 1j * self.response_cut_hz / (harmonic * frequency_hz))
        # The displacement of the base is in antiphase with its acceleration.
        turned = 2 * pi * frequency_hz * self.response_delay_s - np.angle(-acceleration)
        moved = -2j * pi * frequency_hz * np.exp(1j * harmonic * turned) / harmonic
        return complex(moved * velocity / abs(acceleration))


def feedback_channels_of(channels: tuple[Channel, ...], sample_rate_hz: float) -> FeedbackChannels:
    """Return the channels that feedback needs; raises ConfigurationError when one is missing."""
    drive, base, response = (
        _row(channels, *roles) for roles in ((Role.DRIVE_VOLTAGE,), (Role.BASE_ACCELERATION,), RESPONSE_ROLES)
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
        response_derivatives=_DERIVATIVES.get(channels[response].role, 0),
    )


def _row(channels: tuple[Channel, ...], *roles: Role) -> int:
    rows = [channel.role for channel in channels]
    for role in roles:
        if role in rows:
            return rows.index(role)
    raise ConfigurationError(
        f"feedback needs the channel {' or '.join(role.value for role in roles)}, but the rig has none. "
        "Nothing was played; add this channel to daq.channels, or use an excitation without feedback"
    )


_REMEMBERED_S = 0.1
"""Duration of the stored samples [s]; a later drop-out is recognised and bridged from them."""


class BridgedRows:
    """Filter that bridges drop-outs in a stream of samples; it holds samples back if a drop-out may begin."""

    def __init__(self, sample_rate_hz: float) -> None:
        self._rate_hz = sample_rate_hz
        self._rows = np.empty((3, 0))
        self._first = 0
        self._next = 0
        """Number of the next sample to be returned."""

    def take(self, first_sample: int, rows: Samples) -> tuple[int, Samples]:
        """Add rows of drive, base and response, shape (3, n); return released rows and their first sample."""
        if first_sample != self._first + self._rows.shape[1]:
            self._rows, self._first, self._next = self._rows[:, :0], first_sample, first_sample
        self._rows = np.concatenate([self._rows, rows], axis=1)
        response = self._rows[-1]
        dropouts = find_dropouts(response, self._rate_hz)
        self._rows[-1] = bridge(response, dropouts)
        begin, stop = self._next - self._first, first_undecided(response, self._rate_hz, dropouts)
        stop = max(begin, stop)
        handed_on = self._rows[:, begin:stop].copy()
        surplus = min(begin, max(0, stop - round(_REMEMBERED_S * self._rate_hz)))
        first = self._next
        self._next += stop - begin
        self._rows, self._first = self._rows[:, surplus:], self._first + surplus
        return first, handed_on

    def skip(self) -> None:
        """Discard the samples held back, because they belong to an earlier phase."""
        self._next = self._first + self._rows.shape[1]


LEAST_ANSWER = 0.05
"""Ratio of measured to modelled base acceleration below which the loop counts as open. A specimen at
resonance may reduce the motion of a light table to about 0.2 of the linear model."""


def require_answer(rig: Rig, frequency_hz: float, setting_vpp: float, acceleration: float) -> None:
    """Raise LimitExceeded, to ramp down, if the fundamental ``acceleration`` [m/s2] is too small."""
    modelled = setting_vpp / needed_vpp(rig, 1.0, frequency_hz, OnTable.NOTHING)
    if acceleration < LEAST_ANSWER * modelled:
        raise LimitExceeded(
            f"the base acceleration was {acceleration:.3g} m/s2 at {frequency_hz:g} Hz; the model predicts "
            f"{modelled:.3g} m/s2, and feedback needs at least {LEAST_ANSWER:.0%} of that value. The run was "
            "ramped down, and its recording was kept; check the accelerometer, its cable and the amplifier"
        )
