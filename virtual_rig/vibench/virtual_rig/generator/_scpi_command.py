"""One entry of the generator's command table, and the kinds that repeat: numbers, words, switches."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Protocol, TypeVar

from ._afg1022_settings import ChannelSettings
from ._arbitrary_memory import ArbitraryMemory
from ._scpi_header import HeaderPattern, mnemonic_matches, short_form
from ._scpi_status import ErrorCode, ScpiError, Status
from ._scpi_value import INFINITE, Limit, as_number, boolean, number_or_limit, text

CHANNELS = 2
_RANGE_ROUNDING = 1e-9
"""Relative slack at the ends of a range, for numbers that arrive in another unit."""

Parameters = tuple[bytes, ...]


@dataclass(frozen=True)
class Quirks:
    """Documented habits of the family's firmware; the defaults are what FV:V1.0.2 does.

    Sources: hardware reference, sections 1.1, 1.2 and 1.4.
    """

    first_identity_after_clear_is_empty: bool = True
    """The first ``*IDN?`` after ``*CLS`` answers an empty line."""
    high_impedance_has_ohm_sign: bool = True
    """``OUTP:IMP?`` at high impedance answers ``9.9E+37`` and an ohm sign in GBK, which is not ASCII."""
    unknown_is_syntax_error: bool = True
    """An unknown command queues -102; an unknown query also answers an empty line (else -113, silence)."""
    noise_is_not_played: bool = True
    """``FUNC:SHAP PRN`` is accepted and reported, but the shape before it goes on playing."""
    out_of_range_becomes_default: bool = True
    """A number out of range silently sets the parameter's default (else -222, setting unchanged)."""
    dc_ignores_offset: bool = True
    """The built-in DC shape stays at zero whatever the offset."""
    duty_queues_error: bool = True
    """``PULS:DCYC`` works, and queues -102 all the same."""
    load_is_panel_only: bool = False
    """``OUTP:IMP`` is unknown: the load can be set at the front panel only (one driver's report)."""
    sweep_is_unknown: bool = False
    """The sweep commands are unknown."""


class Generator(Protocol):
    """What a command may do to the generator."""

    quirks: Quirks
    status: Status
    memory: ArbitraryMemory

    def settings(self, channel: int) -> ChannelSettings:
        """Return the settings of a channel."""

    def configure(self, channel: int, settings: ChannelSettings) -> None:
        """Check and take over new settings."""

    def memory_changed(self) -> None:
        """Let a changed waveform act at once if it is playing."""

    @property
    def frequencies_are_locked(self) -> bool:
        """Whether both channels share one frequency."""

    def lock_frequencies(self, channel: int, *, locked: bool) -> None:
        """Let the other channel follow the frequency of this one, or not."""

    def identity(self) -> bytes:
        """Return who the instrument is."""

    def reset(self) -> None:
        """Return to the defaults."""

    def clear_status(self) -> None:
        """Empty error queue and event register."""

    def trigger(self) -> None:
        """Start a waiting burst."""

    def align_phases(self) -> None:
        """Start both channels at their start phase now."""

    def save(self, number: int) -> None:
        """Keep the present settings under a number."""

    def recall(self, number: int) -> None:
        """Return to settings that were kept; the outputs are off."""


Setter = Callable[[Generator, int, Parameters], None]
Query = Callable[[Generator, int, Parameters], bytes]


@dataclass(frozen=True)
class Command:
    """A header with what it does and what it answers; either may be missing."""

    pattern: HeaderPattern
    write: Setter | None
    ask: Query | None
    channels: int = CHANNELS
    """The highest numeric suffix."""


Getter = Callable[[ChannelSettings], float]
Putter = Callable[[ChannelSettings, float], ChannelSettings]
Range = Callable[[ChannelSettings], tuple[float, float]]
Reader = Callable[[bytes, Mapping[str, float]], float | Limit]
Word = TypeVar("Word", bound=Enum)


@dataclass(frozen=True)
class Number:
    """A numeric setting: its unit, its range, its default and its resolution."""

    pattern: str
    units: Mapping[str, float]
    get: Getter
    put: Putter
    limits: Range
    default: float
    decimals: int
    """Digits after the point that the instrument keeps."""
    channels: int = CHANNELS
    read: Reader = number_or_limit
    infinity_allowed: Callable[[ChannelSettings], bool] = lambda _: False

    def command(self) -> Command:
        """Return the table entry."""
        return Command(HeaderPattern(self.pattern), self.write, self.ask, self.channels)

    def write(self, generator: Generator, channel: int, parameters: Parameters) -> None:
        """Take a number, or a word that stands for one."""
        settings = generator.settings(channel)
        value = self.read(only(parameters), self.units)
        number = self._meant(value, settings) if isinstance(value, Limit) else value
        infinite = number >= INFINITE and self.infinity_allowed(settings)
        low, high = self.limits(settings)
        if infinite:
            number = math.inf
        elif low - _RANGE_ROUNDING * abs(low) <= number <= high + _RANGE_ROUNDING * abs(high):
            number = round(number, self.decimals)
        elif generator.quirks.out_of_range_becomes_default:
            number = min(max(self.default, low), high)
        else:
            raise ScpiError(ErrorCode.DATA_OUT_OF_RANGE)
        generator.configure(channel, self.put(settings, number))

    def ask(self, generator: Generator, channel: int, parameters: Parameters) -> bytes:
        """Answer the value, or what MIN, MAX or DEF would be."""
        settings = generator.settings(channel)
        if not parameters:
            value = self.get(settings)
        else:
            limit = self.read(only(parameters), self.units)
            if not isinstance(limit, Limit):
                raise ScpiError(ErrorCode.PARAMETER_NOT_ALLOWED)
            value = self._meant(limit, settings)
        return as_number(INFINITE if math.isinf(value) else value)

    def _meant(self, limit: Limit, settings: ChannelSettings) -> float:
        """Return the number a word stands for."""
        low, high = self.limits(settings)
        meaning = {
            Limit.MINIMUM: low,
            Limit.MAXIMUM: high,
            Limit.DEFAULT: min(max(self.default, low), high),
            Limit.INFINITY: math.inf,
        }
        return meaning[limit]


def switch(
    pattern: str,
    get: Callable[[ChannelSettings], bool],
    put: Callable[[ChannelSettings, bool], ChannelSettings],
    channels: int = CHANNELS,
) -> Command:
    """Return the entry of something that is on or off."""

    def write(generator: Generator, channel: int, parameters: Parameters) -> None:
        generator.configure(channel, put(generator.settings(channel), boolean(only(parameters))))

    def ask(generator: Generator, channel: int, parameters: Parameters) -> bytes:
        none(parameters)
        return b"1" if get(generator.settings(channel)) else b"0"

    return Command(HeaderPattern(pattern), write, ask, channels)


def choice(
    pattern: str,
    words: type[Word],
    get: Callable[[ChannelSettings], Word],
    put: Callable[[ChannelSettings, Word], ChannelSettings],
    channels: int = CHANNELS,
) -> Command:
    """Return the entry of a setting that is one of several words (the values of an enum)."""

    def write(generator: Generator, channel: int, parameters: Parameters) -> None:
        word = text(only(parameters))
        for candidate in words:
            if mnemonic_matches(word, candidate.value):
                generator.configure(channel, put(generator.settings(channel), candidate))
                return
        raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)

    def ask(generator: Generator, channel: int, parameters: Parameters) -> bytes:
        none(parameters)
        return short_form(get(generator.settings(channel)).value).encode("ascii")

    return Command(HeaderPattern(pattern), write, ask, channels)


def only(parameters: Parameters) -> bytes:
    """Return the one parameter that a command takes; -109 without, -108 with more."""
    if not parameters or not parameters[0]:
        raise ScpiError(ErrorCode.MISSING_PARAMETER)
    if len(parameters) > 1:
        raise ScpiError(ErrorCode.PARAMETER_NOT_ALLOWED)
    return parameters[0]


def exactly(parameters: Parameters, count: int) -> Parameters:
    """Return the parameters if there are as many as a command takes."""
    if len(parameters) < count:
        raise ScpiError(ErrorCode.MISSING_PARAMETER)
    if len(parameters) > count:
        raise ScpiError(ErrorCode.PARAMETER_NOT_ALLOWED)
    return parameters


def none(parameters: Parameters) -> None:
    """Refuse parameters where none belong."""
    if parameters:
        raise ScpiError(ErrorCode.PARAMETER_NOT_ALLOWED)
