"""The SCPI dialogue with an instrument, and its errors."""

import errno
from collections import deque

import pytest
import pyvisa

from vibench.acquisition import InstrumentError, InstrumentLost
from vibench.acquisition.drivers._scpi import ScpiInstrument

TIMEOUT = pyvisa.VisaIOError(pyvisa.constants.StatusCode.error_timeout)
LOST = pyvisa.VisaIOError(pyvisa.constants.StatusCode.error_connection_lost)


class Instrument:
    """Answers queries from a table, has an error queue, and fails with `dies_with`."""

    def __init__(self, **answers):
        self.timeout = 3000.0
        self.read_termination = None
        self.answers = {name.replace("_", " "): list(replies) for name, replies in answers.items()}
        self.errors = deque()
        self.written = []
        self.due = deque()
        self.dies_with = None

    def _live(self):
        if self.dies_with is not None:
            raise self.dies_with

    def write(self, message):
        self._live()
        self.written.append(message)
        if message == "SYST:ERR?":
            self.due.append(self.errors.popleft() if self.errors else b'0,"No error"\n')
        elif message.endswith("?"):
            replies = self.answers[message]
            self.due.append(replies.pop(0) if len(replies) > 1 else replies[0])
        return len(message)

    def write_raw(self, message):
        self._live()
        self.written.append(message)
        return len(message)

    def read_bytes(self, count, *, break_on_termchar):
        self._live()
        if not self.due:
            raise TIMEOUT
        reply = self.due.popleft()
        if isinstance(reply, BaseException):
            raise reply
        return reply[:count]

    def close(self):
        self._live()


def port(instrument, **options):
    return ScpiInstrument(lambda: instrument, "the generator", **options)


def test_an_scpi_error_names_the_refused_command_and_every_error_message():
    instrument = Instrument()
    instrument.errors.extend([b'-222,"Data out of range"\n', b'-102,"Syntax error"\n'])
    with pytest.raises(
        InstrumentError, match=r"'FREQ -1'.*Data out of range \(-222\); Syntax error \(-102\)"
    ):
        port(instrument).command("FREQ -1")
    assert instrument.written == ["FREQ -1", "SYST:ERR?", "SYST:ERR?", "SYST:ERR?"]


def test_an_endless_error_queue_raises_an_error():
    instrument = Instrument()
    instrument.errors.extend([b'-102,"Syntax error"\n'] * 1000)
    with pytest.raises(InstrumentError, match=r"still reports errors"):
        port(instrument).command("FREQ 1")


@pytest.mark.parametrize("reply", [b"\n", b"volts\n", b"\xff\xfe\n"])
def test_a_non_numeric_answer_raises_an_error_that_quotes_the_query_and_the_answer(reply):
    instrument = Instrument()
    instrument.answers["FREQ?"] = [reply]
    with pytest.raises(InstrumentError, match=r"FREQ\?.*not a number"):
        port(instrument).query_number("FREQ?")


def test_a_timeout_raises_an_error_that_states_the_waiting_time():
    instrument = Instrument()
    instrument.answers["FREQ?"] = [TIMEOUT]
    with pytest.raises(InstrumentError, match=r"'FREQ\?' within 3 s") as caught:
        port(instrument).query("FREQ?")
    assert not isinstance(caught.value, InstrumentLost)


@pytest.mark.parametrize(
    "death",
    [
        LOST,
        ValueError("[Errno 19] No such device"),
        OSError(errno.EIO, "I/O"),
        Exception("could not connect"),
    ],
)
@pytest.mark.parametrize("act", ["command", "query", "query_codes"])
def test_every_kind_of_error_from_a_lost_device_is_recognised(death, act):
    instrument = Instrument()
    instrument.answers["FREQ?"] = [b"1\n"]
    instrument.dies_with = death
    with pytest.raises(InstrumentLost, match=r"state of its output is unknown"):
        getattr(port(instrument), act)("FREQ?")


def test_a_late_answer_to_an_interrupted_query_is_discarded():
    instrument = Instrument()
    instrument.answers["FREQ?"] = [KeyboardInterrupt()]
    instrument.answers["VOLT?"] = [b"1.5\n"]
    ours = port(instrument)
    with pytest.raises(KeyboardInterrupt):
        ours.query("FREQ?")
    instrument.due.append(b"1000\n")  # the late answer to FREQ?
    assert ours.query("VOLT?") == "1.5"
    assert instrument.timeout == 3000.0


def test_an_scpi_query_can_be_repeated_after_a_timeout():
    instrument = Instrument()
    instrument.answers["FREQ?"] = [TIMEOUT, b"1000\n"]
    ours = port(instrument)
    with pytest.raises(InstrumentError):
        ours.query("FREQ?")
    assert ours.query("FREQ?") == "1000"


@pytest.mark.parametrize(
    "reply", [b"\n", b"123\n", b"#\n", b"#0\n", b"#2x4\x00\x01\n", b"#16\x00\x01\n", b"#13\x00\x01\x02\n"]
)
def test_a_malformed_binary_block_raises_an_error(reply):
    instrument = Instrument()
    instrument.answers["DATA?"] = [reply]
    with pytest.raises(InstrumentError, match=r"block|announced"):
        port(instrument).query_codes("DATA?")


def test_the_required_pause_is_made_after_the_command_and_not_after_its_error_query():
    pauses = []
    instrument = Instrument()
    port(instrument, settle_s=0.1, pause=pauses.append).command("FREQ 1")
    assert pauses == [0.1]
    assert instrument.written == ["FREQ 1", "SYST:ERR?"]
