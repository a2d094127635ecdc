"""No function generator: for a bench on which an analogue output plays all, or a recording is played back."""

from dataclasses import dataclass
from typing import Self

from ..errors import ConfigurationError
from ..instruments import GeneratorDescription, Identity, Knob, Samples, Sweep
from ..rig import GeneratorConfig

_NOTHING_VPP = 1e-6


@dataclass(frozen=True)
class NoGenerator:
    """Stands where a bench has no generator; what it is asked to play is refused, or known to be in a file.

    The table ``[generator]`` still says whose volts an output plays: ``connected_ohm``, ``load_ohm``.
    """

    name: str
    silently: str = ""
    """Why it takes commands and plays nothing; empty: it takes none."""
    amplitude_limit_vpp: float = 0.0

    def describe(self, config: GeneratorConfig) -> GeneratorDescription:
        """Say that it plays nothing, or that whatever the file was made with is taken."""
        if not self.silently:
            return GeneratorDescription(self.name, (_NOTHING_VPP, _NOTHING_VPP), _NOTHING_VPP, (1, 1))
        return GeneratorDescription(self.name, (_NOTHING_VPP, config.amplitude_limit_vpp), 1e6, (2, 65_536))

    def open(self, config: GeneratorConfig) -> Self:
        """Nothing to open."""
        return type(self)(self.name, self.silently, config.amplitude_limit_vpp)

    @property
    def identity(self) -> Identity:
        """Nobody."""
        return Identity("", self.name, "", "", f"{self.name}: {self.silently or 'it plays nothing'}")

    @property
    def unconfirmed(self) -> tuple[Knob, ...]:
        """Nothing to confirm."""
        return ()

    @property
    def amplitude_range_vpp(self) -> tuple[float, float]:
        """What may be asked for [V]."""
        return _NOTHING_VPP, self.amplitude_limit_vpp

    def load_sine(self, frequency_hz: float, amplitude_vpp: float) -> None:
        """Take it silently, or refuse."""
        self._take(f"a sine of {frequency_hz:g} Hz at {amplitude_vpp:g} Vpp")

    def load_waveform(self, waveform: Samples, repetition_hz: float, amplitude_vpp: float) -> None:
        """Take it silently, or refuse."""
        self._take(f"a waveform of {len(waveform)} points at {repetition_hz:g} Hz and {amplitude_vpp:g} Vpp")

    def load_sweep(self, sweep: Sweep, amplitude_vpp: float) -> None:
        """Refuse: no sweep of its own is described."""
        raise ConfigurationError(f"{sweep} at {amplitude_vpp:g} Vpp was asked of {self.name}; nothing plays")

    def set_frequency(self, frequency_hz: float) -> None:
        """Take it silently, or refuse."""
        self._take(f"{frequency_hz:g} Hz")

    def set_amplitude(self, amplitude_vpp: float) -> None:
        """Take it silently, or refuse."""
        self._take(f"{amplitude_vpp:g} Vpp")

    def arm_burst(self, cycles: int) -> None:
        """Take it silently, or refuse."""
        self._take(f"a burst of {cycles} cycles")

    def trigger(self) -> None:
        """Take it silently, or refuse."""
        self._take("a trigger")

    def end_burst(self) -> None:
        """Nothing plays."""

    def measured_latency_s(self) -> float:
        """No time at all [s]."""
        return 0.0

    def start(self) -> None:
        """Take it silently, or refuse."""
        self._take("its output")

    def stop(self) -> None:
        """Nothing plays."""

    def close(self) -> None:
        """Nothing is open."""

    def _take(self, what: str) -> None:
        if not self.silently:
            raise ConfigurationError(
                f"{what} was asked of a bench without function generator. Nothing was played; let its "
                'analogue output play it (daq.output.plays = "tones_and_streams"), or name a generator.driver'
            )


NO_GENERATOR = NoGenerator("no function generator")
FILE_GENERATOR = NoGenerator("a recording", "what was played stands in the recording that is played back")
