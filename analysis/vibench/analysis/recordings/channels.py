"""The three channels of every analysis: drive, base and response, from a recording or a simulation."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from vibench.acquisition.recording import (
    REJECTED,
    Recording,
    SegmentLabel,
    coupling_cut_hz,
)
from vibench.acquisition.rig import sensor_table

from ..errors import NotEnoughData, UnusableData
from ..signals.arrays import Complexes, Flags, Reals
from .response import FORCE, RESPONSE_ROLES, VELOCITY, ResponseChannel

SENSOR_DAMPING_RATIO = 0.02
"""Usual damping ratio of the mounted resonance of a piezoelectric sensor."""


class SensedChannel(Protocol):
    """A channel of a recording or a bench, with its sensor."""

    @property
    def role(self) -> str:
        """Role of the channel, such as ``"m0_velocity"``."""

    @property
    def delay_s(self) -> float:
        """Lag of the sensor signal [s]."""

    @property
    def coupling(self) -> str:
        """Coupling of the input: AC or DC."""


def sensor_gain(bench: Mapping[str, Any], channel: SensedChannel, frequency_hz: Reals) -> Complexes:
    """Return the complex gain of a channel relative to its motion, shape (lines,); 1 at low frequency.

    The gain includes the delay in the header, the sensor's mounted resonance and its bandwidth, but not the
    converter's coupling. The delay in the header contains the delay due to the bandwidth.
    """
    sensor = described_sensor(bench, channel.role)
    part = frequency_hz / _number(sensor, "resonance_hz")
    bandwidth_hz = _number(sensor, "bandwidth_hz")
    delay_s = channel.delay_s - 1 / (2 * np.pi * bandwidth_hz)
    gain = 1 / (1 - part**2 + 2j * SENSOR_DAMPING_RATIO * part) / (1 + 1j * frequency_hz / bandwidth_hz)
    return np.asarray(gain * np.exp(-2j * np.pi * frequency_hz * delay_s))


def coupled_gain(bench: Mapping[str, Any], channel: SensedChannel, frequency_hz: Reals) -> Complexes:
    """Return the gain of `sensor_gain` with the channel's coupling, above 0 Hz."""
    coupling = 1j * frequency_hz / (1j * frequency_hz + coupling_cut_hz(channel.coupling))
    return np.asarray(sensor_gain(bench, channel, frequency_hz) * coupling)


def described_sensor(bench: Mapping[str, Any], role: str) -> Mapping[str, Any]:
    """Return the bench configuration's entry on a channel's sensor; empty if there is none."""
    return bench.get(sensor_table(role)) or (bench.get("sensors") or {}).get(role) or {}


def _number(sensor: Mapping[str, Any], key: str) -> float:
    """Return a stated frequency of a sensor [Hz]; infinite if it is not stated."""
    value = sensor.get(key)
    return float(value) if isinstance(value, int | float) and value > 0 else np.inf


OnRead = Callable[[int, int], None]
"""Callback during reading, with arguments (samples read, total samples)."""


def ignore_reading(samples: int, of: int) -> None:
    """Do nothing; the default callback."""


DRIVE, BASE, RESPONSE = "drive_voltage", "base_acceleration", VELOCITY


@dataclass(frozen=True)
class Stretch:
    """Consecutive samples that belong together in an analysis."""

    start: int
    stop: int
    """Index one past the last sample of the stretch."""
    numbers: dict[str, int | float | str]
    """Values of this stretch in the plan, such as ``realisation`` or ``frequency_hz``."""
    is_complete: bool

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.stop - self.start


ALIGNMENT_ERRORS = "alignment_errors_s"
"""Entry of an import's facts: the largest error of each channel's start relative to the others [s]."""


def alignment_error_s(recording: Recording, *roles: str) -> float:
    """Return the largest error of the time between channels, from the digits of the times in their file."""
    errors_s = recording.bench.get("imported", {}).get(ALIGNMENT_ERRORS, {})
    return float(sum(errors_s.get(role, 0.0) for role in roles))


class Channels(Protocol):
    """The channels that an estimator uses, recorded or simulated."""

    @property
    def sample_rate_hz(self) -> float:
        """Sample rate of all channels."""

    @property
    def samples(self) -> int:
        """Number of valid samples per channel."""

    @property
    def response_delay_s(self) -> float:
        """Lag of the response channel behind the base channel [s]."""

    @property
    def is_force(self) -> bool:
        """Whether the response is a force [N]."""

    def response_gain(self, frequency_hz: Reals) -> Complexes:
        """Ratio of the response sensor's gain to the base sensor's, without their delays; shape (lines,)."""

    def stretches(self, label: str) -> tuple[Stretch, ...]:
        """Return the record's parts named ``label``, in the order of time."""

    def read(self, start: int, stop: int) -> Reals:
        """Return drive [V], base acceleration [m/s2] and response velocity [m/s], shape (3, samples)."""

    def overload_flags(self, start: int, stop: int) -> Flags:
        """Return flags of the samples at which a channel was near full scale, shape (samples,)."""

    def bridge_flags(self, start: int, stop: int) -> Flags:
        """Return flags of the samples at which the response bridges a drop-out, shape (samples,)."""


@dataclass(frozen=True, eq=False)
class RecordedChannels:
    """Channels of a recording; lost samples are NaN, and drop-outs of the vibrometer are bridged."""

    recording: Recording
    on_read: OnRead = ignore_reading
    response: str | None = None
    """Channel to analyse; by default the channel that measures m0."""
    _response: ResponseChannel = field(init=False)

    def __post_init__(self) -> None:
        missing = [role for role in (DRIVE, BASE) if role not in self.recording.roles]
        if missing:
            raise UnusableData(
                f"there is no channel {', '.join(missing)}; the recording has "
                f"{', '.join(self.recording.roles)}, and an analysis needs {DRIVE}, {BASE} and one of "
                f"{', '.join(RESPONSE_ROLES)}"
            )
        object.__setattr__(self, "_response", ResponseChannel(self.recording, self.response))

    @property
    def sample_rate_hz(self) -> float:
        """Sample rate of all channels."""
        return self.recording.sample_rate_hz

    @property
    def samples(self) -> int:
        """Number of valid samples per channel."""
        return self.recording.samples

    @property
    def response_delay_s(self) -> float:
        """Lag of the response channel behind the base channel [s]."""
        return self.recording.channel(self._response.role).delay_s - self.recording.channel(BASE).delay_s

    @property
    def is_force(self) -> bool:
        """Whether the response is a force [N]."""
        return self._response.quantity == FORCE

    def response_gain(self, frequency_hz: Reals) -> Complexes:
        """Ratio of the response sensor's gain to the base sensor's, with couplings and without delays."""
        response, base = (
            coupled_gain(self.recording.bench, self.recording.channel(role), frequency_hz)
            for role in (self._response.role, BASE)
        )
        delay = np.exp(2j * np.pi * frequency_hz * self.response_delay_s)
        return np.asarray(response / base * delay)

    def stretches(self, label: str) -> tuple[Stretch, ...]:
        """Return the record's parts named ``label`` that have samples, without rejected averages."""
        found = tuple(
            Stretch(each.start, each.stop, dict(each.numbers), each.is_complete)
            for each in self.recording.segments
            if each.label == label and each.stop > each.start
        )
        if label != SegmentLabel.REALISATION:
            return found
        marks = (each.sample for each in self.recording.events if each.text == REJECTED)
        rejected = {max((each.start for each in found if each.start <= mark), default=-1) for mark in marks}
        return tuple(each for each in found if each.start not in rejected)

    def read(self, start: int, stop: int) -> Reals:
        """Return drive [V], base acceleration [m/s2] and response velocity [m/s], shape (3, samples)."""
        drive, base = (self.recording.read(role, start, stop) for role in (DRIVE, BASE))
        read = np.stack([drive, base, self._response.read(start, stop)])
        self.on_read(stop, self.samples)
        return read

    def overload_flags(self, start: int, stop: int) -> Flags:
        """Return flags of the samples at which a channel was near full scale, shape (samples,)."""
        marks = np.zeros(stop - start, dtype=np.bool_)
        for each in self.recording.overloads:
            if each.channel in (DRIVE, BASE, self._response.role):
                # A clipped acceleration peak affects the velocity as far as the integration kernel reaches.
                reach = self._response.reach if each.channel == self._response.role else 0
                first, last = each.first_sample - reach, each.last_sample + reach
                marks[max(0, first - start) : max(0, last + 1 - start)] = True
        for dropout in self._response.dropouts(start, stop):
            marks[max(0, dropout.first - start) : dropout.stop - start] = False
        return marks

    def bridge_flags(self, start: int, stop: int) -> Flags:
        """Return flags of the samples at which the response bridges a drop-out, shape (samples,)."""
        marks = np.zeros(stop - start, dtype=np.bool_)
        for dropout in self._response.dropouts(start, stop):
            marks[max(0, dropout.first - start) : dropout.stop - start] = True
        return marks


def far_from(marks: Flags, reach: int) -> Flags:
    """Return flags of samples more than ``reach`` samples away from every marked one, shape (samples,)."""
    if not marks.any():
        return np.ones(marks.size, dtype=np.bool_)
    total = np.concatenate(([0], np.cumsum(marks)))
    places = np.arange(marks.size)
    low, high = np.maximum(places - reach, 0), np.minimum(places + reach + 1, marks.size)
    return np.asarray(total[high] == total[low])


def only_stretch(channels: Channels, label: str) -> Stretch:
    """Return the first stretch with this label; raises NotEnoughData when there is none."""
    found = channels.stretches(label)
    if not found:
        raise NotEnoughData(
            f"the recording ended before its {label} began, so there is nothing to analyse; measure again"
        )
    return found[0]


def read_whole(channels: Channels, stretch: Stretch) -> Reals:
    """Return the samples of a stretch; raises UnusableData when samples were lost inside it."""
    data = channels.read(stretch.start, stretch.stop)
    lost = int(np.count_nonzero(np.isnan(data[0])))
    if lost:
        raise UnusableData(
            f"{lost} of {stretch.samples} samples were lost in this part, so its motion cannot be analysed; "
            "measure again, or import a part of the file without lost samples"
        )
    return data
