"""What a hardware configuration describes: the chain from generator to converter, its limits, its knobs."""

from datetime import date
from enum import StrEnum
from math import inf
from typing import Annotated, Literal, Self

from pydantic import BeforeValidator, Field, NonNegativeFloat, PositiveFloat, PositiveInt, model_validator

from vibench.sim import SpecimenTable

from ..host.toml_file import FrozenModel
from ..instruments import Knob, LoopInput
from ._output import OutputConfig
from ._sensitivity import volts_per_unit
from ._virtual import VirtualConfig, fastest_sample_rate_hz

_LARGEST = 1e250
"""Of a shaker's numbers, in SI units: products of some are formed."""
HIGH_Z: Literal["high-z"] = "high-z"


Options = dict[str, str | int | float]
"""Settings of a plug-in that only it knows; it says what it allows."""


class Sourced(FrozenModel):
    """A figure with the place it comes from, so that nobody mistakes a memory for a data sheet."""

    value: PositiveFloat
    source: str = Field(min_length=1)


class StatedUncertainty(FrozenModel):
    """Relative uncertainty of a sensitivity, as a certificate or a data sheet states it."""

    relative: float = Field(gt=0.0, lt=1.0)
    """Expanded uncertainty over the value: 0.01 for 1 %."""
    coverage_factor: PositiveFloat = 2.0
    """Expanded over standard uncertainty: 2 on most certificates, 1.73 for bounds of a rectangle."""
    source: str = Field(min_length=1)
    """Certificate with its number, or data sheet."""


class GeneratorConfig(FrozenModel):
    """The function generator and what its output sees."""

    driver: str = "afg1022x"
    """Name of an entry point of ``vibench.generators``."""
    resource: str = Field(default="", pattern=r"^$|^(USB|TCPIP|GPIB|ASRL).*::(INSTR|SOCKET)$")
    """VISA resource name; empty for a generator that is not found by VISA."""
    options: Options = Field(default_factory=dict)
    """What else the driver wants to know; none of ours does."""
    visa_library: str = "@py"
    """``"@py"`` for pyvisa-py, empty for the system's VISA."""
    channel: Literal[1, 2] = 1
    load_ohm: Literal["high-z"] | PositiveFloat = HIGH_Z
    """Load that the generator is told to expect; its panel shows volts into this load."""
    connected_ohm: PositiveFloat
    """Input impedance that really hangs on the output: the amplifier's [ohm]."""
    amplitude_limit_vpp: PositiveFloat
    """The largest setting that this bench allows, peak to peak [V]."""
    settle_s: NonNegativeFloat = 0.0
    """Pause after each command that the instrument needs [s]."""
    dead_man_s: float | None = Field(default=None, ge=0.2, le=60.0)
    """Where given, sines play as bursts of this length that the run triggers again while it lives: should
    this computer hang, the drive ends with the burst [s]. docs/safety.md says what it costs in signal."""

    @model_validator(mode="after")
    def _has_bursts(self) -> Self:
        if self.dead_man_s is not None and self.channel != 1:
            raise ValueError(
                "dead_man_s needs bursts, which channel 1 alone has; use channel 1, or none of it"
            )
        return self

    def terminal_factor(self) -> float:
        """Volts at the terminal per volt on the panel: 2 when 50 ohm are set and nothing loads it."""
        source_ohm = 50.0
        told = inf if self.load_ohm == HIGH_Z else self.load_ohm
        shown = 1.0 if told == inf else told / (told + source_ohm)
        return self.connected_ohm / (self.connected_ohm + source_ohm) / shown


class AmplifierConfig(FrozenModel):
    """The power amplifier. Its knobs cannot be read: the operator confirms them."""

    model: str
    serial: str = ""
    gain_db: float = Field(ge=-60, le=60)
    """Voltage gain as the knob is set [dB]."""
    clip_v: PositiveFloat
    """Largest output voltage, peak [V]."""
    current_limit_a: Sourced
    """Setting of the current limiter, rms [A]."""
    low_cut_hz: NonNegativeFloat = 0.0
    """Lower -3 dB frequency, first order [Hz]; 0 for a direct-coupled amplifier."""
    high_cut_hz: PositiveFloat
    """Upper -3 dB frequency, first order [Hz]."""

    @model_validator(mode="after")
    def _has_a_band(self) -> Self:
        if self.low_cut_hz < self.high_cut_hz:
            return self
        raise ValueError(
            f"low_cut_hz = {self.low_cut_hz:g} must lie below high_cut_hz = {self.high_cut_hz:g}; correct one"
        )

    @property
    def gain(self) -> float:
        """Output volts per input volt."""
        return float(10 ** (self.gain_db / 20))


class ShakerLimits(FrozenModel):
    """What the shaker survives; all as peak values of a sine."""

    stroke_m: Sourced
    velocity_m_per_s: Sourced
    acceleration_m_per_s2: Sourced
    force_n: Sourced
    current_a: Sourced


class ShakerConfig(FrozenModel):
    """An electrodynamic shaker as a coil and a suspended mass, with the fixture it carries."""

    model: str
    serial: str = ""
    moving_mass_kg: PositiveFloat
    fixture_mass_kg: NonNegativeFloat
    """Everything rigid on the table except the specimen [kg]."""
    suspension_stiffness_n_per_m: PositiveFloat
    suspension_damping_ns_per_m: PositiveFloat
    force_constant_n_per_a: PositiveFloat
    coil_resistance_ohm: PositiveFloat
    """Coil and cable [ohm]."""
    coil_inductance_h: PositiveFloat
    source: str = Field(min_length=1)
    limits: ShakerLimits

    @model_validator(mode="after")
    def _can_be_computed_with(self) -> Self:
        for name, value in self.model_dump().items():
            if isinstance(value, float) and value > _LARGEST:
                raise ValueError(f"{name} = {value:g} is too large to be computed with; correct it")
        return self


def _acceleration_sensitivity(given: object) -> object:
    return volts_per_unit(given, "m s-2") if isinstance(given, str) else given


def _velocity_range(given: object) -> object:
    return 1e3 / volts_per_unit(given, "m s-1") if isinstance(given, str) else given


class VibrometerConfig(FrozenModel):
    """The laser vibrometer. Range and filters are set by hand: the operator confirms them."""

    model: str
    serial: str = ""
    decoder: str
    range_mm_per_s_per_v: Annotated[
        PositiveFloat, BeforeValidator(_velocity_range, json_schema_input_type=PositiveFloat | str)
    ]
    """Decoder range [mm/s per volt], or text with another unit: ``"4 V/(m/s)"``."""
    full_scale_v: PositiveFloat
    """Largest output, peak [V]."""
    bandwidth_hz: PositiveFloat
    tracking_filter: Literal["off", "fast", "medium", "slow"] = "off"
    delay_s: NonNegativeFloat
    """Signal delay of the decoder [s]; the analysis takes it out of the phase."""
    calibrated: date
    uncertainty: StatedUncertainty | None = None
    """Of the calibration; absent: not stated, and every result says so."""
    alignment_deg: Sourced | None = None
    """Largest angle between beam and motion [degree]."""
    noise_per_rthz: Sourced | None = None
    """Density of its noise [m/s per root hertz]; absent: not stated."""

    @property
    def full_scale_m_per_s(self) -> float:
        """Largest velocity that the range can show [m/s]."""
        return self.full_scale_v * self.range_mm_per_s_per_v * 1e-3


class AccelerometerConfig(FrozenModel):
    """The accelerometer on the base."""

    model: str
    serial: str = ""
    sensitivity_v_per_m_per_s2: Annotated[
        PositiveFloat, BeforeValidator(_acceleration_sensitivity, json_schema_input_type=PositiveFloat | str)
    ]
    """Sensitivity [V per m/s2], or text with the unit of the data sheet: ``"100 mV/g"``."""
    full_scale_v: PositiveFloat
    resonance_hz: PositiveFloat
    iepe: Literal["yes", "no"]
    calibrated: date
    uncertainty: StatedUncertainty | None = None
    """Of the sensitivity; absent: not stated."""
    alignment_deg: Sourced | None = None
    """Largest angle between the sensitive axis and the motion [degree]."""
    noise_per_rthz: Sourced | None = None
    """Density of its noise [m/s2 per root hertz]; absent: not stated."""


class Role(StrEnum):
    """What a channel records; the name of its dataset."""

    DRIVE_VOLTAGE = "drive_voltage"
    AMPLIFIER_VOLTAGE = "amplifier_voltage"
    BASE_ACCELERATION = "base_acceleration"
    M0_VELOCITY = "m0_velocity"


class ChannelConfig(FrozenModel):
    """One input of the converter."""

    role: Role
    physical: str
    """Name on the device: ``"ai0"``."""
    range_v: PositiveFloat
    coupling: Literal["AC", "DC"]
    terminal: Literal["default", "pseudo_differential", "differential", "single_ended"] = "default"
    iepe_current_a: NonNegativeFloat = 0.0
    attenuation: PositiveFloat = 1.0
    """Divider in front of the input: volts at the source per volt at the input."""
    sensor: str | None = None
    """Name of an entry point of ``vibench.sensors``; absent: the usual one of the role."""
    options: Options = Field(default_factory=dict)
    """What else the sensor wants to know."""
    calibrated: date
    """Date of the converter's last calibration."""
    uncertainty: StatedUncertainty | None = None
    """Of volts, the divider in front included; absent: not stated."""


class DaqConfig(FrozenModel):
    """The converter."""

    driver: str = "daqmx"
    """Name of an entry point of ``vibench.digitizers``, and of ``vibench.outputs`` where it has an output."""
    options: Options = Field(default_factory=dict)
    """What else the driver wants to know."""
    product: str
    device: str
    """Device name in the driver: ``"cDAQ1Mod1"``."""
    server: str | None = None
    """Address of a gRPC device server, ``"host:port"``; absent for a converter on this computer."""
    sample_rate_hz: PositiveFloat
    """Rate to ask for; the rate that the hardware takes is read back and stored beside it."""
    buffer_s: PositiveFloat = 10.0
    clock_ppm: Sourced | None = None
    """Bounds of the sample clock [parts in a million]; absent: not stated."""
    channels: tuple[ChannelConfig, ...] = Field(min_length=1)
    output: OutputConfig | None = None
    """An analogue output for streamed noise; absent when there is none."""

    @property
    def output_channel(self) -> str | None:
        """Full name of the analogue output: ``"Dev1/ao0"``; None without one."""
        if self.output is None:
            return None
        return f"{self.output.device or self.device}/{self.output.physical}"

    @model_validator(mode="after")
    def _channels_differ(self) -> Self:
        for what, values in (
            ("role", [channel.role.value for channel in self.channels]),
            ("physical", [channel.physical for channel in self.channels]),
        ):
            twice = sorted({value for value in values if values.count(value) > 1})
            if twice:
                raise ValueError(f"{what} {', '.join(twice)} is given twice: every channel needs its own")
        return self


class SpecimenConfig(SpecimenTable):
    """The specimen on the shaker, as far as it is known: one that it names, and what differs from it."""

    amplitude_limit_m: Sourced
    """Largest displacement of a mass that the springs bear."""


class ControllerConfig(FrozenModel):
    """A real-time controller: sensors of base and m0 at its inputs, its output at the amplifier's input.

    Its output takes the place of the generator's while it plays.
    """

    driver: str = "lines"
    """Name of an entry point of ``vibench.controllers``."""
    resource: str = Field(default="", pattern=r"^$|^TCPIP.*::SOCKET$")
    """VISA resource name of its socket; empty on a virtual rig, which knows it."""
    visa_library: str = "@py"
    """``"@py"`` for pyvisa-py, empty for the system's VISA."""
    options: Options = Field(default_factory=dict)
    """What else the driver wants to know."""
    rate_hz: float = Field(ge=1_000, le=25_600)
    """Samples a second; 1 to 20 kHz are usual."""
    latency_s: float = Field(ge=0, le=5e-3)
    """From a sample to the voltage that answers it, as measured [s]."""
    limit_v: PositiveFloat
    """Largest output, peak [V]."""
    watchdog_s: float = Field(default=1.0, ge=0.3, le=10.0)
    """Told nothing for so long, it ramps down by itself [s]."""
    pd_of: LoopInput | None = None
    """The input of which alone it takes a law, proportional and derivative; absent: any linear law."""
    source: str = Field(min_length=1)
    """Where rate, latency and limit come from."""


class Rig(FrozenModel):
    """A whole bench as its configuration file describes it."""

    name: str = Field(min_length=1)
    generator: GeneratorConfig
    amplifier: AmplifierConfig
    shaker: ShakerConfig
    vibrometer: VibrometerConfig
    accelerometer: AccelerometerConfig
    daq: DaqConfig
    specimen: SpecimenConfig
    controller: ControllerConfig | None = None
    """Present where a real-time controller can play in the generator's place."""
    calibration_valid_days: PositiveInt = 730
    check_valid_h: PositiveFloat = 12.0
    """How long a bench check that passed allows to arm [h]."""
    virtual: VirtualConfig | None = None
    """Present when every instrument is simulated."""

    @model_validator(mode="after")
    def _grid_carries_the_sample_rate(self) -> Self:
        fastest_hz = None if self.virtual is None else fastest_sample_rate_hz(self.virtual.grid_rate_hz)
        if self.virtual is None or fastest_hz is None or self.daq.sample_rate_hz <= fastest_hz:
            return self
        raise ValueError(
            f"virtual.grid_rate_hz = {self.virtual.grid_rate_hz:g} carries {fastest_hz:g} samples a second "
            f"at most, and daq.sample_rate_hz is {self.daq.sample_rate_hz:g}; lower that, or "
            "make the grid finer"
        )

    @model_validator(mode="after")
    def _grid_carries_the_controller(self) -> Self:
        if self.virtual is None or self.controller is None:
            return self
        steps = self.virtual.grid_rate_hz / self.controller.rate_hz
        if steps == round(steps):
            return self
        raise ValueError(
            f"controller.rate_hz = {self.controller.rate_hz:g} takes {steps:.4g} of the "
            f"{self.virtual.grid_rate_hz:g} steps a second of the virtual rig from sample to sample; give a "
            f"rate that takes a whole number of them, {self.virtual.grid_rate_hz / max(round(steps), 1):g} "
            "for example"
        )

    @property
    def plays_back(self) -> bool:
        """Whether a recording takes the place of the instruments."""
        return self.daq.driver == "file"

    @property
    def knobs(self) -> tuple[Knob, ...]:
        """Everything that is set by hand."""
        amplifier, vibrometer = self.amplifier, self.vibrometer
        return (
            Knob(instrument=amplifier.model, setting="gain", value=f"{amplifier.gain_db:g} dB"),
            Knob(
                instrument=amplifier.model,
                setting="current limit",
                value=f"{amplifier.current_limit_a.value:g} A rms",
            ),
            Knob(
                instrument=vibrometer.model,
                setting="velocity range",
                value=f"{vibrometer.range_mm_per_s_per_v:g} mm/s/V",
            ),
            Knob(instrument=vibrometer.model, setting="tracking filter", value=vibrometer.tracking_filter),
        )
