"""A simulated AFG1022 on the simulated USB bus, with a log of its messages and states."""

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import pytest

from vibench.acquisition.rig import GeneratorConfig
from vibench.virtual_rig.generator.afg1022 import AFG1022
from vibench.virtual_rig.generator.channel_output import ChannelSettings
from vibench.virtual_rig.generator.scpi_instrument import Quirks, Reply
from vibench.virtual_rig.generator.scpi_message import ErrorCode
from vibench.virtual_rig.usb.bus import plug_in, unplug
from vibench.virtual_rig.usb.usbtmc import UsbTmcInstrument

_SERIALS = (f"C02{number:04d}" for number in itertools.count(1))


def _nothing(message: bytes) -> None:
    """Do nothing."""


class MessageLog:
    """Logs messages between the USB interface and the instrument."""

    def __init__(self, instrument: AFG1022) -> None:
        self.serial, self.maker, self.model = instrument.serial, instrument.maker, instrument.model
        self.messages: list[str] = []
        self.states: list[ChannelSettings] = []
        self.before: Callable[[bytes], None] = _nothing
        """Called just before a message reaches the instrument."""
        self.after: Callable[[bytes], None] = _nothing
        self._instrument = instrument

    def execute(self, message: bytes) -> Reply:
        self.before(message)
        reply = self._instrument.execute(message)
        self.after(message)
        self.messages.append(message.decode("latin-1").strip())
        self.states.append(self._instrument.settings(1))
        return reply

    def report(self, code: ErrorCode) -> None:
        self._instrument.report(code)

    def commands(self) -> list[str]:
        """Return all messages except queries."""
        return [message for message in self.messages if "?" not in message]

    def forget(self) -> None:
        self.messages.clear()
        self.states.clear()


class Impostor(MessageLog):
    """Another generator model with the same USB address, such as an AFG1062."""

    def execute(self, message: bytes) -> Reply:
        reply = super().execute(message)
        return Reply(b"TEKTRONIX,AFG1062,C1,FV:1\n") if message.startswith(b"*IDN?") else reply


class PanelLoad(MessageLog):
    """A firmware whose load can be read, but can be set only at the panel."""

    def execute(self, message: bytes) -> Reply:
        if message.startswith(b"OUTP1:IMP "):
            self.report(ErrorCode.SYNTAX_ERROR)
            return Reply(b"")
        return super().execute(message)


@dataclass
class PluggedIn:
    """A generator connected to the bus."""

    instrument: AFG1022
    usb: UsbTmcInstrument
    log: MessageLog

    @property
    def config(self) -> GeneratorConfig:
        return GeneratorConfig(
            resource=f"USB0::0x0699::0x0353::{self.instrument.serial}::INSTR",
            connected_ohm=15e3,
            amplitude_limit_vpp=10.0,
        )

    @property
    def is_on(self) -> bool:
        return self.instrument.settings(1).relay.value == "closed"


@dataclass
class Bus:
    """Connects generators to the bus."""

    plugged: list[PluggedIn] = field(default_factory=list)

    def plug_in(self, quirks: Quirks | None = None, listener: type[MessageLog] = MessageLog) -> PluggedIn:
        instrument = AFG1022(lambda: 0.0, serial=next(_SERIALS), quirks=quirks or Quirks())
        log = listener(instrument)
        usb = UsbTmcInstrument(log)
        plug_in(usb)
        self.plugged.append(PluggedIn(instrument, usb, log))
        return self.plugged[-1]


@pytest.fixture
def bus() -> Iterator[Bus]:
    made = Bus()
    yield made
    for plugged in made.plugged:
        unplug(plugged.usb)


@pytest.fixture
def plugged(bus: Bus) -> PluggedIn:
    return bus.plug_in()


@pytest.fixture
def panel_load(bus: Bus) -> PluggedIn:
    return bus.plug_in(listener=PanelLoad)


@pytest.fixture
def impostor(bus: Bus) -> PluggedIn:
    return bus.plug_in(listener=Impostor)
