"""The commands of the waveform memories: upload, read back, copy, delete, list (tkafg1k, public drivers)."""

from ._arbitrary_memory import EDIT_MEMORY, big_endian, memory_name
from ._scpi_command import Command, Generator, Parameters, exactly, none, only
from ._scpi_header import HeaderPattern
from ._scpi_status import ErrorCode, ScpiError
from ._scpi_value import as_block, block, integer, text


def _memory(parameter: bytes) -> str:
    name = memory_name(text(parameter))
    if name is None:
        raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)
    return name


def _edit_memory(parameter: bytes) -> None:
    if _memory(parameter) != EDIT_MEMORY:
        raise ScpiError(ErrorCode.ILLEGAL_PARAMETER_VALUE)


def _define(generator: Generator, _: int, parameters: Parameters) -> None:
    target, points = exactly(parameters, 2)
    _edit_memory(target)
    generator.memory.define(integer(points))
    generator.memory_changed()


def _load(generator: Generator, _: int, parameters: Parameters) -> None:
    target, data = exactly(parameters, 2)
    generator.memory.load(_memory(target), block(data))
    generator.memory_changed()


def _read(generator: Generator, _: int, parameters: Parameters) -> bytes:
    return as_block(big_endian(generator.memory.codes(_memory(only(parameters)))))


def _points(generator: Generator, _: int, parameters: Parameters) -> bytes:
    return str(len(generator.memory.codes(_memory(only(parameters))))).encode("ascii")


def _copy(generator: Generator, _: int, parameters: Parameters) -> None:
    target, source = exactly(parameters, 2)
    generator.memory.copy(_memory(source), _memory(target))
    generator.memory_changed()


def _delete(generator: Generator, _: int, parameters: Parameters) -> None:
    name = _memory(only(parameters))
    if any(generator.settings(channel).shape == name for channel in (1, 2)):
        raise ScpiError(ErrorCode.SETTINGS_CONFLICT)
    generator.memory.delete(name)


def _catalogue(generator: Generator, _: int, parameters: Parameters) -> bytes:
    none(parameters)
    return ",".join(f'"{name}"' for name in generator.memory.catalogue).encode("ascii")


def _set_value(generator: Generator, _: int, parameters: Parameters) -> None:
    target, point, code = exactly(parameters, 3)
    _edit_memory(target)
    generator.memory.set_value(integer(point), integer(code))
    generator.memory_changed()


def _value(generator: Generator, _: int, parameters: Parameters) -> bytes:
    target, point = exactly(parameters, 2)
    codes = generator.memory.codes(_memory(target))
    number = integer(point)
    if not 1 <= number <= len(codes):
        raise ScpiError(ErrorCode.DATA_OUT_OF_RANGE)
    return str(codes[number - 1]).encode("ascii")


def _both_roots(rest: str) -> tuple[HeaderPattern, HeaderPattern]:
    return HeaderPattern(f"DATA{rest}"), HeaderPattern(f"TRACe{rest}")


MEMORY_COMMANDS = tuple(
    Command(pattern, write, ask)
    for rest, write, ask in (
        ("[:DATA]", _load, _read),
        ("[:DATA]:VALue", _set_value, _value),
        (":DEFine", _define, None),
        (":POINts", _define, _points),
        (":COPY", _copy, None),
        (":DELete[:NAME]", _delete, None),
        (":CATalog", None, _catalogue),
    )
    for pattern in _both_roots(rest)
)
