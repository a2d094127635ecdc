"""Driver of a real-time controller that exchanges JSON lines over a socket (`vibench_fast_loop.protocol`)."""

import json
from typing import Self, TypeVar

from pydantic import BaseModel

from vibench.acquisition.drivers import Link, open_link
from vibench.acquisition.errors import ConfigurationError, InstrumentError, InstrumentLost
from vibench.acquisition.instruments import Identity
from vibench.acquisition.rig import ControllerConfig

from .protocol import LoopFacts, LoopProgram, LoopReport, LoopRequest

_PART = 0.01
"""Largest relative deviation of the controller's rate, limit and watchdog time from the configuration."""
_LEAVING_S = 0.1
_LONGEST_LINE = 1_000_000
"""Longest answer that is read [bytes], because a faulty controller may never end its line."""
Answer = TypeVar("Answer", bound=BaseModel)


class LineController:
    """The host's end of a connection to a real-time controller."""

    def __init__(self, link: Link, config: ControllerConfig) -> None:
        self._link = link
        self._config = config
        self._is_open = True
        self.facts = self._request(LoopRequest(ask="hello"), LoopFacts)

    @classmethod
    def open(cls, config: ControllerConfig) -> Self:
        """Connect, silence the output, and check the controller against its configuration."""
        if not config.resource:
            raise ConfigurationError(
                "controller.resource is empty, which is allowed only on a virtual rig; give "
                "TCPIP0::<host>::<port>::SOCKET in the hardware configuration"
            )
        controller = cls(open_link(config.resource, config.visa_library), config)
        controller.silence(_LEAVING_S)
        facts = controller.facts
        different = abs(facts.rate_hz / config.rate_hz - 1) > _PART or facts.limit_v > config.limit_v * (
            1 + _PART
        )
        different = different or facts.pd_of != config.pd_of
        if different or facts.watchdog_s > config.watchdog_s * (1 + _PART):
            controller.close()
            raise ConfigurationError(
                f"{facts.name} at {config.resource} has a rate of {facts.rate_hz:g} Hz, a limit of "
                f"{facts.limit_v:g} V, a watchdog time of {facts.watchdog_s:g} s and {_laws(facts)}; the "
                f"configuration has {config.rate_hz:g} Hz, {config.limit_v:g} V, {config.watchdog_s:g} s and "
                f"{_laws(config)}. The controller's output is off; make the two agree"
            )
        return controller

    @property
    def identity(self) -> Identity:
        """Identity of the controller, with its serial number."""
        facts = self.facts
        return Identity("", facts.name, facts.serial, f"loop {facts.vibench_loop}", facts.model_dump_json())

    def play(self, program: LoopProgram) -> LoopReport:
        """Make the controller play another program; return the controller's report."""
        return self._request(LoopRequest(ask="play", program=program), LoopReport)

    def report(self) -> LoopReport:
        """Return the controller's state, and the blocks measured since the last report."""
        return self._request(LoopRequest(ask="report"), LoopReport)

    def silence(self, ramp_s: float) -> LoopReport:
        """Ramp the output down to silence; return the controller's report."""
        return self._request(LoopRequest(ask="silence", ramp_s=ramp_s), LoopReport)

    def close(self) -> None:
        """Silence the output and close the connection. If this fails, the watchdog silences the output."""
        if self._is_open:
            try:
                self.silence(_LEAVING_S)
            finally:
                self._is_open = False
                self._link.close()

    def _request(self, request: LoopRequest, kind: type[Answer]) -> Answer:
        where = self._config.resource
        if not self._is_open:
            raise InstrumentError(
                f"the connection to the real-time controller at {where} was closed during the request "
                f"{request.ask}. The controller's output is off; open the bench again"
            )
        try:
            self._link.write(request.model_dump_json(exclude_defaults=False))
            line = self._link.read_bytes(_LONGEST_LINE, break_on_termchar=True)
        except MemoryError:  # the caller releases its memory reserve
            raise
        except Exception as error:  # pyvisa-py does not catch socket errors
            raise InstrumentLost(
                f"the real-time controller at {where} does not answer ({error}). Its watchdog silences its "
                f"output after {self._config.watchdog_s:g} s; check its power and its network"
            ) from error
        try:
            answer = json.loads(line)
            if isinstance(answer, dict) and "refused" in answer:
                raise InstrumentError(f"the real-time controller at {where} refused: {answer['refused']}")
            return kind.model_validate_json(line)
        except (ValueError, RecursionError) as error:  # ValueError includes pydantic's errors
            raise InstrumentError(
                f"the program at {where} does not speak loop protocol {request.vibench_loop} "
                f"({error}); correct controller.resource, or name its driver in controller.driver"
            ) from error


def _laws(facts: LoopFacts | ControllerConfig) -> str:
    return "any linear law" if facts.pd_of is None else f"proportional and derivative laws of {facts.pd_of}"
