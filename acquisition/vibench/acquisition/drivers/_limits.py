"""Limits of generators, inputs and outputs, and checks of settings and samples before anything is sent.

This module does not need pyvisa, so plans can be checked without that library.
"""

from dataclasses import dataclass
from enum import StrEnum
from pkgutil import resolve_name
from typing import NamedTuple, Self, cast

import numpy as np
from numpy.typing import NDArray

from ..errors import ConfigurationError, InstrumentError, LimitExceeded
from ..instruments import FunctionGenerator, GeneratorDescription, Identity, Knob, Overload, Samples, Sweep
from ..rig import GeneratorConfig, GeneratorDriver


class Shape(StrEnum):
    """Shape of the signal that a driver plays; the value is its SCPI word on an AFG1022."""

    SINE = "SIN"
    EDIT_MEMORY = "EMEM"


class ArbitraryCodes(NamedTuple):
    """Codes of one period in the generator's memory, without DC and over the full range of codes.

    Code 0 plays minus half of the panel's peak-to-peak amplitude; the model's ``top_code`` plays plus half.
    """

    codes: NDArray[np.uint16]
    panel_factor: float
    """Ratio of panel amplitude to requested amplitude; 1 for a waveform without DC and with a peak of 1."""


@dataclass(frozen=True)
class GeneratorModel:
    """Limits of one generator model, and the class that drives it (``"module:Class"``)."""

    name: str
    driver: str
    open_range_vpp: tuple[float, float]
    """Smallest and largest amplitude with no load and no offset, peak to peak [V]."""
    lowest_hz: float
    highest_hz: dict[Shape, float]
    memory_points: tuple[int, int]
    top_code: int
    """Largest code in the waveform memory; the smallest code is 0."""
    burst_cycles: tuple[int, int]
    usb_ids: tuple[tuple[int, int], ...] = ()
    longest_sweep_s: float = 0.0
    """Longest internal sweep [s]; 0 if the sweep time cannot be set remotely."""

    def describe(self, config: GeneratorConfig) -> GeneratorDescription:
        """Return the generator's capabilities at the configured load."""
        lowest, highest = (limit * config.shown_fraction for limit in self.open_range_vpp)
        sine_hz = self.highest_hz[Shape.SINE]
        return GeneratorDescription(
            self.name, (lowest, highest), sine_hz, self.memory_points, self.usb_ids, self.longest_sweep_s
        )

    def open(self, config: GeneratorConfig) -> FunctionGenerator:
        """Open a generator and return its driver; pyvisa is not loaded before this call."""
        return cast("GeneratorDriver", resolve_name(self.driver)).open(config)

    def amplitude_range_vpp(self, config: GeneratorConfig) -> tuple[float, float]:
        """Return the smallest and largest amplitude setting of this bench, peak to peak [V]."""
        lowest, highest = self.describe(config).amplitude_range_vpp
        return lowest, min(highest, config.amplitude_limit_vpp)

    def check_frequency(self, shape: Shape, frequency_hz: float) -> None:
        """Raise LimitExceeded unless the generator can play ``shape`` at this repetition rate."""
        _require(frequency_hz, (self.lowest_hz, self.highest_hz[shape]), "Hz", f"{shape} of the {self.name}")

    def check_burst(self, cycles: int) -> None:
        """Raise LimitExceeded for a number of periods that the generator does not support."""
        _require(cycles, self.burst_cycles, "cycles", f"a burst of the {self.name}")

    def check_amplitude(self, config: GeneratorConfig, amplitude_vpp: float) -> None:
        """Raise LimitExceeded unless bench and generator allow this amplitude at zero offset."""
        allowed = self.amplitude_range_vpp(config)
        limit_vpp = config.amplitude_limit_vpp
        reason = f"the {self.name} with load_ohm = {config.load_ohm}"
        if allowed[1] == limit_vpp:
            reason = f"generator.amplitude_limit_vpp = {limit_vpp:g}"
        _require(amplitude_vpp, allowed, "Vpp", reason)

    def check_sweep(self, sweep: Sweep) -> None:
        """Raise LimitExceeded unless the generator supports this internal sweep."""
        self.check_frequency(Shape.SINE, sweep.start_hz)
        self.check_frequency(Shape.SINE, sweep.stop_hz)
        if not 0 < sweep.duration_s <= self.longest_sweep_s:
            most = f"sweeps up to {self.longest_sweep_s:g} s" if self.longest_sweep_s else "cannot sweep"
            raise LimitExceeded(
                f"a sweep of {sweep.duration_s:g} s was requested; the {self.name} "
                f"{most}. Nothing was sent; use sine_sweep, which steps the frequency"
            )

    def codes(self, waveform: Samples) -> ArbitraryCodes:
        """Return the codes of one period of values, scaled to the full range of codes.

        The mean is removed, because DC would displace the shaker. The remaining signal is scaled so that its
        largest magnitude gets the first or the last code.

        Raises LimitExceeded when the waveform has too few or too many points, is not finite, exceeds -1 to 1,
        or is constant.
        """
        values = np.asarray(waveform, dtype=np.float64)
        fewest, most = self.memory_points
        if values.ndim != 1 or not fewest <= values.size <= most:
            raise LimitExceeded(
                f"the waveform has the shape {values.shape}; the generator's memory takes one period of "
                f"{fewest} to {most} points. Nothing was sent; resample the waveform"
            )
        peak = float(np.max(np.abs(values)))
        # Unlike "peak > 1", this condition also refuses a NaN.
        if not peak <= 1.0 + 1e-9:
            raise LimitExceeded(
                f"the largest magnitude of the waveform is {peak:g}; values from -1 to 1 are allowed "
                "(the amplitude is given separately). Nothing was sent; scale the values"
            )
        swing = values - values.mean()
        factor = float(np.max(np.abs(swing)))
        if factor <= np.finfo(np.float64).eps:
            raise LimitExceeded(
                "the waveform is constant, and its mean value is not played. Nothing was sent; give one "
                "period of a varying signal"
            )
        middle = self.top_code / 2
        codes = np.clip(np.rint(middle + swing / factor * middle), 0, self.top_code).astype(np.uint16)
        return ArbitraryCodes(codes, factor)


def _require(value: float, allowed: tuple[float, float], unit: str, reason: str) -> None:
    lowest, highest = allowed
    if not lowest <= value <= highest:  # this form also refuses a NaN
        raise LimitExceeded(
            f"{value:g} {unit} was requested; {lowest:g} to {highest:g} {unit} are allowed ({reason}). "
            "Nothing was sent; choose a value in that range"
        )


AFG1022_MODEL = GeneratorModel(
    # Limits of the Tektronix AFG1022 specification, as in its IVI driver tkafg1k. For the amplitude, other
    # drivers and measurements agree on 20 Vpp (10 V peak); the IVI driver allows 40 Vpp. The limit is 20 Vpp.
    name="AFG1022",
    driver="vibench.acquisition.drivers:AFG1022X",
    open_range_vpp=(2e-3, 20.0),
    lowest_hz=1e-6,
    highest_hz={Shape.SINE: 25e6, Shape.EDIT_MEMORY: 10e6},
    memory_points=(2, 8192),
    top_code=16_383,
    burst_cycles=(1, 50_000),
    usb_ids=((0x0699, 0x0353),),
)


_NOTHING_VPP = 1e-6


@dataclass(frozen=True)
class NoGenerator:
    """Placeholder on a bench without a generator; refuses all commands except those of a replayed recording.

    The table ``[generator]`` still describes the load of the output: ``connected_ohm``, ``load_ohm``.
    """

    name: str
    silently: str = ""
    """Reason why the placeholder accepts commands and plays nothing; empty if it refuses commands."""
    amplitude_limit_vpp: float = 0.0
    unconfirmed: tuple[Knob, ...] = ()

    def describe(self, config: GeneratorConfig) -> GeneratorDescription:
        """Return capabilities that allow no signal, or only the plan of a recording that is played back."""
        if not self.silently:
            return GeneratorDescription(self.name, (_NOTHING_VPP, _NOTHING_VPP), _NOTHING_VPP, (1, 1))
        return GeneratorDescription(self.name, (_NOTHING_VPP, config.amplitude_limit_vpp), 1e6, (2, 65_536))

    def open(self, config: GeneratorConfig) -> Self:
        """Return a copy with the configured limit; no instrument is opened."""
        return type(self)(self.name, self.silently, config.amplitude_limit_vpp)

    @property
    def identity(self) -> Identity:
        """Identity that contains only the name of the placeholder."""
        return Identity("", self.name, "", "", f"{self.name}: {self.silently or 'it plays nothing'}")

    @property
    def amplitude_range_vpp(self) -> tuple[float, float]:
        """Smallest and largest amplitude setting that is accepted, peak to peak [V]."""
        return _NOTHING_VPP, self.amplitude_limit_vpp

    def measured_latency_s(self) -> float:
        """Return zero as the duration of an amplitude change [s]."""
        return 0.0

    def stop(self) -> None:
        """Do nothing, because no signal plays and no instrument is open."""

    close = end_burst = stop

    def start(self, *_settings: object) -> None:
        """Accept a command if a recording is played back; otherwise refuse it."""
        if not self.silently:
            raise ConfigurationError(
                "a signal was requested from a bench without a function generator. Nothing was played; use "
                'the analogue output (daq.output.plays = "tones_and_streams"), or set generator.driver'
            )

    load_sine = load_waveform = load_sweep = set_frequency = set_amplitude = arm_burst = trigger = start


NO_GENERATOR = NoGenerator("no function generator")


# Vibrometers and converters distort before they clip (hardware reference, section 4).
OVERLOAD_FRACTION = 0.95
# A delta-sigma converter's filter rings this long after clipping; overloads within this time count as one.
_RECOVERY_SAMPLES = 64


def overload_ranges(
    volts: Samples, roles: tuple[str, ...], full_scales_v: tuple[float, ...], first_sample: int
) -> tuple[Overload, ...]:
    """Return the ranges of samples in a block in which a channel reaches 95 % of its full scale.

    ``volts`` have the shape (channels, samples) [V]; ``first_sample`` is the number of the block's first
    sample in the run.
    """
    found: list[Overload] = []
    peaks_v = np.max(np.abs(volts), axis=1, initial=0.0)
    for role, row, peak_v, full_scale_v in zip(roles, volts, peaks_v, full_scales_v, strict=True):
        if not peak_v >= OVERLOAD_FRACTION * full_scale_v:  # also skips NaN, which `read_block` refuses
            continue
        past = np.flatnonzero(np.abs(row) >= OVERLOAD_FRACTION * full_scale_v)
        ranges = np.split(past, np.flatnonzero(np.diff(past) > _RECOVERY_SAMPLES) + 1)
        found += [
            Overload(role, first_sample + int(each[0]), first_sample + int(each[-1])) for each in ranges
        ]
    return tuple(found)


def require_playable(volts: Samples, physical: str, limit_v: float, *, is_open: bool) -> None:
    """Raise LimitExceeded for a NaN or a sample beyond the limit, InstrumentError if the output is closed."""
    peak_v = float(np.max(np.abs(volts), initial=0.0))
    if not peak_v <= limit_v:  # this form also refuses a NaN
        raise LimitExceeded(
            f"a peak of {peak_v:g} V was requested from {physical}; at most {limit_v:g} V are allowed. "
            "Nothing was written; lower the amplitude"
        )
    if not is_open:
        raise InstrumentError(f"{physical} is closed; open the bench again")
