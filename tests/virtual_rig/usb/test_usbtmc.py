import struct

import pytest
from hypothesis import given, strategies as st

from vibench.virtual_rig.generator.afg1022 import AFG1022
from vibench.virtual_rig.usb.usbtmc import UsbTmcInstrument

TIMEOUT_MS = 2000


class Host:
    """The host's side of USBTMC, written independently from the standard."""

    def __init__(self):
        self.generator = AFG1022(lambda: 0.0)
        self.device = UsbTmcInstrument(self.generator)
        self.tag = 0

    def header(self, message_id, length, attributes):
        self.tag = self.tag % 255 + 1
        return struct.pack("<BBBBIB3x", message_id, self.tag, ~self.tag & 255, 0, length, attributes)

    def write(self, payload, end=True):
        padding = bytes(-len(payload) % 4)
        self.device.bulk_out(self.header(1, len(payload), int(end)) + payload + padding)

    def request(self, length):
        self.device.bulk_out(self.header(2, length, 0))

    def read(self, length=1024, buffer=2048):
        """Read one transfer: its payload, and whether the message ends with it."""
        self.request(length)
        transfer = self.device.bulk_in(buffer, TIMEOUT_MS)
        message_id, tag, inverse, _, size, attributes = struct.unpack_from("<BBBBIB", transfer)
        assert (message_id, tag, inverse) == (2, self.tag, ~self.tag & 255)
        assert len(transfer) % 4 == 0
        return transfer[12 : 12 + size], bool(attributes & 1)

    def ask(self, message):
        self.write(message)
        return self.read()[0]

    def control(self, request, value=0, length=64):
        return self.device.control(request, value, length)


@given(st.integers(1, 40))
def test_a_message_may_come_in_pieces_of_any_size(size):
    host = Host()
    message = b"SOUR1:FREQ 1234;:SOUR1:FREQ?"
    pieces = [message[i : i + size] for i in range(0, len(message), size)]
    for number, piece in enumerate(pieces, start=1):
        host.write(piece, end=number == len(pieces))
    assert host.read() == (b"1.234E+03\n", True)


@given(st.integers(1, 60))
def test_a_reply_may_be_fetched_in_pieces_and_only_the_last_piece_ends_the_message(size):
    host = Host()
    identity = host.ask(b"*IDN?")
    host.write(b"*IDN?")
    collected, ends = b"", False
    while not ends:
        piece, ends = host.read(length=size)
        collected += piece
        assert ends == (collected == identity)


@given(st.integers(12, 64))
def test_a_transfer_larger_than_the_buffer_of_the_host_continues_in_the_next_read(buffer):
    host = Host()
    identity = host.ask(b"*IDN?")
    host.write(b"*IDN?")
    host.request(1024)
    transfer = b""
    while len(transfer) < 12 + len(identity):
        transfer += host.device.bulk_in(buffer, TIMEOUT_MS)
    assert transfer[12 : 12 + len(identity)] == identity


def test_a_new_message_discards_an_unread_reply_and_queues_an_error():
    host = Host()
    host.write(b"*IDN?")
    assert host.ask(b"SYST:ERR?") == b'-410,"Query INTERRUPTED"\n'


def test_a_read_without_a_query_times_out_and_queues_an_error():
    host = Host()
    with pytest.raises(TimeoutError):
        host.read()
    assert host.ask(b"SYST:ERR?") == b'-420,"Query UNTERMINATED"\n'


def test_a_late_reply_times_out_and_arrives_at_a_later_read():
    host = Host()
    host.generator.delay_next_reply(5.0)
    host.write(b"*OPC?")
    for _ in range(2):  # twice 2 s of the 5 s delay
        with pytest.raises(TimeoutError):
            host.read()
    assert host.read() == (b"1\n", True)


def test_an_aborted_read_ends_with_a_short_packet_and_leaves_the_reply():
    host = Host()
    host.generator.delay_next_reply(1.0)
    host.write(b"*OPC?")
    host.request(100)
    assert host.control(3, value=host.tag, length=2) == bytes([1, host.tag])
    assert host.device.bulk_in(64, TIMEOUT_MS) == b""
    assert host.control(4, length=8)[0] == 1
    assert host.read()[0] == b"1\n"


def test_aborting_a_read_that_was_not_started_is_refused():
    assert Host().control(3, value=9, length=2)[0] == 0x81


def test_the_capabilities_state_488_2_without_remote_control_or_trigger():
    answer = Host().control(7, length=0x18)
    assert len(answer) == 0x18
    assert answer[0] == 1
    assert answer[14] & 0b111 == 0b100


@pytest.mark.parametrize("start", [b"", b"\1\1\1\0", b"\x63\1\xfe\0", b"\x80\1\xfe\0"])
def test_a_malformed_transfer_or_trigger_stalls_the_endpoint(start):
    host = Host()
    with pytest.raises(BrokenPipeError):
        host.device.bulk_out(start and start + bytes(8))
    assert host.ask(b"*OPC?") == b"1\n"


@pytest.mark.parametrize("request_number", [1, 5, 64, 99, 128, 160])
def test_an_unsupported_class_request_stalls_the_endpoint(request_number):
    with pytest.raises(BrokenPipeError):
        Host().control(request_number)
