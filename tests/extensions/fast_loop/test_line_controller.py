"""A controller on a socket that sends invalid lines."""

import pytest

from vibench.acquisition import InstrumentError
from vibench.acquisition.rig import ControllerConfig
from vibench_fast_loop.line_controller import LineController


class Link:
    """A session that answers every request with one line."""

    def __init__(self, line):
        self.line = line

    def write(self, message):
        return len(message)

    def read_bytes(self, count, *, break_on_termchar):
        assert break_on_termchar
        return self.line[:count]


@pytest.mark.parametrize(
    "line",
    [b"\n", b"\x1b[2J\n", b"[" * 3_000_000, b"1" * 3_000_000, b'{"name": NaN}\n', b"\xff\n", b'"refused"\n'],
    ids=["empty", "escapes", "nested", "digits", "nan", "bytes", "text"],
)
def test_an_invalid_report_line_raises_a_single_error(line):
    config = ControllerConfig(rate_hz=10_240, latency_s=3e-4, limit_v=2, source="test")
    with pytest.raises(InstrumentError, match="does not speak loop protocol"):
        LineController(Link(line), config)
