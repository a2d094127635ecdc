"""The commands of the whole instrument: IEEE 488.2, system, and those that join both channels."""

from collections.abc import Callable

from ._scpi_command import Command, Generator, Parameters, none, only
from ._scpi_header import HeaderPattern
from ._scpi_status import BYTE, ErrorCode, ScpiError, Status
from ._scpi_value import boolean, integer

SCPI_VERSION = b"1999.0"
SAVED_SETUPS = 5


def _action(pattern: str, act: Callable[[Generator], None]) -> Command:
    """Return the entry of a command without parameters."""

    def write(generator: Generator, _: int, parameters: Parameters) -> None:
        none(parameters)
        act(generator)

    return Command(HeaderPattern(pattern), write, None)


def _report(pattern: str, tell: Callable[[Generator], bytes]) -> Command:
    """Return the entry of a query without parameters."""

    def ask(generator: Generator, _: int, parameters: Parameters) -> bytes:
        none(parameters)
        return tell(generator)

    return Command(HeaderPattern(pattern), None, ask)


def _decimal(value: int) -> bytes:
    return str(int(value)).encode("ascii")


def _register(pattern: str, get: Callable[[Status], int], put: Callable[[Status, int], None]) -> Command:
    """Return the entry of an enable register, 0..255."""

    def write(generator: Generator, _: int, parameters: Parameters) -> None:
        value = integer(only(parameters))
        if not 0 <= value <= BYTE:
            raise ScpiError(ErrorCode.DATA_OUT_OF_RANGE)
        put(generator.status, value)

    return Command(HeaderPattern(pattern), write, lambda generator, *_: _decimal(get(generator.status)))


def _enable_events(status: Status, value: int) -> None:
    status.event_enable = value


def _enable_service(status: Status, value: int) -> None:
    status.service_enable = value


def _next_error(generator: Generator) -> bytes:
    code = generator.status.next_error()
    return f'{int(code)},"{code.text}"'.encode("ascii")


def _setup_number(parameters: Parameters) -> int:
    number = integer(only(parameters))
    if not 0 <= number < SAVED_SETUPS:
        raise ScpiError(ErrorCode.DATA_OUT_OF_RANGE)
    return number


def _lock(generator: Generator, channel: int, parameters: Parameters) -> None:
    generator.lock_frequencies(channel, locked=boolean(only(parameters)))


COMMON_COMMANDS = (
    _report("*IDN", lambda generator: generator.identity()),
    _action("*RST", lambda generator: generator.reset()),
    _action("*CLS", lambda generator: generator.clear_status()),
    _action("*TRG", lambda generator: generator.trigger()),
    _action("*WAI", lambda _: None),
    Command(
        HeaderPattern("*OPC"),
        lambda generator, *_: generator.status.operation_complete(),
        lambda *_: b"1",
    ),
    _report("*TST", lambda _: b"0"),
    _report("*ESR", lambda generator: _decimal(generator.status.take_events())),
    _report("*STB", lambda generator: _decimal(generator.status.byte)),
    _register("*ESE", lambda status: status.event_enable, _enable_events),
    _register("*SRE", lambda status: status.service_enable, _enable_service),
    Command(HeaderPattern("*SAV"), lambda generator, _, given: generator.save(_setup_number(given)), None),
    Command(HeaderPattern("*RCL"), lambda generator, _, given: generator.recall(_setup_number(given)), None),
    _report("SYSTem:ERRor[:NEXT]", _next_error),
    _report("SYSTem:VERSion", lambda _: SCPI_VERSION),
    _action("[SOURce#:]PHASe:INITiate", lambda generator: generator.align_phases()),
    Command(
        HeaderPattern("[SOURce#:]FREQuency:CONCurrent[:STATe]"),
        _lock,
        lambda generator, *_: b"1" if generator.frequencies_are_locked else b"0",
    ),
)
