"""The window's pulse goes on whatever the two threads do between each other's lines."""

import threading
from time import monotonic

from vibench.gui.engine_link import _engine_line
from vibench.gui.engine_link._engine_line import Pulse


class Listening:
    """Takes beats as an engine does: none may say that the window will stand still in the future."""

    def __init__(self):
        self.beats = []
        self.three = threading.Event()

    def beat(self, still_s):
        assert still_s >= 0, still_s
        self.beats.append(still_s)
        if len(self.beats) == 3:
            self.three.set()

    def close(self):
        """Nothing is open."""


def test_a_window_that_lives_just_while_a_beat_is_made_goes_on_beating(monkeypatch):
    heard = Listening()
    pulses = []

    def clock_and_then_the_window_lives():
        now = monotonic()
        if pulses and threading.current_thread() is not threading.main_thread():
            pulses[0]._lived_s = now + 0.001
        return now

    monkeypatch.setattr(_engine_line, "monotonic", clock_and_then_the_window_lives)
    pulses.append(Pulse(heard))
    try:
        assert heard.three.wait(10)
    finally:
        pulses[0].close()
