"""What a model of generator can do: ranges and waveforms, checked before anything is sent.

Nothing here needs the library by which it is spoken to: plans are held against it without.
"""

from dataclasses import dataclass
from enum import StrEnum
from importlib import import_module
from math import inf
from typing import Literal, cast

import numpy as np
from numpy.typing import NDArray

from ..errors import LimitExceeded
from ..instruments import FunctionGenerator, GeneratorDescription, Samples, Sweep
from ..rig import HIGH_Z, GeneratorConfig, GeneratorDriver

Load = Literal["high-z"] | float
SOURCE_OHM = 50.0


class Shape(StrEnum):
    """A shape that a driver plays; the value is its SCPI word on an AFG1022."""

    SINE = "SIN"
    EDIT_MEMORY = "EMEM"


def shown_fraction(load: Load) -> float:
    """Part of the open-circuit voltage that the panel shows for a load: its voltage divider."""
    ohm = inf if load == HIGH_Z else float(load)
    return 1.0 if ohm == inf else ohm / (ohm + SOURCE_OHM)


@dataclass(frozen=True)
class GeneratorModel:
    """One model of generator: its figures, and the class of `vibench.acquisition.drivers` that opens it."""

    name: str
    driver: str
    open_range_vpp: tuple[float, float]
    """Smallest and largest amplitude without load, peak to peak [V]."""
    open_peak_v: float
    """Largest abs(offset) + Vpp/2 without load [V]."""
    lowest_hz: float
    highest_hz: dict[Shape, float]
    memory_points: tuple[int, int]
    top_code: int
    """Codes of the memory run from 0 to this."""
    burst_cycles: tuple[int, int]
    usb_ids: tuple[tuple[int, int], ...] = ()
    longest_sweep_s: float = 0.0
    """Of its own; 0 where its sweep time is no remote command."""

    def describe(self, config: GeneratorConfig) -> GeneratorDescription:
        """Say what it can do into the load that it is told to expect."""
        return GeneratorDescription(
            self.name,
            self.range_vpp(config.load_ohm),
            self.highest_hz[Shape.SINE],
            self.memory_points,
            self.usb_ids,
            self.longest_sweep_s,
        )

    def open(self, config: GeneratorConfig) -> FunctionGenerator:
        """Open one; the library that speaks to it is loaded only now."""
        driver = getattr(import_module("vibench.acquisition.drivers"), self.driver)
        return cast("GeneratorDriver", driver).open(config)

    def range_vpp(self, load: Load) -> tuple[float, float]:
        """Smallest and largest setting with a load, peak to peak [V]."""
        fraction = shown_fraction(load)
        return self.open_range_vpp[0] * fraction, self.open_range_vpp[1] * fraction

    def amplitude_range_vpp(self, config: GeneratorConfig) -> tuple[float, float]:
        """Smallest and largest amplitude setting of this bench, peak to peak [V]."""
        lowest, highest = self.range_vpp(config.load_ohm)
        return lowest, min(highest, config.amplitude_limit_vpp)

    def check_frequency(self, shape: Shape, frequency_hz: float) -> None:
        """Raise LimitExceeded unless the generator can play ``shape`` so often a second."""
        highest_hz = self.highest_hz[shape]
        if not self.lowest_hz <= frequency_hz <= highest_hz:
            raise LimitExceeded(
                f"{frequency_hz:g} Hz was asked for; the {self.name} plays {shape.value} from "
                f"{self.lowest_hz:g} to {highest_hz:g} Hz. Nothing was sent; choose a frequency in that range"
            )

    def check_burst(self, cycles: int) -> None:
        """Raise LimitExceeded for a number of periods that the generator cannot count."""
        fewest, most = self.burst_cycles
        if not fewest <= cycles <= most:
            raise LimitExceeded(f"a burst of {cycles} cycles was asked for; {fewest} to {most} are allowed")

    def check_sweep(self, sweep: Sweep) -> None:
        """Raise LimitExceeded unless the generator makes such a sweep by itself."""
        self.check_frequency(Shape.SINE, sweep.start_hz)
        self.check_frequency(Shape.SINE, sweep.stop_hz)
        if not 0 < sweep.duration_s <= self.longest_sweep_s:
            most = f"up to {self.longest_sweep_s:g} s" if self.longest_sweep_s else "not at all"
            raise LimitExceeded(
                f"a sweep of {sweep.duration_s:g} s was asked for; the {self.name} sweeps by "
                f"itself {most}. Nothing was sent; use sine_sweep, which steps the frequency"
            )

    def check_amplitude(self, config: GeneratorConfig, amplitude_vpp: float, offset_v: float) -> None:
        """Raise LimitExceeded unless bench and generator allow this amplitude with this offset."""
        lowest, highest = self.amplitude_range_vpp(config)
        if not lowest <= amplitude_vpp <= highest:
            reason = (
                f"generator.amplitude_limit_vpp = {config.amplitude_limit_vpp:g}"
                if highest == config.amplitude_limit_vpp
                else f"the {self.name}'s range with load_ohm = {config.load_ohm}"
            )
            raise LimitExceeded(
                f"{amplitude_vpp:g} Vpp was asked for; {lowest:g} to {highest:g} Vpp are allowed here "
                f"({reason}). Nothing was sent; choose an amplitude in that range"
            )
        largest_peak_v = min(
            self.open_peak_v * shown_fraction(config.load_ohm), config.amplitude_limit_vpp / 2
        )
        peak_v = abs(offset_v) + amplitude_vpp / 2
        if not peak_v <= largest_peak_v:
            raise LimitExceeded(
                f"{amplitude_vpp:g} Vpp around {offset_v:g} V peaks at {peak_v:g} V; {largest_peak_v:g} V is "
                "allowed (abs(offset) + Vpp/2, of the generator and of generator.amplitude_limit_vpp). "
                "Nothing was sent; lower one of them"
            )


@dataclass(frozen=True)
class ArbitraryCodes:
    """One period as the generator's memory holds it: free of DC, over the full range of codes.

    The terminal plays ``(2 * codes / top_code - 1)`` times half of what the panel is set to, which is
    ``amplitude_vpp * panel_factor``.
    """

    codes: NDArray[np.uint16]
    """0 to ``top_code``, shape (points,)."""
    top_code: int
    """Code of plus half of the peak-to-peak amplitude on the panel; code 0 is minus half of it."""
    panel_factor: float
    """Largest magnitude that is left: 1 for a waveform that is free of DC and reaches 1."""


def arbitrary_codes(waveform: Samples, model: GeneratorModel) -> ArbitraryCodes:
    """Turn one period of values into codes of the full range.

    Code 0 stands for minus, and the highest one for plus, half of the amplitude on the panel. The mean is
    removed, since DC would push the shaker off its centre, and what is left is scaled so that its largest
    magnitude takes an outermost code.

    Raises
    ------
    LimitExceeded
        When the waveform has too few or too many points, is not finite, leaves -1 to 1, or is constant.

    """
    values = np.asarray(waveform, dtype=np.float64)
    fewest, most = model.memory_points
    if values.ndim != 1 or not fewest <= values.size <= most:
        raise LimitExceeded(
            f"the waveform has the shape {values.shape}; the generator's memory takes one period of "
            f"{fewest} to {most} points. Nothing was sent; resample it"
        )
    peak = float(np.max(np.abs(values)))
    # Not "peak > 1": a NaN must not pass.
    if not peak <= 1.0 + 1e-9:
        raise LimitExceeded(
            f"the largest magnitude of the waveform is {peak:g}; values from -1 to 1 are allowed "
            "(the amplitude is given apart). Nothing was sent; scale it"
        )
    swing = values - values.mean()
    factor = float(np.max(np.abs(swing)))
    if factor <= np.finfo(np.float64).eps:
        raise LimitExceeded(
            "the waveform is constant: without its mean nothing is left to play. Nothing was sent; "
            "give one period that moves"
        )
    middle = model.top_code / 2
    codes = np.clip(np.rint(middle + swing / factor * middle), 0, model.top_code).astype(np.uint16)
    return ArbitraryCodes(codes, model.top_code, factor)


AFG1022_MODEL = GeneratorModel(
    # Tektronix AFG1022 specification, as the IVI driver tkafg1k checks it. Drivers and measurements agree on
    # a peak of 10 V; the IVI driver allows twice that. The stricter one holds.
    name="AFG1022",
    driver="AFG1022X",
    open_range_vpp=(2e-3, 20.0),
    open_peak_v=10.0,
    lowest_hz=1e-6,
    highest_hz={Shape.SINE: 25e6, Shape.EDIT_MEMORY: 10e6},
    memory_points=(2, 8192),
    top_code=16_383,
    burst_cycles=(1, 50_000),
    usb_ids=((0x0699, 0x0353),),
)
KEYSIGHT_33500B_MODEL = GeneratorModel(
    # Keysight 33500B data sheet, the 20 MHz models; without a filter its memory plays up to 62.5 MSa/s.
    name="Keysight 33500B",
    driver="Keysight33500B",
    open_range_vpp=(2e-3, 20.0),
    open_peak_v=10.0,
    lowest_hz=1e-6,
    highest_hz={Shape.SINE: 20e6, Shape.EDIT_MEMORY: 62.5e6 / 65_536},
    memory_points=(8, 65_536),
    top_code=65_534,
    burst_cycles=(1, 100_000_000),
    # One or two channels, 20 or 30 MHz: as public programs name them.
    usb_ids=tuple((0x0957, product) for product in (0x2507, 0x2607, 0x2707, 0x2807, 0x2A07, 0x2B07, 0x2C07)),
    longest_sweep_s=500.0,  # linear ones may last longer, logarithmic ones may not
)
