"""What makes an AFG1022 play other than on and on: switched off, or on request a burst."""

from ..errors import InstrumentError, LimitExceeded, SettingRefused
from ._generator_limits import AFG1022_MODEL, GeneratorModel
from ._verified_settings import Tolerance, VerifiedSettings

_OFF = frozenset({"0", "OFF"})
_ON = frozenset({"1", "ON"})
_CONTINUOUS = frozenset({"CW", "FIX", "FIXED"})
_MODULATIONS = ("AM", "FM", "PM", "FSK", "PWM", "ASK", "PSK")
_BURST_CHANNEL = 1
_EXACT = Tolerance(absolute=0.0, relative=0.0)


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


def _off_if_known(settings: VerifiedSettings, header: str, word: str, answers: frozenset[str]) -> None:
    settings.port.send(f"{header} {word}")
    reply = settings.port.query(f"{header}?")
    settings.port.complaints()  # an unknown query leaves one behind its empty answer
    if reply and reply.strip('"').upper() not in answers:
        raise SettingRefused(
            f"{settings.name}: {header} was set to {word} and still reads {reply!r}; "
            "the output is off. End that mode on its panel and open the bench again"
        )
