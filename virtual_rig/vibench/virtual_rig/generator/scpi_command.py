"""Rows of a generator's command table: what a header sets, what its query answers, and who says so."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any

from .afg1022_settings import ChannelSettings
from .scpi_header import HeaderPattern, mnemonic_matches, short_form
from .scpi_message import INFINITE, as_number, boolean, number as value_of, text
from .scpi_status import ErrorCode, ScpiError

CHANNELS = 2
_RANGE_ROUNDING = 1e-9
"""Relative slack at the ends of a range, for numbers that arrive in another unit."""

Parameters = tuple[bytes, ...]
Setter = Callable[[Any, int, Parameters], None]
"""Takes the generator, the channel, and what was sent."""
Query = Callable[[Any, int, Parameters], bytes]


@dataclass(frozen=True)
class Command:
    """One row; without ``write`` it can only be asked for, without ``ask`` only be sent."""

    header: str
    """As manuals print it, see `HeaderPattern`."""
    source: str
    """Where its behaviour is described."""
    write: Setter | None
    ask: Query | None
    channels: int = CHANNELS
    """The highest numeric suffix."""

    @property
    def pattern(self) -> HeaderPattern:
        """What matches a header that a program sends."""
        return HeaderPattern(self.header)


def number(
    header: str,
    source: str,
    field: str,
    units: Mapping[str, float],
    limits: Callable[[ChannelSettings], tuple[float, float]],
    default: float,
    decimals: int,
    *,
    channels: int = CHANNELS,
    scale: Callable[[ChannelSettings], float] = lambda _: 1.0,
    largest: float = math.nan,
) -> Command:
    """Return the row of a number: a ``field`` of the settings, in ``units``, kept to so many ``decimals``.

    ``scale`` is the displayed number over the field's. A number of ``INFINITE`` sets ``largest``, if given.
    """

    def write(generator: Any, channel: int, parameters: Parameters) -> None:
        settings = generator.settings(channel)
        shown = value_of(only(parameters), units)
        low, high = limits(settings)
        if shown >= INFINITE and not math.isnan(largest):
            shown = largest
        elif low - _RANGE_ROUNDING * abs(low) <= shown <= high + _RANGE_ROUNDING * abs(high):
            shown = round(shown, decimals)
        elif generator.quirks.out_of_range_becomes_default:
            shown = min(max(default, low), high)
        else:
            raise ScpiError(ErrorCode.DATA_OUT_OF_RANGE)
        generator.configure(channel, replace(settings, **{field: shown / scale(settings)}))

    def ask(generator: Any, channel: int, parameters: Parameters) -> bytes:
        none(parameters)
        settings = generator.settings(channel)
        shown = getattr(settings, field) * scale(settings)
        return as_number(INFINITE if math.isinf(shown) else shown)

    return Command(header, source, write, ask, channels)


def choice(
    header: str,
    source: str,
    words: type[Enum],
    get: Callable[[ChannelSettings], Enum],
    put: Callable[[ChannelSettings, Any], ChannelSettings],
    channels: int = CHANNELS,
) -> Command:
    """Return the row of a setting that is one of several words, the values of an enum."""

    def write(generator: Any, channel: int, parameters: Parameters) -> None:
        word = text(only(parameters))
        for candidate in words:
            if mnemonic_matches(word, candidate.value):
                generator.configure(channel, put(generator.settings(channel), candidate))
                return
        raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)

    def ask(generator: Any, channel: int, parameters: Parameters) -> bytes:
        none(parameters)
        return short_form(get(generator.settings(channel)).value).encode("ascii")

    return Command(header, source, write, ask, channels)


def switch(
    header: str,
    source: str,
    get: Callable[[ChannelSettings], bool],
    put: Callable[[ChannelSettings, bool], ChannelSettings],
    channels: int = CHANNELS,
) -> Command:
    """Return the row of something that is on or off."""

    def write(generator: Any, channel: int, parameters: Parameters) -> None:
        generator.configure(channel, put(generator.settings(channel), boolean(only(parameters))))

    def ask(generator: Any, channel: int, parameters: Parameters) -> bytes:
        none(parameters)
        return b"1" if get(generator.settings(channel)) else b"0"

    return Command(header, source, write, ask, channels)


def action(header: str, source: str, act: Callable[[Any], None]) -> Command:
    """Return the row of a command without parameters."""

    def write(generator: Any, _: int, parameters: Parameters) -> None:
        none(parameters)
        act(generator)

    return Command(header, source, write, None)


def report(header: str, source: str, tell: Callable[[Any], bytes]) -> Command:
    """Return the row of a query without parameters."""

    def ask(generator: Any, _: int, parameters: Parameters) -> bytes:
        none(parameters)
        return tell(generator)

    return Command(header, source, None, ask)


def exactly(parameters: Parameters, count: int) -> Parameters:
    """Return the parameters if there are as many as a command takes; -109 or -108 otherwise."""
    if len(parameters) < count or not all(parameters):
        raise ScpiError(ErrorCode.MISSING_PARAMETER)
    if len(parameters) > count:
        raise ScpiError(ErrorCode.PARAMETER_NOT_ALLOWED)
    return parameters


def only(parameters: Parameters) -> bytes:
    """Return the one parameter that a command takes."""
    return exactly(parameters, 1)[0]


def none(parameters: Parameters) -> None:
    """Refuse parameters where none belong."""
    if parameters:
        raise ScpiError(ErrorCode.PARAMETER_NOT_ALLOWED)
