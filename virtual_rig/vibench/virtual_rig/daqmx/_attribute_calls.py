"""The 150 Get, Set and Reset calls for attributes, made from the protocol's own description of them."""

import re
from collections.abc import Callable
from typing import Any

from nidaqmx._stubs import nidaqmx_pb2

from ._attributes import Attribute, AttributeGroup, fields_for, not_supported, number_of, value_of
from ._calls import NOTHING, Call, Fields
from ._channel_attributes import get_attribute, reset_attribute, set_attribute
from ._channels import Channel
from ._device_attributes import CALIBRATION, DEVICE, PHYSICAL_CHANNEL, SYSTEM
from ._scales import LinearScale, PolynomialScale, Scale, TableScale
from ._system import DaqmxSystem
from ._task_attributes import BUFFER, READ, TASK, TIMING, TRIGGER, WRITE
from ._tasks import Task


def _linear(scale: Scale) -> LinearScale:
    match scale:
        case LinearScale():
            return scale
        case _:
            raise not_supported("Scale.LIN", f"Scale: {scale.name} ({scale.kind.name})")


def _table(scale: Scale) -> TableScale:
    match scale:
        case TableScale():
            return scale
        case _:
            raise not_supported("Scale.TABLE", f"Scale: {scale.name} ({scale.kind.name})")


def _polynomial(scale: Scale) -> PolynomialScale:
    match scale:
        case PolynomialScale():
            return scale
        case _:
            raise not_supported("Scale.POLY", f"Scale: {scale.name} ({scale.kind.name})")


SCALE: AttributeGroup[Any] = AttributeGroup(
    "Scale",
    {
        "DESCR": Attribute(lambda _: ""),
        "SCALED_UNITS": Attribute(lambda scale: scale.scaled_units),
        "PRE_SCALED_UNITS": Attribute(lambda scale: scale.pre_scaled_units),
        "TYPE": Attribute(lambda scale: scale.kind),
        "LIN_SLOPE": Attribute(lambda scale: _linear(scale).slope),
        "LIN_Y_INTERCEPT": Attribute(lambda scale: _linear(scale).intercept),
        "TABLE_PRE_SCALED_VALS": Attribute(lambda scale: _table(scale).pre_scaled),
        "TABLE_SCALED_VALS": Attribute(lambda scale: _table(scale).scaled),
        "MAP_PRE_SCALED_MIN": Attribute(lambda scale: _table(scale).pre_scaled[0]),
        "MAP_PRE_SCALED_MAX": Attribute(lambda scale: _table(scale).pre_scaled[-1]),
        "MAP_SCALED_MIN": Attribute(lambda scale: _table(scale).scaled[0]),
        "MAP_SCALED_MAX": Attribute(lambda scale: _table(scale).scaled[-1]),
        "POLY_FORWARD_COEFF": Attribute(lambda scale: _polynomial(scale).forward_coefficients),
        "POLY_REVERSE_COEFF": Attribute(lambda scale: _polynomial(scale).reverse_coefficients),
    },
)
SERVICE = nidaqmx_pb2.DESCRIPTOR.services_by_name["NiDAQmx"]
_CALL = re.compile(r"^(?P<verb>Get|Set|Reset)(?P<scope>[A-Za-z]+?)Attribute(?:Ex)?(?P<type>[A-Z]\w*)?$")

Subject = Callable[[Any], Any]


class AttributeCalls:
    """Every attribute call of the groups the simulated driver has."""

    def __init__(self, system: DaqmxSystem) -> None:
        """Work on that system."""
        self._system = system
        self._groups: dict[str, tuple[AttributeGroup[Any], Subject]] = {
            "SystemInfo": (SYSTEM, lambda _: system.description),
            "Device": (DEVICE, lambda request: system.device(request.device_name)),
            "CalInfo": (CALIBRATION, lambda request: system.device(request.device_name)),
            "PhysicalChan": (PHYSICAL_CHANNEL, lambda request: system.physical(request.physical_channel)),
            "Scale": (SCALE, lambda request: system.scale(request.scale_name)),
            "Task": (TASK, self._task),
            "Timing": (TIMING, self._task),
            "Trig": (TRIGGER, self._task),
            "Read": (READ, self._task),
            "Write": (WRITE, self._task),
            "Buffer": (BUFFER, self._task),
        }

    def calls(self) -> dict[str, Call]:
        """Give the calls by their name in the protocol."""
        made: dict[str, Call] = {}
        for method in SERVICE.methods:
            found = _CALL.match(method.name)
            if found and found["scope"] == "Chan":
                made[method.name] = self._channel_call(found["verb"], method)
            elif found and found["scope"] in self._groups:
                made[method.name] = self._group_call(found["verb"], found["scope"], method)
        return made

    def _task(self, request: Any) -> Task:
        return self._system.task(request.task.name)

    def _group_call(self, verb: str, scope: str, method: Any) -> Call:
        group, subject = self._groups[scope]

        def get(request: Any) -> Fields:
            return fields_for(method.output_type, group.get(subject(request), number_of(request)))

        def write(request: Any) -> Fields:
            self._require_settable(scope, request)
            group.set(subject(request), number_of(request), value_of(request))
            return NOTHING

        def reset(request: Any) -> Fields:
            self._require_settable(scope, request)
            group.reset(subject(request), number_of(request))
            return NOTHING

        return {"Get": get, "Set": write, "Reset": reset}[verb]

    def _require_settable(self, scope: str, request: Any) -> None:
        if scope in ("Timing", "Trig", "Buffer"):
            self._task(request).require_stopped()

    def _channels(self, request: Any) -> list[Channel]:
        task = self._task(request)
        task.require_channels()
        return task.find(request.channel)

    def _channel_call(self, verb: str, method: Any) -> Call:
        def get(request: Any) -> Fields:
            return fields_for(
                method.output_type, get_attribute(self._channels(request)[0], number_of(request))
            )

        def write(request: Any) -> Fields:
            self._task(request).require_stopped()
            for channel in self._channels(request):
                set_attribute(channel, number_of(request), value_of(request))
            return NOTHING

        def reset(request: Any) -> Fields:
            self._task(request).require_stopped()
            for channel in self._channels(request):
                reset_attribute(channel, number_of(request))
            return NOTHING

        return {"Get": get, "Set": write, "Reset": reset}[verb]
