"""How a DAQmx attribute travels: numbers to names, names to getters and setters, values to messages."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Generic, TypeVar

from nidaqmx._stubs import nidaqmx_pb2
from nidaqmx.error_codes import DAQmxErrors

from ._errors import DaqmxRefusal

Subject = TypeVar("Subject")

_OF_ALL_TYPES = "Attribute"
_RESET_LIST = "ResetAttribute"
_NAME_MARK = "_ATTRIBUTE_"


@dataclass(frozen=True)
class Attribute(Generic[Subject]):
    """One property: how to read it and, if it can be written, how to write and reset it."""

    get: Callable[[Subject], object]
    set: Callable[[Subject, Any], None] | None = None
    initial: object = None
    """What a reset writes; None if it cannot be reset."""


Attributes = Mapping[str, Attribute[Subject]]


def not_supported(name: str, where: str) -> DaqmxRefusal:
    """Refuse an attribute that this device, channel or task does not have (-200197)."""
    return DaqmxRefusal(DAQmxErrors.ATTR_NOT_SUPPORTED, f"Property: {name}\n{where}")


def _names_of(group: str) -> dict[int, str]:
    """``"SAMP_CLK_RATE"`` and so on by number, as NI's protocol file spells them."""
    return {
        value.number: value.name.rpartition(_NAME_MARK)[2]
        for name, descriptor in nidaqmx_pb2.DESCRIPTOR.enum_types_by_name.items()
        if name.startswith(group) and name.endswith(_OF_ALL_TYPES) and not name.endswith(_RESET_LIST)
        for value in descriptor.values
        if value.number
    }


class AttributeGroup(Generic[Subject]):
    """The attributes of one kind of thing, read and written by number."""

    def __init__(self, group: str, attributes: Attributes[Subject]) -> None:
        """``group``: ``"Device"``, ``"Channel"``, ``"Timing"``, ... as the protocol's enums begin."""
        self._group = group
        self._names = _names_of(group)
        self._attributes = attributes

    def _find(self, number: int) -> tuple[str, Attribute[Subject]]:
        name = self._names.get(number, f"0x{number:X}")
        if name not in self._attributes:
            raise not_supported(f"{self._group}.{name}", "The simulated driver does not have it.")
        return name, self._attributes[name]

    def get(self, subject: Subject, number: int) -> object:
        """Value of the attribute (-200197 for one that is not known)."""
        return self._find(number)[1].get(subject)

    def set(self, subject: Subject, number: int, value: object) -> None:
        """Write the attribute."""
        name, attribute = self._find(number)
        if attribute.set is None:
            raise not_supported(f"{self._group}.{name}", "It can only be read.")
        attribute.set(subject, value)

    def reset(self, subject: Subject, number: int) -> None:
        """Give the attribute its first value again."""
        name, attribute = self._find(number)
        if attribute.set is None or attribute.initial is None:
            raise not_supported(f"{self._group}.{name}", "It cannot be reset.")
        attribute.set(subject, attribute.initial)


def number_of(request: Any) -> int:
    """Tell the number of the attribute a request names."""
    return int(request.attribute_raw or request.attribute)


def value_of(request: Any) -> object:
    """Value a request carries; enums travel in a field of their own."""
    if "value_raw" in request.DESCRIPTOR.fields_by_name:
        return request.value_raw or request.value
    return request.value


def fields_for(response: Any, value: object) -> Mapping[str, object]:
    """Put a value into the fields of a response, whatever they are called and however often they repeat."""
    fields = response.fields_by_name
    name = "value_raw" if "value_raw" in fields else "value"
    if fields[name].is_repeated:
        return {name: [_plain(item) for item in _listed(value)]}
    return {name: _plain(value)}


def _listed(value: object) -> Iterable[object]:
    match value:
        case list() | tuple():
            return value
        case _:
            return [value]


def _plain(value: object) -> object:
    match value:
        case Enum():
            return value.value
        case _:
            return value
