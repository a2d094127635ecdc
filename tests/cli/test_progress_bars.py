"""Progress: bars on a terminal, whole lines of text in anything else."""

import io
from threading import Event

from rich.console import Console
from rich.progress import Progress

from vibench.cli.progress_bars import LINE_INTERVAL_S, _bar, progress_line, show_bars
from vibench.sim.background import Progress as Stage


class Log(io.StringIO):
    """A file that records when it was written to."""

    def __init__(self):
        super().__init__()
        self.written = Event()

    def write(self, text):
        count = super().write(text)
        if "\n" in text:
            self.written.set()
        return count


def test_progress_is_printed_as_lines_if_the_output_is_not_a_terminal():
    log = Log()
    with show_bars(Progress(console=Console(file=log, width=200)), interval_s=0.01) as bars:
        assert not log.written.wait(0.1), "a line without a bar"
        bars.update(bars.add_task("noise", total=60), completed=15)
        bars.add_task("opening", total=None)
        log.written.clear()
        assert log.written.wait(10.0)
    # The time distinguishes slow work from a program that hangs.
    assert log.getvalue().splitlines()[-1] == "progress: noise 15 of 60 (25 %); opening, after 0 s"


def test_a_stage_of_unknown_length_shows_no_numbers_of_the_previous_stage():
    bars = Progress(console=Console(file=io.StringIO()))
    with _bar(bars, "opening", None) as draw:
        draw(Stage(15, 60, 1.0, ""))
        assert progress_line(bars) == "opening 15 of 60 (25 %)"
        draw(Stage(0, 0, None, "simulating"))
        assert progress_line(bars) == "simulating"


def test_a_command_that_takes_less_than_ten_seconds_prints_no_progress():
    log = Log()
    with show_bars(Progress(console=Console(file=log))) as bars:
        bars.add_task("noise", total=60)
    assert (LINE_INTERVAL_S, log.getvalue()) == (10.0, "")
