"""Limit monitor of a measurement: checks the signals of every block and motions integrated from them."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import exp, pi, sqrt

import numpy as np
import scipy
from numpy.typing import NDArray

from ..errors import LimitExceeded, LimitTrip
from ..instruments import Block, Overload, Samples
from ..plan import InRunLimits, OnChange, OnOverload
from ..rig import Channel, Rig, Role, Sourced, suspended_mass_kg

HIGH_PASS_HZ = 2.0
"""Corner of every high-pass filter [Hz]. A sine is attenuated by 0.2 % at 10 Hz and by 2.5 % at 5 Hz."""


class _Section:
    """A second-order filter that keeps its state from block to block."""

    def __init__(self, numerator: tuple[float, ...], sample_rate_hz: float) -> None:
        corner = 2 * pi * HIGH_PASS_HZ
        self._b, self._a = scipy.signal.bilinear(numerator, (1.0, 2**0.5 * corner, corner**2), sample_rate_hz)
        self._state: NDArray[np.float64] | None = None

    def run(self, values: Samples) -> Samples:
        if self._state is None:
            # Start from the mean of the first block. The first sample could be a peak of the last run's
            # decay, to which the filter would respond for a second.
            self._state = scipy.signal.lfilter_zi(self._b, self._a) * float(np.mean(values))
        out, self._state = scipy.signal.lfilter(self._b, self._a, values, zi=self._state)
        return np.asarray(out)


def _integrator(sample_rate_hz: float) -> _Section:
    return _Section((1.0, 0.0), sample_rate_hz)


def _high_pass(sample_rate_hz: float) -> _Section:
    return _Section((1.0, 0.0, 0.0), sample_rate_hz)


@dataclass(frozen=True)
class BaseMotion:
    """Motion of the base at each sample of a block."""

    velocity: Samples
    """Velocity of the base at each sample [m/s]."""
    displacement: Samples
    """Displacement of the base at each sample [m]."""


class BaseTracker:
    """Double integrator of the base acceleration, with a second-order high-pass for each integration."""

    def __init__(self, sample_rate_hz: float) -> None:
        self._to_velocity = _integrator(sample_rate_hz)
        self._to_displacement = _integrator(sample_rate_hz)

    def follow(self, acceleration: Samples) -> BaseMotion:
        """Return the base motion for the next samples of acceleration [m/s2], which follow without a gap."""
        velocity = self._to_velocity.run(acceleration)
        return BaseMotion(velocity, self._to_displacement.run(velocity))


class SpecimenTracker:
    """Displacement of m0 relative to the base, which stretches the springs.

    If m0's sensor needs fewer integrations than the base acceleration, high-pass filters replace the missing
    ones, so that both motions have the same phase.
    """

    def __init__(self, sample_rate_hz: float, role: Role = Role.M0_VELOCITY) -> None:
        self._role = role
        self._to_velocity = (_integrator if role is Role.M0_ACCELERATION else _high_pass)(sample_rate_hz)
        self._to_displacement = (_high_pass if role is Role.M0_DISPLACEMENT else _integrator)(sample_rate_hz)

    def follow(self, mass: Samples, base: BaseMotion, is_blind: NDArray[np.bool_]) -> Samples:
        """Return the displacement of m0 relative to the base [m] for the next samples of its sensor.

        Where the sensor exceeds its range (``is_blind``), the relative motion is taken to be zero.
        """
        moved = self._to_velocity.run(np.where(is_blind, 0.0, mass))
        if self._role is Role.M0_DISPLACEMENT:
            return np.where(is_blind, 0.0, self._to_displacement.run(moved) - base.displacement)
        return self._to_displacement.run(np.where(is_blind, 0.0, moved - base.velocity))


RMS_S = 1.0
"""Averaging time for the rms current, whose limit is due to heating [s]."""
REACTION = 1.1
"""Allowed force on the table, relative to the coil's force limit; above 1 for the specimen's reaction."""
SETTLING_S = 0.5
"""Time after the start during which integrated quantities are not checked [s]. An AC-coupled input drifts
after its current is switched on, and the drift integrates to metres. During this time, the run plays only the
low level of its check. Measured quantities are checked from the first sample."""
_OFF = "The run was ramped down, and its recording was kept; lower amplitude_vpp"


@dataclass(frozen=True)
class _MonitoredQuantity:
    """Values of one quantity over a block of samples, with the limit of the quantity."""

    role: Role
    """Channel from which the quantity is computed."""
    what: str
    values: Samples
    rated: Sourced
    """Limit of the rig for this quantity."""
    share: float
    """Fraction of this limit that the plan allows."""
    unit: str


class LimitMonitor:
    """Monitor of the limits, which raises an error when the run must end.

    The monitor is part of the loop that reads samples. It depends neither on the graphical window nor on
    other processes. Blocks must be consecutive; after a gap, the monitor restarts.
    """

    def __init__(
        self, rig: Rig, channels: tuple[Channel, ...], limits: InRunLimits, sample_rate_hz: float
    ) -> None:
        self._rig = rig
        self._channels = channels
        self._limits = limits
        self._rate_hz = sample_rate_hz
        self._next_sample = 0
        self._change: LimitExceeded | None = None
        self._response = rig.response or Role.M0_VELOCITY
        self._begin(0)

    def require_safe(self, block: Block) -> None:
        """Raise LimitExceeded, with a `LimitTrip`, when a block exceeds a limit; the run then ramps down."""
        if not block.volts.shape[1]:
            return
        if block.first_sample != self._next_sample:
            self._begin(block.first_sample)
        self._next_sample = block.first_sample + block.volts.shape[1]
        for monitored in self._monitored_quantities(block):
            self._require(monitored, block.first_sample)
        if self._change is not None:
            raise self._change
        if block.overloads and self._limits.on_overload is OnOverload.STOP:
            raise self._overload_error(block, block.overloads[0])

    def note_change(self, text: str, sample: int) -> None:
        """Register a change of the specimen; if the plan says stop, the next block raises LimitExceeded."""
        if self._limits.on_changed_specimen is OnChange.STOP and self._change is None:
            trip = self._trip(self._response, "change of the specimen", 1.0, 0.0, "1", sample)
            self._change = LimitExceeded(
                f"{text.rstrip('.')}. The run was ramped down, and its recording was kept, as "
                "on_changed_specimen requires; check the specimen; if the change is intended, set a new "
                "baseline with 'vibench twin --new-baseline'",
                trip,
            )

    def _begin(self, first_sample: int) -> None:
        self._settled_sample = first_sample + round(SETTLING_S * self._rate_hz)
        self._base = BaseTracker(self._rate_hz)
        self._specimen = SpecimenTracker(self._rate_hz, self._response)
        self._mean_square_a2 = 0.0

    def _monitored_quantities(self, block: Block) -> Iterator[_MonitoredQuantity]:
        """Yield all quantities that have limits, the measured ones first."""
        rows = {
            channel.role: volts * channel.units_per_volt
            for channel, volts in zip(self._channels, block.volts, strict=True)
        }
        acceleration, voltage = rows.get(Role.BASE_ACCELERATION), rows.get(Role.AMPLIFIER_VOLTAGE)
        still = BaseMotion(np.zeros(block.volts.shape[1]), np.zeros(block.volts.shape[1]))
        base = still if acceleration is None else self._base.follow(acceleration)
        is_settled = block.first_sample >= self._settled_sample
        if acceleration is not None:
            limit, share = self._rig.shaker.limits.acceleration_m_per_s2, self._limits.base_acceleration
            what = "the base acceleration"
            yield _MonitoredQuantity(Role.BASE_ACCELERATION, what, acceleration, limit, share, "m/s2")
        if voltage is not None:
            yield from self._at_the_amplifier(voltage, base if is_settled else still)
        integrated = [] if acceleration is None else [*self._at_the_base(acceleration, base)]
        if self._response in rows:
            integrated.append(self._in_the_specimen(rows[self._response], base, block))
        if is_settled:
            yield from integrated

    def _at_the_base(self, acceleration: Samples, base: BaseMotion) -> Iterator[_MonitoredQuantity]:
        """Yield the motion of the base, and the force on the table: inertia force plus suspension force."""
        shaker, share, role = self._rig.shaker, self._limits, Role.BASE_ACCELERATION
        limits = shaker.limits
        forces = (
            suspended_mass_kg(shaker) * acceleration
            + shaker.suspension_damping_ns_per_m * base.velocity
            + shaker.suspension_stiffness_n_per_m * base.displacement
        )
        rated = Sourced(
            value=REACTION * limits.force_n.value, source=f"{REACTION:g} times: {limits.force_n.source}"
        )
        for what, values, limit, fraction, unit in (
            ("the base velocity", base.velocity, limits.velocity_m_per_s, share.base_velocity, "m/s"),
            ("the stroke", base.displacement, limits.stroke_m, share.stroke, "m"),
            ("the force on the table", forces, rated, share.force, "N"),
        ):
            yield _MonitoredQuantity(role, what, values, limit, fraction, unit)

    def _at_the_amplifier(self, voltage: Samples, base: BaseMotion) -> Iterator[_MonitoredQuantity]:
        rig, share, shaker = self._rig, self._limits, self._rig.shaker
        clip = Sourced(value=rig.amplifier.clip_v, source=f"clipping of the {rig.amplifier.model}")
        # Neglecting the inductance of the coil overestimates the current by 3 % at 1 kHz.
        current = (voltage - shaker.force_constant_n_per_a * base.velocity) / shaker.coil_resistance_ohm
        force = shaker.force_constant_n_per_a * current
        newest = 1 - exp(-current.size / self._rate_hz / RMS_S)
        self._mean_square_a2 += newest * (float(np.mean(current**2)) - self._mean_square_a2)
        rms = np.full(1, sqrt(self._mean_square_a2))
        for what, values, limit, fraction, unit in (
            ("the amplifier voltage", voltage, clip, share.amplifier_voltage, "V"),
            ("the coil current", current, shaker.limits.current_a, share.current, "A"),
            ("the coil's force", force, shaker.limits.force_n, share.force, "N"),
            ("the coil current (rms)", rms, rig.amplifier.current_limit_a, share.current, "A"),
        ):
            yield _MonitoredQuantity(Role.AMPLIFIER_VOLTAGE, what, values, limit, fraction, unit)

    def _in_the_specimen(self, moved: Samples, base: BaseMotion, block: Block) -> _MonitoredQuantity:
        is_blind = np.zeros(block.volts.shape[1], dtype=np.bool_)
        for overload in block.overloads:
            if overload.channel == self._response.value:
                first = max(overload.first_sample - block.first_sample, 0)
                is_blind[first : max(overload.last_sample - block.first_sample + 1, 0)] = True
        stretched = self._specimen.follow(moved, base, is_blind)
        limit, share = self._rig.specimen.amplitude_limit_m, self._limits.specimen_amplitude
        return _MonitoredQuantity(self._response, "the specimen's amplitude", stretched, limit, share, "m")

    def _require(self, monitored: _MonitoredQuantity, first_sample: int) -> None:
        peak, limit = float(np.max(np.abs(monitored.values))), monitored.share * monitored.rated.value
        if peak <= limit:
            return
        sample = first_sample + int(np.argmax(np.abs(monitored.values) > limit))
        quantity = monitored.what.removeprefix("the ")
        trip = self._trip(monitored.role, quantity, peak, limit, monitored.unit, sample)
        raise LimitExceeded(
            f"{monitored.what} reached {peak:.4g} {monitored.unit}, above the limit of {limit:.4g} "
            f"{monitored.unit} ({monitored.rated.source}), on {monitored.role.value} at {trip.time_s:.4f} s "
            f"(sample {sample}). {_OFF}",
            trip,
        )

    def _trip(
        self, role: Role, quantity: str, value: float, limit: float, unit: str, sample: int
    ) -> LimitTrip:
        return LimitTrip(role.value, quantity, value, limit, unit, sample, sample / self._rate_hz)

    def _overload_error(self, block: Block, overload: Overload) -> LimitExceeded:
        roles = [channel.role.value for channel in self._channels]
        channel = self._channels[roles.index(overload.channel)]
        volts = block.volts[roles.index(overload.channel)]
        is_sensor = channel.full_scale_v < channel.range_v
        what = f"range of the {channel.sensor}" if is_sensor else f"range of {channel.physical}"
        scale = abs(channel.units_per_volt)
        value, limit = scale * float(np.max(np.abs(volts))), scale * channel.full_scale_v
        trip = self._trip(channel.role, what, value, limit, channel.unit, overload.first_sample)
        return LimitExceeded(
            f"{overload.channel} was overloaded at sample {overload.first_sample} ({trip.time_s:.4f} s): it "
            f"reached {trip.value:.4g} {trip.unit}; the {what} is {trip.limit:.4g} {trip.unit}. The run was "
            "ramped down, and its recording was kept; widen the range or lower amplitude_vpp",
            trip,
        )
