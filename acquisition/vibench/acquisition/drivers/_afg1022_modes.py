"""What makes an AFG1022 play other than on and on: switched off, or on request burst, phase and sweep."""

from enum import StrEnum
from math import degrees

from ..errors import InstrumentError, LimitExceeded, SettingRefused
from ._generator_limits import AFG1022_MODEL, GeneratorModel, Shape
from ._scpi import number_in
from ._verified_settings import Tolerance, VerifiedSettings

_OFF = frozenset({"0", "OFF"})
_ON = frozenset({"1", "ON"})
_CONTINUOUS = frozenset({"CW", "FIX", "FIXED"})
_SWEEP = frozenset({"SWE", "SWEEP"})
_MODULATIONS = ("AM", "FM", "PM", "FSK", "PWM", "ASK", "PSK")
_BURST_CHANNEL = 1
_EXACT = Tolerance(absolute=0.0, relative=0.0)
_FREQUENCY = Tolerance(absolute=1.5e-6, relative=1e-6)
_WHOLE_TURN_DEG = 360


class SweepSupport(StrEnum):
    """Whether the instrument sweeps by itself on remote command."""

    SUPPORTED = "takes start, stop and mode; its sweep time can be set on the panel only"
    UNSUPPORTED = "does not take the sweep commands: step the frequency from here"


class Unsupported(InstrumentError):
    """The instrument, or its firmware, cannot do that remotely."""


def switch_off_modes(settings: VerifiedSettings, channel: int) -> None:
    """End sweep, burst, modulation and frequency lock; what the firmware does not know cannot be on."""
    _off_if_known(settings, f"SOUR{channel}:FREQ:MODE", "CW", _CONTINUOUS)
    if channel == _BURST_CHANNEL:
        _off_if_known(settings, f"SOUR{channel}:BURS:STAT", "OFF", _OFF)
    _off_if_known(settings, f"SOUR{channel}:FREQ:CONC", "OFF", _OFF)
    for modulation in _MODULATIONS:
        _off_if_known(settings, f"SOUR{channel}:{modulation}:STAT", "OFF", _OFF)


def arm_burst(settings: VerifiedSettings, channel: int, cycles: int) -> None:
    """Play ``cycles`` periods at each trigger instead of playing on.

    Raises
    ------
    Unsupported
        On channel 2, which has no burst.
    LimitExceeded
        For a number of cycles that the instrument cannot count.

    """
    if channel != _BURST_CHANNEL:
        raise Unsupported(f"a burst was asked of channel {channel}; only channel {_BURST_CHANNEL} has bursts")
    set_burst(settings, channel, cycles, AFG1022_MODEL)


def set_burst(settings: VerifiedSettings, channel: int, cycles: int, model: GeneratorModel) -> None:
    """Play ``cycles`` periods at each trigger; LimitExceeded for more than the counter takes."""
    fewest, most = model.burst_cycles
    if not fewest <= cycles <= most:
        raise LimitExceeded(f"a burst of {cycles} cycles was asked for; {fewest} to {most} are allowed")
    header = f"SOUR{channel}:BURS"
    settings.set_word(f"{header}:MODE", "TRIG", frozenset({"TRIG", "TRIGGERED"}))
    settings.set_number(f"{header}:NCYC", cycles, str(cycles), _EXACT)
    settings.set_word(f"{header}:STAT", "ON", _ON)


def trigger(settings: VerifiedSettings) -> None:
    """Fire an armed burst."""
    settings.port.command("*TRG")


def end_burst(settings: VerifiedSettings, channel: int) -> None:
    """Play on without a trigger."""
    if channel == _BURST_CHANNEL:
        settings.set_word(f"SOUR{channel}:BURS:STAT", "OFF", _OFF)


def set_phase(settings: VerifiedSettings, channel: int, phase_deg: int) -> None:
    """Set the start phase, in whole degrees from 0 to 359: all that this family resolves.

    A number without a unit is radians to this family, and its answer's unit is not documented: an
    answer that means the phase in either unit is accepted.
    """
    if not 0 <= phase_deg < _WHOLE_TURN_DEG:
        raise LimitExceeded(
            f"a phase of {phase_deg} degrees was asked for; 0 to {_WHOLE_TURN_DEG - 1} are allowed. "
            "Nothing was sent; add or subtract whole turns"
        )
    header = f"SOUR{channel}:PHAS:ADJ"
    settings.port.command(f"{header} {phase_deg}DEG")
    reply = settings.port.query(f"{header}?")
    got = number_in(reply, f"{settings.name}: {header}?")
    half_degree = 0.5
    if min(abs(got - phase_deg), abs(degrees(got) - phase_deg)) > half_degree:
        raise SettingRefused(
            f"{settings.name}: {header} was set to {phase_deg} degrees and reads back {reply!r}; "
            "set the phase on its panel, or leave it at 0"
        )


def probe_sweep(settings: VerifiedSettings, channel: int, start_hz: float, stop_hz: float) -> SweepSupport:
    """Try the sweep commands, see what they did, and go back to one frequency. Needs the output off."""
    AFG1022_MODEL.check_frequency(Shape.SINE, start_hz)
    AFG1022_MODEL.check_frequency(Shape.SINE, stop_hz)
    header = f"SOUR{channel}:FREQ"
    try:
        settings.set_number(f"{header}:STAR", start_hz, f"{start_hz:.6f}", _FREQUENCY)
        settings.set_number(f"{header}:STOP", stop_hz, f"{stop_hz:.6f}", _FREQUENCY)
        settings.set_word(f"{header}:MODE", "SWE", _SWEEP)
    except (ConnectionError, SettingRefused):
        raise
    except InstrumentError:
        return SweepSupport.UNSUPPORTED
    finally:
        switch_off_modes(settings, channel)
    return SweepSupport.SUPPORTED


def _off_if_known(settings: VerifiedSettings, header: str, word: str, answers: frozenset[str]) -> None:
    settings.port.send(f"{header} {word}")
    reply = settings.port.query(f"{header}?")
    settings.port.complaints()  # an unknown query leaves one behind its empty answer
    if reply and reply.strip('"').upper() not in answers:
        raise SettingRefused(
            f"{settings.name}: {header} was set to {word} and still reads {reply!r}; "
            "the output is off. End that mode on its panel and open the bench again"
        )
