"""Two example instruments for vibench: a function generator with plain SCPI, and a charge amplifier.

A generator is a class with `describe` and `open`, and with the methods of
`vibench.acquisition.instruments.FunctionGenerator`. This one sends commands that most generators of the AFG
family understand, and reads the error queue after each. A driver for a laboratory also reads settings back.
"""

import time

import numpy as np
import pyvisa

from vibench.acquisition import ConfigurationError, InstrumentError, InstrumentLost, LimitExceeded
from vibench.acquisition.instruments import GeneratorDescription, Identity, Knob, Samples, SensorFacts, Sweep
from vibench.acquisition.rig import ChannelConfig, GeneratorConfig, Rig

LOWEST_VPP, HIGHEST_VPP = 2e-3, 20.0
HIGHEST_HZ = 1e6
MEMORY_POINTS = (2, 8192)
TOP_CODE = 16383


class PlainScpiGenerator:
    """A function generator over VISA: sine, one waveform, bursts."""

    def __init__(self, config: GeneratorConfig) -> None:
        self._config = config
        self._amplitude_vpp = LOWEST_VPP
        self._stretch = 1.0
        self._is_open = True
        try:
            self._session = pyvisa.ResourceManager(config.visa_library).open_resource(config.resource)
        except (pyvisa.VisaIOError, ValueError, OSError) as error:
            raise InstrumentLost(
                f"no generator answers at {config.resource} ({error}); check its cable"
            ) from error

    @staticmethod
    def describe(config: GeneratorConfig) -> GeneratorDescription:
        """Return the capabilities of the generator, without opening it."""
        del config
        return GeneratorDescription(
            "plain SCPI generator", (LOWEST_VPP, HIGHEST_VPP), HIGHEST_HZ, MEMORY_POINTS
        )

    @classmethod
    def open(cls, config: GeneratorConfig) -> "PlainScpiGenerator":
        """Open the generator with its output off, set to a sine of the smallest amplitude."""
        generator = cls(config)
        generator._command("OUTP1:STAT OFF")
        generator._command("OUTP1:IMP INF")
        generator.load_sine(1000.0, LOWEST_VPP)
        return generator

    @property
    def identity(self) -> Identity:
        """Identity that the generator reports."""
        reply = self._ask("*IDN?") or self._ask("*IDN?")
        maker, model, serial, firmware = (*reply.split(","), "", "", "", "")[:4]
        return Identity(maker, model, serial, firmware, reply)

    @property
    def unconfirmed(self) -> tuple[Knob, ...]:
        """The load setting, which this driver does not read back: the operator must confirm it."""
        return (Knob(instrument="generator", setting="output load", value=str(self._config.load_ohm)),)

    @property
    def amplitude_range_vpp(self) -> tuple[float, float]:
        """Smallest and largest amplitude that generator and bench allow, peak to peak [V]."""
        return LOWEST_VPP, min(HIGHEST_VPP, self._config.amplitude_limit_vpp)

    def load_sine(self, frequency_hz: float, amplitude_vpp: float) -> None:
        """Set up a sine."""
        self._require(amplitude_vpp, frequency_hz)
        self._command(f"SOUR1:VOLT {LOWEST_VPP}VPP")
        self._command("SOUR1:FUNC:SHAP SIN")
        self._stretch = 1.0
        self._command(f"SOUR1:FREQ {frequency_hz:.6f}")
        self.set_amplitude(amplitude_vpp)

    def load_waveform(self, waveform: Samples, repetition_hz: float, amplitude_vpp: float) -> None:
        """Load one period, scaled to the full range of codes; the amplitude setting corrects the scale."""
        fewest, most = MEMORY_POINTS
        swing = np.asarray(waveform, dtype=float) - np.mean(waveform)
        peak = float(np.max(np.abs(swing)))
        if not (fewest <= swing.size <= most and peak > 0 and np.max(np.abs(waveform)) <= 1.0):
            raise LimitExceeded(
                f"{fewest} to {most} points from -1 to 1, not constant, are allowed; nothing was sent"
            )
        self._require(amplitude_vpp * peak, repetition_hz)
        self._command(f"SOUR1:VOLT {LOWEST_VPP}VPP")
        codes = np.rint((swing / peak + 1) / 2 * TOP_CODE).astype(">u2")
        self._session.write_binary_values("DATA:DATA EMEM,", codes, datatype="H", is_big_endian=True)
        self._command("SOUR1:FUNC:SHAP EMEM")
        self._command(f"SOUR1:FREQ {repetition_hz:.6f}")
        self._stretch = peak
        self.set_amplitude(amplitude_vpp)

    def load_sweep(self, sweep: Sweep, amplitude_vpp: float) -> None:
        """Refuse: `describe` reports no internal sweep, so the computer steps the frequency."""
        raise LimitExceeded(f"{sweep} at {amplitude_vpp:g} Vpp: no internal sweep; use sine_sweep")

    def set_frequency(self, frequency_hz: float) -> None:
        """Change the frequency."""
        self._require(LOWEST_VPP, frequency_hz)
        self._command(f"SOUR1:FREQ {frequency_hz:.6f}")

    def set_amplitude(self, amplitude_vpp: float) -> None:
        """Change the amplitude."""
        self._require(amplitude_vpp * self._stretch, 1.0)
        self._command(f"SOUR1:VOLT {amplitude_vpp * self._stretch:.4f}VPP")
        self._amplitude_vpp = amplitude_vpp

    def arm_burst(self, cycles: int) -> None:
        """Play ``cycles`` periods at each trigger."""
        self._command("SOUR1:BURS:MODE TRIG")
        self._command(f"SOUR1:BURS:NCYC {cycles}")
        self._command("SOUR1:BURS:STAT ON")

    def trigger(self) -> None:
        """Play an armed burst."""
        self._command("*TRG")

    def end_burst(self) -> None:
        """Play continuously, without triggers."""
        self._command("SOUR1:BURS:STAT OFF")

    def measured_latency_s(self) -> float:
        """Set the present amplitude again, and return the time that this takes [s]."""
        began_s = time.perf_counter()
        self.set_amplitude(self._amplitude_vpp)
        return time.perf_counter() - began_s

    def start(self) -> None:
        """Turn the output on."""
        self._command("OUTP1:STAT ON")

    def stop(self) -> None:
        """Turn the output off."""
        if self._is_open:
            self._command("OUTP1:STAT OFF")

    def close(self) -> None:
        """Turn the output off, and close the session."""
        if self._is_open:
            try:
                self.stop()
            finally:
                self._is_open = False
                self._session.close()

    def _command(self, message: str) -> None:
        self._call(self._session.write, message)
        if not (reply := self._ask("SYST:ERR?")).startswith("0"):
            raise InstrumentError(
                f"the generator refused {message!r}: {reply}. Check the value and try again"
            )

    def _ask(self, message: str) -> str:
        self._call(self._session.write, message)
        return self._call(self._session.read_raw).decode("ascii", errors="replace").strip()

    def _call(self, call, *arguments):
        if not self._is_open:
            raise InstrumentError("the generator is closed; open the bench again")
        try:
            return call(*arguments)
        except (pyvisa.VisaIOError, ValueError, OSError) as error:
            raise InstrumentLost(
                f"the generator does not answer ({error}); switch the amplifier off"
            ) from error

    def _require(self, amplitude_vpp: float, frequency_hz: float) -> None:
        lowest, highest = self.amplitude_range_vpp
        if not (lowest <= amplitude_vpp <= highest and 0 < frequency_hz <= HIGHEST_HZ):
            raise LimitExceeded(
                f"{amplitude_vpp:g} Vpp at {frequency_hz:g} Hz was requested; {lowest:g} to {highest:g} Vpp "
                f"up to {HIGHEST_HZ:g} Hz are allowed. Nothing was sent"
            )


def charge_amplifier(rig: Rig, config: ChannelConfig) -> SensorFacts:
    """Return the properties of an accelerometer with charge amplifier, from the channel's options."""
    try:
        sensor_pc, amplifier_mv = config.options["pc_per_m_per_s2"], config.options["mv_per_pc"]
    except KeyError as missing:
        raise ConfigurationError(f"the channel's options do not contain {missing}; add this key") from missing
    return SensorFacts(
        "acceleration",
        "m s-2",
        units_per_volt=1 / (float(sensor_pc) * float(amplifier_mv) * 1e-3),
        full_scale_v=10.0,
        name="charge amplifier",
        serial=rig.accelerometer.serial,
        calibrated=rig.accelerometer.calibrated,
    )
