"""A measurement as a sequence of phases, each with a state, a signal and a duration."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum
from itertools import takewhile
from math import ceil, cos, pi
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, PositiveFloat, PositiveInt, model_validator

from vibench.sim import NumberWith

from ..errors import ConfigurationError
from ..excitation.kinds import Excitation
from ..excitation.plan import AbstractFeedback
from ..excitation.steps import LoopTone, Play, Segment, Step, Stream, Tone, Waveform
from ..host.toml_file import FrozenModel
from ..instruments import Sweep
from ..recording import SegmentLabel
from ..rig import OutputUse, Rig, Role, generator_driver

# The longer the delay of the feedback, the fewer unstable motions can be held (decision 0065).

LOOK_S = 0.2
"""Averaging time of one measurement by the feedback loop [s]; longer if ten periods last longer."""
LOOK_PERIODS = 10
_COMMANDS = 2
"""Number of generator commands per change of the drive: amplitude and frequency."""


def look_s(frequency_hz: float) -> float:
    """Return the averaging time of one measurement by the feedback loop [s]."""
    return max(LOOK_S, LOOK_PERIODS / frequency_hz)


def loop_time_s(rig: Rig, frequency_hz: float) -> float:
    """Return the delay from a motion to the corrected drive, due to averaging and generator commands [s]."""
    return look_s(frequency_hz) + _COMMANDS * rig.generator.settle_s


FEWEST_REALISATIONS = 4
"""Number of realisations before the first analysis; fewer would not suffice to estimate the scatter."""
SHORTEST_S = 2.0
"""Default time before the first analysis [s]; a shorter recording is analysed only at its end."""
LOOK_FACTOR = 2.0**0.5
"""Ratio of the recorded time at one analysis to the recorded time at the previous analysis."""


Wish = Annotated[float, Field(gt=0, lt=1), NumberWith("%")]
"""Required accuracy of a result: half the width of the result's 95 % interval, relative to the result."""


class Until(FrozenModel):
    """Record until the bound on the error of every result named here is small enough.

    The planned time is never exceeded. The bounds hold in 95 % of recordings, including those that end early.
    They include noise and scatter, which a longer recording reduces, but no calibration uncertainty.
    """

    resonance_hz: Wish | None = None
    """Required uncertainty of the frequency of every resonance under noise excitation: ``"0.1 %"``."""
    transmissibility: Wish | None = None
    """Required error bound of the transmissibility at every resonance found in noise: ``"2 %"``."""
    response_i: Wish | None = None
    """Required error bound of Response I of a dwell or of each step: ``"1 %"``."""
    response_ii: Wish | None = None
    """Required error bound of Response II of a dwell or of each step: ``"1 %"``."""
    shortest_s: PositiveFloat = SHORTEST_S
    """Recorded time before the first analysis of a dwell, a step or streamed noise [s]; at most the planned
    time."""

    @model_validator(mode="after")
    def _wants_something(self) -> "Until":
        if not self.required_bounds:
            raise ValueError("'until' names no result; give a result, such as response_i = '1 %'")
        return self

    @property
    def required_bounds(self) -> dict[str, float]:
        """Required relative bounds by name of the result."""
        return {name: wish for name in WISHES if (wish := getattr(self, name)) is not None}


WISHES = ("resonance_hz", "transmissibility", "response_i", "response_ii")
"""Names of the results that `Until` may require."""


# A measurement is a plan: excitation, ramps and limits during the run. A campaign's point is one recording.

_NAME = r"^[A-Za-z0-9][A-Za-z0-9_-]{0,63}$"


def _is_of_a_file(value: object) -> object:
    if isinstance(value, str) and re.search(_NAME, value) is None:
        raise ValueError("a file name has 1 to 64 letters, digits, _ or -, and starts with a letter or digit")
    return value


Name = Annotated[str, Field(pattern=_NAME), BeforeValidator(_is_of_a_file)]
"""Name that is part of a file name: at most 64 letters, digits, ``_`` and ``-``."""

LONGEST_S = 30 * 86400.0
"""Longest duration of one recording: 30 days [s]."""
Fraction = Annotated[float, Field(gt=0, le=1)]

FEWEST_STAIRS = 4
"""Smallest number of steps (stairs) in a ramp; with fewer steps, the ramp would act as one large step."""


class OnOverload(StrEnum):
    """What the run does when an input or the vibrometer reaches 95 % of its range."""

    FLAG = "flag"
    """Mark the samples in the recording and continue; nothing is damaged, and the analysis omits them."""
    STOP = "stop"
    """Ramp down and end the run."""


class OnChange(StrEnum):
    """What the run does when the live twin finds a change of the specimen."""

    NOTE = "note"
    """Note the change as an event in the recording and continue."""
    STOP = "stop"
    """Ramp down and end the run. The live twin is started if necessary."""


class InRunLimits(FrozenModel):
    """Limits during a measurement, as fractions of the limits of the rig."""

    base_acceleration: Fraction = 1.0
    """Fraction of the shaker's acceleration limit; the acceleration is measured at the base."""
    base_velocity: Fraction = 1.0
    """Fraction of the shaker's velocity limit; the velocity is integrated from the base acceleration."""
    stroke: Fraction = 1.0
    """Fraction of the shaker's stroke limit; the stroke is integrated twice from the base acceleration."""
    force: Fraction = 1.0
    """Fraction of the shaker's force limit, for the force of the coil (from its current) and the force on
    the table."""
    amplifier_voltage: Fraction = 1.0
    """Fraction of the amplifier's clipping voltage, measured at its output."""
    current: Fraction = 1.0
    """Fraction of the coil's peak current limit and of the amplifier's rms limiter. The current is computed
    as amplifier voltage minus induced voltage of the moving coil, divided by the coil's resistance."""
    specimen_amplitude: Fraction = 1.0
    """Fraction of the specimen's amplitude limit: motion of m0 relative to the base, from its sensor."""
    on_overload: OnOverload = OnOverload.FLAG
    on_changed_specimen: OnChange = OnChange.NOTE


class ScanPoint(FrozenModel):
    """Point on the specimen at which the vibrometer's beam measures."""

    name: Name
    """Name of the point; this name is appended to the names of the point's recordings."""
    body: Literal["m0", "m1", "m2"]
    """Mass on which the point lies."""
    node: PositiveInt | None = Field(default=None, le=999_999_999)
    """Node number in universal files; if absent, the position of the point in the list, from 1."""
    x_m: float
    """Coordinate of the point along x [m]."""
    y_m: float
    """Coordinate of the point along y [m]."""
    z_m: float
    """Coordinate of the point along z [m]."""
    direction: Literal["x", "y", "z", "-x", "-y", "-z"] = "z"
    """Direction of motion in which the velocity counts as positive."""

    @property
    def role(self) -> Role:
        """Channel that records the vibrometer at this point."""
        return Role(f"{self.body}_velocity")

    @property
    def text(self) -> str:
        """Description of the point: name, mass and coordinates."""
        return f"{self.name} on {self.body} (x {self.x_m:g}, y {self.y_m:g}, z {self.z_m:g} m)"


class Measurement(FrozenModel):
    """One excitation, from ramp up to ramp down, recorded in one file."""

    name: Name
    excitation: Excitation
    ramp_s: PositiveFloat = Field(default=1.0, le=60)
    """Duration of the half-cosine ramp from silence to full amplitude, and of the ramp down [s]."""
    ramp_step_s: PositiveFloat = 0.05
    """Duration of one step of a ramp, which is a staircase of amplitude settings [s]."""
    repeats: PositiveInt = Field(default=1, le=1000)
    """Number of recordings that a campaign makes of this measurement."""
    limits: InRunLimits = InRunLimits()
    notes: str = ""
    until: Until | None = None
    """Accuracy of the results at which the recording ends; if absent, the planned time is recorded."""
    point: ScanPoint | None = None
    """Point of a scan at which the vibrometer measures; if absent, m0."""

    @model_validator(mode="after")
    def _until_fits(self) -> Self:
        if self.until is None:
            return self
        allowed = () if isinstance(self.excitation, AbstractFeedback) else self.excitation.wishes
        if unknown := [name for name in self.until.required_bounds if name not in allowed]:
            known = f"give {' or '.join(allowed)}" if allowed else "leave 'until' out"
            raise ValueError(
                f"'until' contains {unknown[0]}, which {self.excitation.kind} does not support; {known}"
            )
        longest_s = max(each.record_s for each in self.excitation.steps())
        if self.excitation.period_points is None and self.until.shortest_s > max(longest_s, SHORTEST_S):
            raise ValueError(
                f"until.shortest_s = {self.until.shortest_s:g} is longer than the recording of "
                f"{longest_s:g} s; lower shortest_s, or record for longer"
            )
        return self

    @model_validator(mode="after")
    def _ramp_has_stairs(self) -> Self:
        if self.ramp_step_s * FEWEST_STAIRS > self.ramp_s * (1 + 1e-9):
            raise ValueError(
                f"ramp_step_s = {self.ramp_step_s:g} gives fewer than {FEWEST_STAIRS} steps in a ramp of "
                f"{self.ramp_s:g} s; give at most {self.ramp_s / FEWEST_STAIRS:g} s"
            )
        return self

    @model_validator(mode="after")
    def _ends_within_a_month(self) -> Self:
        length_s = self.excitation.playing_s
        if length_s > LONGEST_S:
            raise ValueError(
                f"one measurement would play for {length_s:.4g} s (at most {LONGEST_S:g} s, 30 days); "
                "shorten it, or divide it into several measurements"
            )
        return self


@dataclass(frozen=True)
class Point:
    """One recording of a campaign."""

    name: str
    """Name of the recording, without ``.h5``; unique in the campaign."""
    measurement: Measurement
    chain: str = ""
    """Name of the chain (a series of points on one branch) to which the point belongs; empty if none."""


class RunState(StrEnum):
    """State of a run.

    ::

        idle -> checking -> armed -> ramping_up -> settling -> recording -> ramping_down -> finished
                    |          |          ^            (next waveform)           |
                    |          |          +--------------------------------------+
                    |          |     (held: any of these stays as it is for a while)
                    |          +-> ramping_down -> stopped    (asked to stop)
                    +-> failed <- from every state            (limit, check, driver, disk)

    From ``armed`` to ``ramping_down`` the generator's output may be on; in every other state it is off,
    except for the low-level part of ``checking``.
    """

    IDLE = "idle"
    CHECKING = "checking"
    ARMED = "armed"
    RAMPING_UP = "ramping_up"
    SETTLING = "settling"
    RECORDING = "recording"
    HELD = "held"
    RAMPING_DOWN = "ramping_down"
    FINISHED = "finished"
    STOPPED = "stopped"
    FAILED = "failed"


CHECK_FREQUENCY_HZ = 160.0
"""Frequency of the check's sine, near that of accelerometer calibrations (159.2 Hz, ISO 16063-21)."""
CHECK_FRACTION = 0.02
"""Amplitude of the bench check relative to the planned amplitude."""
CHECK_LOWEST_VPP = 0.01
"""Smallest setting of a check, above the hum [Vpp]; if a plan has a lower setting, that setting is used."""
CHECK_QUIET_S = 0.1
"""Duration of the silence that a check measures before the first signal [s]."""
CHECK_SETTLE_S = 0.2
CHECK_LISTEN_S = 0.3
"""Measuring time of the check's sine: 48 periods [s]."""
HUSH_S = 1.0
"""Silence before the first ramp of a measurement with feedback, to measure noise [s]."""
CHECK_S = CHECK_QUIET_S + CHECK_SETTLE_S + CHECK_LISTEN_S


@dataclass(frozen=True)
class Phase:
    """Part of a run, with one state and one signal."""

    state: RunState
    play: Play | None
    """Signal that is played in this phase; None for silence."""
    duration_s: float
    segment: Segment | None = None
    """Segment of the recording to which this phase belongs."""

    @property
    def end_level(self) -> float:
        """Level at the end of the phase, from 0 (silent) to 1 (as planned); only ramps change the level."""
        return 0.0 if self.play is None or self.state is RunState.RAMPING_DOWN else 1.0


def phases(measurement: Measurement) -> Iterator[Phase]:
    """Yield the phases from the first ramp up to the last ramp down, without the bench check.

    The waveform changes in silence, between a ramp down and a ramp up. The frequency changes without a ramp,
    with continuous phase.
    """
    previous: Step | None = None
    for step in measurement.excitation.steps():
        if previous is None or not _follows_without_a_jump(previous.play, step.play):
            if previous is not None:
                yield ramp(RunState.RAMPING_DOWN, previous.play, measurement)
            yield ramp(RunState.RAMPING_UP, step.play, measurement)
        if step.settle_s > 0:
            yield Phase(RunState.SETTLING, step.play, step.settle_s)
        yield Phase(RunState.RECORDING, step.play, step.record_s, step.segment)
        previous = step
    if previous is not None:
        yield ramp(RunState.RAMPING_DOWN, previous.play, measurement)


def known_phases(measurement: Measurement) -> Iterator[Phase]:
    """Yield the phases known before the measurement: all of them, or none for a measurement with feedback."""
    return iter(()) if isinstance(measurement.excitation, AbstractFeedback) else phases(measurement)


def _follows_without_a_jump(before: Play, after: Play) -> bool:
    return before is after or (isinstance(before, Tone) and isinstance(after, Tone))


def ramp(state: RunState, play: Play, measurement: Measurement) -> Phase:
    """Return the phase of one ramp up or down (``state``) of the signal ``play``, with the planned length."""
    return Phase(state, play, measurement.ramp_s, Segment(_RAMP_LABELS[state]))


_RAMP_LABELS = {
    RunState.RAMPING_UP: SegmentLabel.RAMP_UP,
    RunState.RAMPING_DOWN: SegmentLabel.RAMP_DOWN,
}


def duration_s(measurement: Measurement) -> float:
    """Return the time from the first ramp up to the last ramp down, without the bench check [s].

    With feedback, this is the longest time that the measurement may take.
    """
    excitation = measurement.excitation
    hush_s = HUSH_S if isinstance(excitation, AbstractFeedback) else 0.0
    return hush_s + 2 * measurement.ramp_s * excitation.stretches + excitation.playing_s


def lead_in_s(measurement: Measurement) -> float:
    """Return the time before the first sample with results: bench check, ramp and settling [s].

    With feedback, this time ends with the ramp, because settling is part of the measurement.
    """
    if isinstance(measurement.excitation, AbstractFeedback):
        return CHECK_S + HUSH_S + measurement.ramp_s
    counting = measurement.excitation.result_labels

    def leads_in(phase: Phase) -> bool:
        return phase.segment is None or phase.segment.label not in counting

    return CHECK_S + sum(phase.duration_s for phase in takewhile(leads_in, phases(measurement)))


def measuring_s(measurement: Measurement) -> float:
    """Return the longest possible duration of a measurement, including its bench check [s]."""
    return CHECK_S + duration_s(measurement)


def stairs(measurement: Measurement) -> int:
    """Return the number of amplitude settings in one ramp."""
    return ceil(measurement.ramp_s / measurement.ramp_step_s * (1 - 1e-9))


def half_cosine(progress: float) -> float:
    """Return the level of a half-cosine ramp [0 to 1] at ``progress`` [0 to 1]."""
    return 0.5 * (1 - cos(pi * progress))


class DriveSource(StrEnum):
    """Source of the amplifier's input signal: generator, analogue output or real-time controller."""

    GENERATOR = "function generator"
    OUTPUT = "analogue output"
    CONTROLLER = "real-time controller"


def drive_source_of(measurement: Measurement, rig: Rig) -> DriveSource:
    """Return the source that plays a measurement; an analogue output is returned even if the rig has none."""
    use = OutputUse.STREAMS if rig.daq.output is None else rig.daq.output.plays
    drive_sources = {_source_of(step.play, use) for step in measurement.excitation.steps()}
    others = (DriveSource.CONTROLLER, DriveSource.OUTPUT)
    return next((each for each in others if each in drive_sources), DriveSource.GENERATOR)


def require_played(measurement: Measurement, rig: Rig) -> DriveSource:
    """Return the source that plays a measurement; raises ConfigurationError if the rig has no such source."""
    source = drive_source_of(measurement, rig)
    match source:
        case DriveSource.CONTROLLER if rig.controller is None:
            raise ConfigurationError(
                f"{measurement.name} needs a real-time controller, but this bench has none. Nothing was "
                "played; add [controller] to the hardware configuration"
            )
        case DriveSource.OUTPUT if rig.daq.output is None:
            raise ConfigurationError(
                f"{measurement.name} needs an analogue output, but this bench has none: its function "
                "generator repeats one waveform. Nothing was played; add [daq.output] to the hardware "
                "configuration, or use white_noise with more realisations"
            )
    return source


LEAST_SHARE = 1e-4
"""Ratio of smallest to largest setting of an analogue output; the smallest setting spans tens of counts."""


def lowest_setting_vpp(measurement: Measurement, rig: Rig) -> float:
    """Return the smallest amplitude setting of a measurement's source, peak to peak [V]."""
    if rig.controller is not None and drive_source_of(measurement, rig) is DriveSource.CONTROLLER:
        return LEAST_SHARE * 2 * rig.controller.limit_v
    output = rig.daq.output
    if output is not None and drive_source_of(measurement, rig) is DriveSource.OUTPUT:
        return LEAST_SHARE * 2 * output.limit_v / rig.generator.terminal_factor()
    return generator_driver(rig.generator).describe(rig.generator).amplitude_range_vpp[0]


def _source_of(play: Play, use: OutputUse) -> DriveSource:
    match play, use:
        case (LoopTone(), _):
            return DriveSource.CONTROLLER
        case (Stream(), _) | (Tone(), OutputUse.TONES_AND_STREAMS):
            return DriveSource.OUTPUT
        case (Tone() | Waveform() | Sweep(), _):
            return DriveSource.GENERATOR
