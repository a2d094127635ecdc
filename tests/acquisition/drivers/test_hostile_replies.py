"""Impossible replies of instruments give a short error and leave the output off."""

import socket
import threading
from contextlib import ExitStack, contextmanager, suppress

import numpy as np
import pytest

from vibench.acquisition import Block, InstrumentError, InstrumentLost, open_bench
from vibench.acquisition.drivers import AFG1022X, DaqmxDigitizer
from vibench.acquisition.drivers._daqmx import linear_step_v
from vibench.acquisition.drivers._scpi import ScpiInstrument, open_link
from vibench.acquisition.instruments import Overload, read_block
from vibench.virtual_rig import VirtualRig
from vibench.virtual_rig.daqmx.data_calls import DATA_CALLS
from vibench.virtual_rig.generator.scpi_instrument import Reply

from .conftest import MessageLog

LONGEST_SENTENCE = 2000
REPLIES = {
    "escapes": b"\x1b[2J\x1b]52;c;QUFB\x07\n",
    "binary": bytes(range(256)),
    "two megabytes": b"A" * 2_000_000 + b"\n",
    "six thousand digits": b"9" * 6000 + b"\n",
    "a code of six thousand digits": b"-" + b"1" * 6000 + b',"x"\n',
    "infinite": b"1e999\n",
    "not a number": b"NAN\n",
    "truncated block": b"#9999",
    "true": b"TRUE\n",
    "complaint with escapes": b'-113,"\x1b[2J\x07"\n',
    "long complaint": b'-113,"' + b"x" * 280 + b'"\n',
}
QUERIES = ("SYST:ERR?", "VOLT?", "FREQ?", "STAT?", "DATA:DATA?")


class HostileGenerator(MessageLog):
    """A generator that gives a chosen reply to one query once ``query`` is set."""

    query = ""
    answer = b""

    def execute(self, message):
        reply = super().execute(message)
        is_wanted = self.query and self.query in message.decode("latin-1")
        return Reply(self.answer) if is_wanted and reply.data else reply


@pytest.mark.parametrize("query", QUERIES)
@pytest.mark.parametrize("name", REPLIES)
def test_a_generator_with_hostile_replies_is_switched_off_in_the_end(bus, name, query):
    plugged = bus.plug_in(listener=HostileGenerator)
    generator = AFG1022X.open(plugged.config)
    generator.load_sine(100.0, 1.0)
    generator.start()
    plugged.log.query, plugged.log.answer = query, REPLIES[name]
    said = []
    for act in (
        lambda: generator.set_amplitude(0.5),
        lambda: generator.load_waveform(np.sin(np.arange(64) * np.pi / 32), 100.0, 1.0),
        generator.close,
    ):
        try:
            act()
        except InstrumentError as error:
            said.append(str(error))
    assert said
    assert max(map(len, said)) < LONGEST_SENTENCE
    assert not plugged.is_on


@pytest.mark.parametrize("name", [name for name in REPLIES if "complaint" not in name])
def test_a_hostile_identity_reply_is_refused_with_a_short_error(bus, name):
    plugged = bus.plug_in(listener=HostileGenerator)
    plugged.log.query, plugged.log.answer = "*IDN?", REPLIES[name]
    with pytest.raises(InstrumentError) as refused:
        AFG1022X.open(plugged.config)
    assert len(str(refused.value)) < LONGEST_SENTENCE
    assert not plugged.is_on


@contextmanager
def endless_instrument():
    """Serve an instrument on a socket that answers the first query without end; yields its address."""
    server = socket.create_server(("127.0.0.1", 0))

    def babble():
        with suppress(OSError):
            client, _ = server.accept()
            with client:
                client.recv(100)
                while True:
                    client.sendall(b"A" * 65536)

    thread = threading.Thread(target=babble)
    thread.start()
    try:
        yield f"TCPIP0::127.0.0.1::{server.getsockname()[1]}::SOCKET"
    finally:
        server.close()
        thread.join()


def test_an_endless_reply_raises_an_error():
    with endless_instrument() as resource:
        instrument = ScpiInstrument(lambda: open_link(resource, "@py"), "the generator")
        try:
            with pytest.raises(InstrumentError, match=r"\*IDN\? was answered with more than 300 bytes"):
                instrument.query("*IDN?")
        finally:
            instrument.disconnect()


COUNTS = {
    "none": lambda counts: [],
    "fewer": lambda counts: counts[:-1],
    "more": lambda counts: counts * 2,
}


@pytest.mark.parametrize("announced", [0, -1, 1])
@pytest.mark.parametrize("sent", COUNTS)
def test_a_wrong_number_of_samples_raises_an_error(rig, monkeypatch, sent, announced):
    usual = DATA_CALLS["ReadBinaryI32"]

    def read(system, request):
        fields = usual(system, request)
        counts, announced_samples = COUNTS[sent](fields["read_array"]), fields["samps_per_chan_read"]
        return fields | {"read_array": counts, "samps_per_chan_read": announced_samples + announced}

    monkeypatch.setitem(DATA_CALLS, "ReadBinaryI32", read)
    with open_bench(rig) as bench:
        bench.digitizer.start()
        with pytest.raises(InstrumentError, match=r"were requested|reply cannot be used"):
            bench.digitizer.read(64)


def test_a_call_that_fails_with_a_success_code_raises_an_error(rig):
    with VirtualRig(rig) as virtual:
        virtual.faults.fail_daq("StartTask", 0)
        connected = rig.daq.model_copy(update={"server": virtual.daq_address})
        digitizer = DaqmxDigitizer.open(rig.model_copy(update={"daq": connected}))
        with pytest.raises(InstrumentError, match="reply cannot be used"):
            digitizer.start()
        virtual.faults.heal()
        digitizer.close()


class Converter:
    """A converter that reports an overload of an unknown channel."""

    roles = ("drive_voltage",)

    def read(self, samples):
        return Block(0, np.zeros((1, samples)), (Overload("\x1b[2J" * 1000, 0, 1),))


def test_an_overload_reported_for_an_unknown_channel_raises_an_error():
    with pytest.raises(InstrumentError, match="reports overloads of") as refused:
        read_block(Converter(), 8)
    assert str(refused.value).isprintable()
    assert len(str(refused.value)) < LONGEST_SENTENCE


def test_a_non_numeric_scale_gives_no_converter_step():
    assert linear_step_v([0.0, 1e-6, 0.0], 5.0) == 1e-6
    assert linear_step_v([0.0, 1e-6, float("nan")], 5.0) is None
    assert linear_step_v([float("nan"), 1e-6], 5.0) is None


def test_a_port_that_never_accepts_a_connection_is_reported_as_a_lost_instrument():
    """pyvisa-py raises a bare Exception when connecting takes too long."""
    with ExitStack() as closing:
        listener = closing.enter_context(socket.create_server(("127.0.0.1", 0), backlog=0))
        for _ in range(4):
            waiting = closing.enter_context(socket.socket())
            waiting.setblocking(False)
            waiting.connect_ex(listener.getsockname())
        resource = f"TCPIP0::127.0.0.1::{listener.getsockname()[1]}::SOCKET"
        with pytest.raises(InstrumentLost, match=r"^no instrument answers at TCPIP0::127.*Check the instr"):
            open_link(resource, "@py", timeout_s=0.3)
