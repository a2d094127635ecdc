"""Predicted effect of a plan on the rig, compared with the limits of the rig; preview of a measurement."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from vibench.sim.branches import least_growth_time_s

from ..errors import ConfigurationError, LimitExceeded
from ..excitation.kinds import EXCITATION_KINDS, Excitation
from ..excitation.plan import AbstractExcitation, SignalPreview
from ..excitation.steps import Segment, Tone
from ..host.printable import leading
from ..instruments import Samples
from ..recording import SegmentLabel, open_recording
from ..rig import (
    LARGEST_LEVEL_ERROR,
    RESPONSE_ROLES,
    BaseQuantity,
    ComplexArray,
    OutputConfig,
    Rig,
    RigModel,
    Role,
    channels_of,
    generator_driver,
    highest_carried_hz,
    suspended_mass_kg,
)
from ._campaign import BYTES_PER_SAMPLE
from ._loads import Loads, needed_vpp, predicted_loads
from ._schedule import (
    CHECK_FRACTION,
    CHECK_FREQUENCY_HZ,
    CHECK_LISTEN_S,
    CHECK_LOWEST_VPP,
    CHECK_QUIET_S,
    CHECK_SETTLE_S,
    DriveSource,
    Measurement,
    OnOverload,
    Phase,
    RunState,
    drive_source_of,
    duration_s,
    loop_time_s,
    lowest_setting_vpp,
)

_PLAYED = {"excitation", "ramp_s", "ramp_step_s"}
"""Fields of a plan that determine which signals are recorded."""


def require_own_plan(measurement: Measurement, rig: Rig) -> None:
    """Refuse to play back a recording with a plan other than the one in the recording.

    Raises ConfigurationError. Imported recordings and plans of another version are not checked.
    """
    path = rig.daq.options.get("recording")
    if not rig.plays_back or not isinstance(path, str):
        return
    with open_recording(Path(path)) as recording:
        try:
            made = Measurement.model_validate(dict(recording.plan))
        except ValidationError:
            return
    if made.model_dump(include=_PLAYED) != measurement.model_dump(include=_PLAYED):
        raise ConfigurationError(
            f"{path} was recorded with the plan {made.name!r} ({made.excitation.kind}), which differs from "
            f"the plan {measurement.name!r}. Nothing was played back; give the plan of the recording"
        )


RAMP_PERIODS = 3.0
"""Smallest length of a ramp, in periods of the shaker on its suspension; shorter ramps act like steps."""
USABLE_BANDWIDTH = 0.45
"""Usable bandwidth of a converter with an anti-alias filter, relative to the sample rate (NI 9234: 0.45)."""


class LimitSide(StrEnum):
    """Whether a limit is an upper or a lower bound of the allowed values."""

    AT_MOST = "at most"
    AT_LEAST = "at least"


class Consequence(StrEnum):
    """What the program does if a plan would exceed a limit."""

    REFUSED = "refused"
    """The plan is not played."""
    TOLD = "told"
    """The plan is played. The excess is reported beforehand, and marked in the recording if it occurs."""


_DIGITS = 6
"""Number of digits of values and limits in messages, enough to distinguish 8200 from 8192 points."""


@dataclass(frozen=True)
class LimitCheck:
    """A predicted value and its limit."""

    what: str
    value: float
    limit: float
    unit: str
    source: str
    """Source of the limit, such as a data sheet."""
    remedy: str
    """Advice on what to change when the limit is exceeded."""
    side: LimitSide = LimitSide.AT_MOST
    consequence: Consequence = Consequence.REFUSED
    load: BaseQuantity | None = None
    """Quantity of rig or specimen whose predicted peak is `value`; None for other checks."""

    @property
    def use(self) -> float:
        """Used fraction of the limit; if it is above 1, the limit is exceeded."""
        if self.side is LimitSide.AT_LEAST:
            return self.limit / self.value
        return self.value / self.limit if self.limit else math.inf

    @property
    def forbids(self) -> bool:
        """Whether this check forbids playing the plan."""
        return not self.is_kept and self.consequence is Consequence.REFUSED

    @property
    def is_kept(self) -> bool:
        """Whether the value is within the limit, except for rounding errors."""
        return self.use <= 1 + 1e-9

    def complaint(self) -> str:
        """Return a clause that describes the violation of the limit and its remedy."""
        return (
            f"{self.what} would be {self.value:.{_DIGITS}g} {self.unit}, but must be {self.side.value} "
            f"{self.limit:.{_DIGITS}g} {self.unit} ({self.source}): {self.remedy}"
        )


def limit_checks(measurement: Measurement, rig: Rig) -> tuple[LimitCheck, ...]:
    """Return every setting and predicted load of ``measurement`` with its limit on ``rig``."""
    loads = predicted_loads(measurement.excitation, rig)
    return (
        *_settings(measurement, rig),
        *_loads(rig, loads),
        *_inputs(measurement, rig, loads),
    )


def require_within_limits(measurement: Measurement, rig: Rig) -> tuple[LimitCheck, ...]:
    """Refuse a measurement that would exceed a limit of the rig; otherwise return all limit checks.

    Raises
    ------
    LimitExceeded
        Names the largest violations with value, limit, source and remedy. Nothing has been played.
    ConfigurationError
        When the rig plays back a recording that was made with another plan.
    """
    require_own_plan(measurement, rig)
    checks = limit_checks(measurement, rig)
    violations = sorted((check for check in checks if check.forbids), key=lambda each: -each.use)
    if violations:
        texts = "; ".join(leading([each.complaint() for each in violations]))
        raise LimitExceeded(f"{measurement.name}: {texts}. Nothing was played.")
    return checks


def shortest_ramp_s(rig: Rig) -> float:
    """Return the shortest allowed ramp duration: three periods of the loaded shaker on its suspension [s]."""
    shaker = rig.shaker
    resonance = np.sqrt(shaker.suspension_stiffness_n_per_m / suspended_mass_kg(shaker)) / (2 * np.pi)
    return float(RAMP_PERIODS / resonance)


def _settings(measurement: Measurement, rig: Rig) -> Iterator[LimitCheck]:
    excitation = measurement.excitation
    yield LimitCheck(
        "the generator voltage",
        excitation.highest_amplitude_vpp,
        rig.generator.amplitude_limit_vpp,
        "Vpp",
        "amplitude_limit_vpp of the hardware configuration",
        "lower amplitude_vpp",
    )
    source = drive_source_of(measurement, rig)
    yield LimitCheck(
        "the lowest setting",
        excitation.lowest_amplitude_vpp,
        lowest_setting_vpp(measurement, rig),
        "Vpp",
        f"smallest setting of the {source.value}",
        "raise amplitude_vpp, or narrow the band",
        LimitSide.AT_LEAST,
    )
    if source is DriveSource.GENERATOR:
        yield from _generating(excitation, rig)
    if source is DriveSource.CONTROLLER and rig.controller is not None:
        yield LimitCheck(
            "the real-time controller's output (peak)",
            0.5 * excitation.highest_amplitude_vpp,
            rig.controller.limit_v,
            "V",
            rig.controller.source,
            "lower amplitude_vpp",
        )
    yield from _held_levels(measurement, rig)
    yield LimitCheck(
        "the highest frequency",
        excitation.highest_frequency_hz,
        USABLE_BANDWIDTH * rig.daq.sample_rate_hz,
        "Hz",
        f"{USABLE_BANDWIDTH:g} of the sample rate",
        "lower the frequency or raise sample_rate_hz",
    )
    carried_hz = None if rig.virtual is None else highest_carried_hz(rig.virtual.grid_rate_hz)
    if carried_hz is not None:
        yield LimitCheck(
            "the highest frequency on the virtual rig's coarse grid",
            excitation.highest_frequency_hz,
            carried_hz,
            "Hz",
            f"at this limit, levels are {LARGEST_LEVEL_ERROR:.0%} too low",
            "lower the frequency or raise virtual.grid_rate_hz",
        )
    if rig.daq.output is not None and source is DriveSource.OUTPUT:
        yield from _streaming(measurement, rig, rig.daq.output)
    yield LimitCheck(
        "the ramp",
        measurement.ramp_s,
        shortest_ramp_s(rig),
        "s",
        f"{RAMP_PERIODS:g} periods of the shaker's suspension resonance",
        "lengthen ramp_s",
        LimitSide.AT_LEAST,
    )


def _generating(excitation: AbstractExcitation, rig: Rig) -> Iterator[LimitCheck]:
    can = generator_driver(rig.generator).describe(rig.generator)
    setting = "the highest amplitude setting of the generator"
    most_vpp, range_of = can.amplitude_range_vpp[1], f"range of the {can.name}"
    yield LimitCheck(
        setting, excitation.highest_amplitude_vpp, most_vpp, "Vpp", range_of, "lower amplitude_vpp"
    )
    highest = "the highest frequency of the generator"
    yield LimitCheck(
        highest, excitation.highest_frequency_hz, can.highest_sine_hz, "Hz", range_of, "lower the frequency"
    )
    if excitation.own_sweep_s is not None:
        sweep, longest = "the generator's own sweep", f"longest sweep of the {can.name}"
        remedy = 'set swept_by = "computer"'
        yield LimitCheck(sweep, excitation.own_sweep_s, can.longest_sweep_s, "s", longest, remedy)
    if excitation.period_points is not None:
        fewest, most = can.memory_points
        memory = f"memory of the {can.name}"
        for what, limit, remedy, side in (
            ("points of a period", most, "lower points", LimitSide.AT_MOST),
            ("smallest number of points", fewest, "raise points", LimitSide.AT_LEAST),
        ):
            yield LimitCheck(what, excitation.period_points, limit, "points", memory, remedy, side)


def _held_levels(measurement: Measurement, rig: Rig) -> Iterator[LimitCheck]:
    """Check that the setting needed to hold the base level does not exceed `amplitude_vpp` of the plan."""
    needed = [
        (needed_vpp(rig, acceleration, frequency_hz), frequency_hz)
        for frequency_hz, acceleration in measurement.excitation.held_accelerations()
    ]
    if needed:
        most_vpp, at_hz = max(needed)
        yield LimitCheck(
            f"the amplitude setting needed to hold the base's level (at {at_hz:g} Hz)",
            most_vpp,
            measurement.excitation.amplitude_vpp,
            "Vpp",
            "amplitude_vpp of the plan, the largest that feedback may use",
            "raise amplitude_vpp or lower the level",
        )


def _streaming(measurement: Measurement, rig: Rig, output: OutputConfig) -> Iterator[LimitCheck]:
    excitation = measurement.excitation
    yield LimitCheck(
        "the analogue output's voltage (peak)",
        0.5 * excitation.highest_amplitude_vpp * rig.generator.terminal_factor(),
        output.limit_v,
        "V",
        output.source,
        "lower amplitude_vpp",
    )
    yield LimitCheck(
        "the highest frequency of the analogue output",
        excitation.highest_frequency_hz,
        USABLE_BANDWIDTH * output.sample_rate_hz,
        "Hz",
        f"{USABLE_BANDWIDTH:g} of the output's sample rate",
        "lower the frequency or raise daq.output.sample_rate_hz",
    )


def _loads(rig: Rig, loads: Loads) -> Iterator[LimitCheck]:
    limits = rig.shaker.limits
    less = "lower amplitude_vpp"
    gentler = "lower amplitude_vpp or raise the lowest frequency"
    for quantity, what, limit, unit, remedy in (
        (BaseQuantity.STROKE, "the stroke", limits.stroke_m, "m", gentler),
        (BaseQuantity.VELOCITY, "the table's velocity", limits.velocity_m_per_s, "m/s", gentler),
        (BaseQuantity.ACCELERATION, "the table's acceleration", limits.acceleration_m_per_s2, "m/s2", less),
        (BaseQuantity.FORCE, "the force", limits.force_n, "N", less),
        (BaseQuantity.CURRENT, "the coil current", limits.current_a, "A", less),
    ):
        load = loads[quantity]
        name = f"{what} ({load.cause}, peak)"
        yield LimitCheck(name, load.peak, limit.value, unit, limit.source, remedy, load=quantity)
    current, volts = loads[BaseQuantity.CURRENT], loads[BaseQuantity.AMPLIFIER_VOLTAGE]
    limiter = rig.amplifier.current_limit_a
    yield LimitCheck(
        f"the current ({current.cause}, rms)", current.rms, limiter.value, "A", limiter.source, less
    )
    clip = f"clipping of the {rig.amplifier.model}"
    name = f"the amplifier's voltage ({volts.cause}, peak)"
    yield LimitCheck(
        name, volts.peak, rig.amplifier.clip_v, "V", clip, "lower amplitude_vpp or the gain",
        load=BaseQuantity.AMPLIFIER_VOLTAGE,
    )  # fmt: skip
    amplitude = loads[BaseQuantity.AMPLITUDE]
    limit = rig.specimen.amplitude_limit_m
    name = f"the specimen's amplitude (estimated, {amplitude.cause})"
    remedy = "lower amplitude_vpp or avoid the resonance"
    yield LimitCheck(
        name, amplitude.peak, limit.value, "m", limit.source, remedy, load=BaseQuantity.AMPLITUDE
    )


def _inputs(measurement: Measurement, rig: Rig, loads: Loads) -> Iterator[LimitCheck]:
    """Compare the predicted signals with the ranges of the sensors and of the converter's inputs."""
    highest_vpp = measurement.excitation.highest_amplitude_vpp
    peaks = {
        Role.DRIVE_VOLTAGE: 0.5 * highest_vpp * rig.generator.terminal_factor(),
        Role.AMPLIFIER_VOLTAGE: loads[BaseQuantity.AMPLIFIER_VOLTAGE].peak,
        Role.BASE_ACCELERATION: loads[BaseQuantity.ACCELERATION].peak,
        Role.BASE_VELOCITY: loads[BaseQuantity.VELOCITY].peak,
        Role.BASE_DISPLACEMENT: loads[BaseQuantity.STROKE].peak,
        **{role: loads[BaseQuantity(role.value)].peak for role in RESPONSE_ROLES},
    }
    flagged = measurement.limits.on_overload is OnOverload.FLAG
    for channel in channels_of(rig):
        if channel.role not in peaks:
            continue
        what, consequence = (
            f"the {channel.role.value.replace('_', ' ')} at the converter",
            Consequence.REFUSED,
        )
        if channel.role in RESPONSE_ROLES:
            moved = loads[BaseQuantity(channel.role.value)]
            what = f"the {channel.quantity} of m0 (estimated, {moved.cause})"
            consequence = Consequence.TOLD if flagged else Consequence.REFUSED
        yield LimitCheck(
            what,
            peaks[channel.role],
            channel.full_scale_v * channel.units_per_volt,
            channel.unit,
            f"range of {channel.physical} and of its sensor",
            "lower amplitude_vpp or widen the range",
            consequence=consequence,
        )


TOUCH_SHARE = 0.25
"""Largest p in a check, relative to the gap: a sine without a ramp overshoots, and impacts might persist."""
_KNOWN_HZ: NDArray[np.float64] = np.linspace(0.97, 1.03, 25, dtype=np.float64) * CHECK_FREQUENCY_HZ
"""Frequencies within 3 % of the check's sine [Hz]; the model's resonances may be 3 % off (decision 0072)."""


def check_amplitude_vpp(wanted_vpp: float, rig: Rig) -> float:
    """Return the setting of a check [Vpp]: ``wanted_vpp``, or less to keep p within a quarter of the gap.

    The setting is not lowered below 10 mVpp. The model of ``rig`` includes the specimen on the table.
    """
    model = RigModel(rig)
    per_vpp = 0.5 * rig.generator.terminal_factor()
    p_m_per_vpp = per_vpp * float(np.max(np.abs(model.transfer(BaseQuantity.P, _KNOWN_HZ))))
    return min(wanted_vpp, max(TOUCH_SHARE * model.gap_m / p_m_per_vpp, CHECK_LOWEST_VPP))


def run_check_vpp(planned_vpp: float, rig: Rig) -> float:
    """Return the setting of the check before a run at ``planned_vpp``; never above that setting [Vpp]."""
    return min(planned_vpp, check_amplitude_vpp(max(CHECK_FRACTION * planned_vpp, CHECK_LOWEST_VPP), rig))


def check_phases(measurement: Measurement, rig: Rig) -> tuple[Phase, Phase, Phase]:
    """Return the phases of the check: measure the silence, let a small sine settle, and measure the sine."""
    planned_vpp = measurement.excitation.amplitude_vpp
    amplitude_vpp = run_check_vpp(planned_vpp, rig)
    tone = Tone(CHECK_FREQUENCY_HZ, amplitude_vpp / planned_vpp)
    segment = Segment(
        SegmentLabel.CHECK, {"frequency_hz": CHECK_FREQUENCY_HZ, "amplitude_vpp": amplitude_vpp}
    )
    return (
        Phase(RunState.CHECKING, None, CHECK_QUIET_S, segment),
        Phase(RunState.CHECKING, tone, CHECK_SETTLE_S, segment),
        Phase(RunState.CHECKING, tone, CHECK_LISTEN_S, segment),
    )


def check_phasors(
    rig: Rig, terminal_v: float, quantity: BaseQuantity = BaseQuantity.ACCELERATION
) -> ComplexArray:
    """Return the possible phasors of a quantity in a check, relative to the voltage's phase; shape (n,).

    Each phasor assumes a different shift of the specimen's resonances, up to 3 %. If p may come near a stop,
    phasors with m1 fixed to m2 are added. ``terminal_v`` is the peak voltage at the generator's terminal [V];
    the ``quantity`` of base or specimen is in SI units, such as m/s2 for an acceleration.
    """
    model = RigModel(rig)
    free = terminal_v * model.transfer(quantity, _KNOWN_HZ)
    p_m = terminal_v * np.abs(model.transfer(BaseQuantity.P, _KNOWN_HZ))
    if np.max(p_m) < 2 * TOUCH_SHARE * model.gap_m:
        return free
    return np.concatenate([free, terminal_v * model.stuck_transfer(quantity, _KNOWN_HZ)])


def nearest_expected(measured: float, expected: ComplexArray) -> float:
    """Return the ``measured`` amplitude, limited to the range of the ``expected`` phasors [m/s2]."""
    sizes = np.abs(expected)
    return float(np.clip(measured, np.min(sizes), np.max(sizes)))


MOST_SAMPLES = 1_000_000
"""Largest number of displayed samples of the signal; a long sweep is displayed at a lower sample rate."""
SPECTRUM_POINTS = 4000
_LOWEST_RATE = 2.1
"""Smallest number of displayed samples per period at the highest frequency."""


@dataclass(frozen=True, eq=False)
class MeasurementPreview:
    """Predictions for a measurement on a rig, made without using its instruments."""

    measurement: Measurement
    volts: Samples
    """Signal as set at the generator's panel, shape (samples,) [V]."""
    sample_rate_hz: float
    spectrum_hz: Samples
    """Frequency of the strongest spectral line in each of at most `SPECTRUM_POINTS` intervals [Hz]."""
    spectrum_v: Samples
    """Peak amplitude of the sine at each of ``spectrum_hz`` [V]."""
    rms_v: float
    peak_v: float
    checks: tuple[LimitCheck, ...]
    """Limit checks, sorted by the used fraction of the limit, the largest first."""
    duration_s: float
    """Duration from the start of the first ramp to the end of the last ramp [s]."""
    size_bytes: int
    """Size of the recording while it grows [bytes]."""
    least_growth_time_s: float | None
    """Shortest growth time (by a factor of e) of an unstable motion that feedback can hold [s], if known."""

    @property
    def is_allowed(self) -> bool:
        """Whether the limits of the rig allow the measurement."""
        return not any(check.forbids for check in self.checks)


def preview_signal(excitation: Excitation, rig: Rig) -> tuple[SignalPreview, float]:
    """Return the signal and its sample rate [Hz]; raises ConfigurationError when it cannot be sampled."""
    affordable = MOST_SAMPLES / max(excitation.playing_s, 1.0)
    rate_hz = max(min(rig.daq.sample_rate_hz, affordable), _LOWEST_RATE * excitation.highest_frequency_hz)
    return excitation.preview(rate_hz), rate_hz


def preview_measurement(measurement: Measurement, rig: Rig) -> MeasurementPreview:
    """Return the preview of a measurement; raises ConfigurationError when the signal cannot be sampled."""
    preview, rate_hz = preview_signal(measurement.excitation, rig)
    spectrum_hz, spectrum_v = _highest_lines(preview)
    length_s = duration_s(measurement)
    checks = sorted(limit_checks(measurement, rig), key=lambda check: check.use, reverse=True)
    return MeasurementPreview(
        measurement=measurement,
        volts=preview.volts.astype(np.float32),
        sample_rate_hz=rate_hz,
        spectrum_hz=spectrum_hz,
        spectrum_v=spectrum_v,
        rms_v=preview.rms_v,
        peak_v=preview.peak_v,
        checks=tuple(checks),
        duration_s=length_s,
        least_growth_time_s=_least_growth_time_s(measurement, rig),
        size_bytes=round(length_s * rig.daq.sample_rate_hz) * len(rig.daq.channels) * BYTES_PER_SAMPLE,
    )


def _least_growth_time_s(measurement: Measurement, rig: Rig) -> float | None:
    excitation = measurement.excitation
    if not EXCITATION_KINDS[excitation.kind].is_feedback:
        return None
    if drive_source_of(measurement, rig) is DriveSource.CONTROLLER:
        # Which motions a real-time loop can hold depends on gains and plant: `require_holdable`.
        return None
    return least_growth_time_s(loop_time_s(rig, excitation.band_hz[0]))


def _highest_lines(preview: SignalPreview) -> tuple[Samples, Samples]:
    """Return frequency and amplitude of the strongest spectral line of each logarithmic interval."""
    frequency_hz, amplitude_v = preview.frequency_hz[1:], preview.spectrum_v[1:]
    if len(frequency_hz) <= SPECTRUM_POINTS:
        return frequency_hz, amplitude_v
    edges = np.geomspace(frequency_hz[0], frequency_hz[-1], SPECTRUM_POINTS)
    starts = np.unique(np.searchsorted(frequency_hz, edges))
    ends = np.append(starts[1:], len(frequency_hz))
    lines = [int(first + np.argmax(amplitude_v[first:end])) for first, end in zip(starts, ends, strict=True)]
    return frequency_hz[lines], amplitude_v[lines]
