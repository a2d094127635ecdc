"""Common input of every analysis: drive, base, and the velocity of a mass from any sensor."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.fft import next_fast_len
from scipy.special import sici

from vibench.acquisition.recording import (
    REJECTED,
    BridgedChannel,
    ChannelHeader,
    Dropout,
    Recording,
    SegmentLabel,
    coupling_cut_hz,
)
from vibench.acquisition.rig import RESPONSE_ROLES as ROLES, Channel, sensor_table

from ..errors import NotEnoughData, UnusableData
from ..signals import Complexes, Flags, Reals, Samples

VELOCITY = ROLES[0].value
RESPONSE_ROLES = tuple(role.value for role in ROLES)
"""Channels that measure the motion of m0, in the order of preference."""
ACCELERATION, DISPLACEMENT, FORCE = "acceleration", "displacement", "force"
_MOTIONS = ("velocity", ACCELERATION, DISPLACEMENT)
_COLLIDING = ("m1", "m2")
LOWEST_INTEGRATED_HZ = 5.0
"""Lowest frequency of exact integration [Hz]; below it, the velocity decreases to zero."""
_HELD_S, _REACH_S = 0.2, 1.0
_TAPER = 12.0
"""Parameter beta of the Kaiser window; above 5 Hz, truncation errors of the integral are below 3e-5."""
_DERIVATIVE_REACH, _EXACT_BAND = 64, 0.45
"""Derivative: number of samples on each side; fraction of the sample rate up to which it errs by 1e-4."""
_FIT_POINTS, _REST_WEIGHT = 1500, 1e-4
"""Derivative: number of fitted frequencies, and weight above the exact band, which limits the gain there."""
_BLOCK_REACHES, _LEAST_BLOCK = 4, 1 << 16
"""Smallest block, in kernel lengths and in samples; another half kernel is read on either side."""


def integral_kernel(rate_hz: float) -> Reals:
    """Return the weights of a zero-phase integral of samples, shape (2 L + 1,) [s].

    The integral of a band-limited signal has the weights Si(pi n) / pi (the integral of sinc). These weights
    are kept up to 0.2 s, then fade to 0 at 1 s along the integral of a Kaiser window. The weights are odd and
    so remove a constant.
    """
    reach, held = round(_REACH_S * rate_hz), round(_HELD_S * rate_hz)
    places = np.arange(1, reach + 1)
    fall = np.cumsum(np.kaiser(reach - held, _TAPER))
    weights = np.concatenate((np.ones(held), 1 - fall / fall[-1]))
    half = sici(np.pi * places)[0] / np.pi * weights / rate_hz
    return np.concatenate((-half[::-1], [0.0], half))


def derivative_kernel(rate_hz: float) -> Reals:
    """Return weights of a band-limited derivative with zero phase, shape (2 L + 1,) [1/s]."""
    half = _derivative_weights() * rate_hz
    return np.concatenate((-half[::-1], [0.0], half))


@lru_cache(maxsize=1)
def _derivative_weights() -> Reals:
    """Return the second half of the derivative kernel, fitted for a sample rate of 1, shape (L,).

    The fit minimises the squared relative error. Windowed ideal weights would err by 2e-3 at 100 Hz, because
    their step at half the sample rate leaks to low frequencies, where a derivative is small.
    """
    angle = 2 * np.pi * np.linspace(0.0, 0.5, _FIT_POINTS + 1)[1:]
    inside = angle <= 2 * np.pi * _EXACT_BAND
    weight = np.where(inside, 1.0, _REST_WEIGHT)
    matrix = -2 * np.sin(np.outer(angle, np.arange(1, _DERIVATIVE_REACH + 1))) / angle[:, np.newaxis]
    return np.asarray(np.linalg.lstsq(matrix * weight[:, np.newaxis], inside * weight)[0])


_CONVERSIONS: MappingProxyType[str, tuple[Callable[[float], Reals], float]] = MappingProxyType(
    {
        # Samples mirrored with the opposite sign continue the velocity smoothly.
        ACCELERATION: (integral_kernel, 0.0),
        DISPLACEMENT: (derivative_kernel, 2.0),
    }
)
"""Kernel and factor ``about``; beyond an end, the signal is set to about * end sample - mirrored sample."""


@dataclass(eq=False)
class ResponseChannel:
    """Velocity of a mass, or a force; by default the velocity of m0, from the first of `RESPONSE_ROLES`.

    An acceleration is integrated, which increases noise at low frequencies. A displacement is differentiated,
    which increases noise at high frequencies. Both operations have zero phase.

    Raises UnusableData when the recording has no such channel, or is too short to integrate.
    """

    recording: Recording
    response: str | None = None
    """Channel that measures the motion or force; by default the first channel of m0."""
    role: str = field(init=False)
    quantity: str = field(init=False)
    _kernel: Reals = field(init=False, default_factory=lambda: np.empty(0))
    _block: tuple[int, Reals] | None = field(init=False, default=None)
    """Index and velocities of the last block; kept because estimators read blocks in order."""

    def __post_init__(self) -> None:
        found = self.response or response_role(self.recording)
        shown = (*response_roles(self.recording), *force_roles(self.recording))
        if self.response is not None and self.response not in shown:
            raise UnusableData(
                f"channel {self.response} measures neither a force nor the motion of a mass; channels of the "
                f"recording that do:  {', '.join(shown) or 'none'}"
            )
        if found is None:
            raise UnusableData(
                f"no channel measures the motion of m0: the recording has {', '.join(self.recording.roles)}; "
                f"an analysis needs one of {', '.join(RESPONSE_ROLES)}"
            )
        self.role, self.quantity = found, _quantity(found)
        if self.quantity in _CONVERSIONS:
            self._kernel = _CONVERSIONS[self.quantity][0](self.recording.sample_rate_hz)
        if self.quantity in _CONVERSIONS and self.recording.samples <= self.reach:
            raise UnusableData(
                f"{self.recording.duration_s:.3g} s of {found} are too short to compute a velocity; record "
                f"more than {self.reach / self.recording.sample_rate_hz:.3g} s"
            )

    @property
    def reach(self) -> int:
        """Number of samples on either side that influence a velocity."""
        return self._kernel.size // 2

    @property
    def noise_gain(self) -> float:
        """Ratio of velocity noise to channel noise (rms), for white channel noise."""
        return float(np.linalg.norm(self._kernel)) if self._kernel.size else 1.0

    def read(self, start: int, stop: int) -> Reals:
        """Return velocities [m/s] or forces [N]; lost samples are NaN, drop-outs are bridged."""
        if self._may_drop_out:
            return BridgedChannel(self.recording, self.role).read(start, stop)
        if self.quantity not in _CONVERSIONS:
            return self.recording.read(self.role, start, stop)
        size = max(_BLOCK_REACHES * self._kernel.size, _LEAST_BLOCK)
        parts = [np.empty(0)]
        for number in range(start // size, -(-stop // size)):
            first = number * size
            block = self._velocities(number, size)
            parts.append(block[max(start - first, 0) : stop - first])
        return np.concatenate(parts)

    def dropouts(self, start: int, stop: int) -> tuple[Dropout, ...]:
        """Return the drop-outs between two samples; only vibrometers have drop-outs."""
        if not self._may_drop_out:
            return ()
        return BridgedChannel(self.recording, self.role).between(start, stop)

    @property
    def _may_drop_out(self) -> bool:
        """Whether jumps of the signal are drop-outs; jumps of m1 and m2 are collisions."""
        is_vibrometer = self.quantity not in (*_CONVERSIONS, FORCE)
        return is_vibrometer and self.role.partition("_")[0] not in _COLLIDING

    def _velocities(self, number: int, size: int) -> Reals:
        if self._block is None or self._block[0] != number:
            reach, samples = self.reach, self.recording.samples
            start, stop = number * size, min((number + 1) * size, samples)
            first, last = max(start - reach, 0), min(stop + reach, samples)
            given = self.recording.read(self.role, first, last)
            lost = np.isnan(given)
            given = np.where(lost, 0.0, given - (0.0 if lost.all() else np.nanmean(given)))
            before, behind = first - (start - reach), (stop + reach) - last
            about = _CONVERSIONS[self.quantity][1]
            ends = _mirror(given, before, about)[::-1], _mirror(given[::-1], behind, about)
            given = np.concatenate((ends[0], given, ends[1]))
            found = _convolve(given, self._kernel)
            if lost.any():
                marks = np.pad(lost.astype(np.float64), (before, behind))
                found[_convolve(marks, np.ones(self._kernel.size)) > 0.5] = np.nan
            self._block = (number, found)
        return self._block[1]


def noise_as_read(
    role: str, rate_hz: float, count: int, block: int, rng: np.random.Generator
) -> Iterator[Samples]:
    """Yield white sensor noise of unit variance, converted as in an analysis; for a mass, to a velocity."""
    conversion = None if role.startswith("base_") else _CONVERSIONS.get(_quantity(role))
    if conversion is None:
        for first in range(0, count, block):
            yield rng.standard_normal(min(block, count - first), np.float32)
        return
    kernel, about = conversion[0](rate_hz), conversion[1]
    reach, white = kernel.size // 2, rng.standard_normal(count)
    # Mirrored samples double the variance of an integral at both ends of a recording.
    white = np.concatenate((_mirror(white, reach, about)[::-1], white, _mirror(white[::-1], reach, about)))
    for first in range(0, count, block):
        yield _convolve(white[first : first + block + 2 * reach], kernel)


def _mirror(samples: Reals, count: int, about: float) -> Reals:
    """Return ``count`` mirrored samples beyond the first sample, the nearest first."""
    return np.asarray(about * samples[:1] - samples[1 : count + 1])


def _convolve(samples: Samples, kernel: Reals) -> Reals:
    """Return the part of a convolution that needs no sample beyond the ends."""
    # Use numpy.fft: importing scipy.signal would delay the start of the window.
    size = next_fast_len(samples.size + kernel.size - 1, real=True)
    whole = np.fft.irfft(np.fft.rfft(samples, size) * np.fft.rfft(kernel, size), size)
    return whole[kernel.size - 1 : samples.size]


def _quantity(role: str) -> str:
    return role.rpartition("_")[2]


def response_roles(recording: Recording) -> tuple[str, ...]:
    """Return every channel that measures the motion of a mass, ``<mass>_<quantity>``, m0 first."""
    first = response_role(recording)
    others = (
        role
        for role in recording.roles
        if role != first
        and role.partition("_")[0] != "base"
        and _quantity(role) in _MOTIONS
        and recording.channel(role).quantity == _quantity(role)
    )
    return (*(() if first is None else (first,)), *others)


def force_roles(recording: Recording) -> tuple[str, ...]:
    """Return every channel that measures a force, ``<place>_force``."""
    return tuple(
        role
        for role in recording.roles
        if role.endswith(f"_{FORCE}") and recording.channel(role).quantity == FORCE
    )


def response_role(recording: Recording) -> str | None:
    """Return the channel that measures the motion of m0; None if there is none."""
    return next((each for each in RESPONSE_ROLES if each in recording.roles), None)


def scanned_role(recording: Recording) -> str | None:
    """Return the vibrometer channel at a scan point that is not on m0; None for other recordings."""
    point = recording.plan.get("point")
    role = f"{point.get('body')}_velocity" if isinstance(point, dict) else VELOCITY
    return role if role != VELOCITY and role in recording.roles else None


SENSOR_DAMPING_RATIO = 0.02
"""Usual damping ratio of the mounted resonance of a piezoelectric sensor."""


SensedChannel = ChannelHeader | Channel
"""A channel of a recording or a bench, with its sensor."""


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
"""Callback that is called during reading, with arguments (samples read, total samples)."""


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
    """Values that the plan gives for this stretch, such as ``realisation`` or ``frequency_hz``."""
    is_complete: bool

    @property
    def samples(self) -> int:
        """Number of samples."""
        return self.stop - self.start


ALIGNMENT_ERRORS = "alignment_errors_s"
"""Entry of an import's facts: the largest error of each channel's start relative to the others [s]."""


def alignment_error_s(recording: Recording, *roles: str) -> float:
    """Return the largest error of the time between channels, from the decimals of the times in the file."""
    errors_s = recording.bench.get("imported", {}).get(ALIGNMENT_ERRORS, {})
    return float(sum(errors_s.get(role, 0.0) for role in roles))


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
        """Return the record's parts named ``label`` that have samples, except rejected averages."""
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
        """Return the drive [V], base acceleration [m/s2] and response velocity [m/s], shape (3, samples)."""
        drive, base = (self.recording.read(role, start, stop) for role in (DRIVE, BASE))
        read = np.stack([drive, base, self._response.read(start, stop)])
        self.on_read(stop, self.samples)
        return read

    def overload_flags(self, start: int, stop: int) -> Flags:
        """Return flags of the samples at which a channel was near full scale, shape (samples,)."""
        marks = np.zeros(stop - start, dtype=np.bool_)
        for each in self.recording.overloads:
            if each.channel in (DRIVE, BASE, self._response.role):
                # A clipped acceleration peak affects the velocity over the length of the integration kernel.
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
    """Return flags of samples more than ``reach`` samples away from all marked samples, shape (samples,)."""
    if not marks.any():
        return np.ones(marks.size, dtype=np.bool_)
    total = np.concatenate(([0], np.cumsum(marks)))
    places = np.arange(marks.size)
    low, high = np.maximum(places - reach, 0), np.minimum(places + reach + 1, marks.size)
    return np.asarray(total[high] == total[low])


def only_stretch(channels: RecordedChannels, label: str) -> Stretch:
    """Return the first stretch with this label; raises NotEnoughData when there is none."""
    found = channels.stretches(label)
    if not found:
        raise NotEnoughData(
            f"the recording ended before its {label} began, so there is nothing to analyse; measure again"
        )
    return found[0]


def read_whole(channels: RecordedChannels, stretch: Stretch) -> Reals:
    """Return the samples of a stretch; raises UnusableData when samples were lost inside it."""
    data = channels.read(stretch.start, stretch.stop)
    lost = int(np.count_nonzero(np.isnan(data[0])))
    if lost:
        raise UnusableData(
            f"{lost} of {stretch.samples} samples were lost in this part, so its motion cannot be analysed; "
            "measure again, or import a part of the file without lost samples"
        )
    return data
