"""The simulated controller: returned coefficients, feedback, and silence without requests."""

import json

import numpy as np
import pytest

from vibench.sim.engine.run import native_engine
from vibench_fast_loop.protocol import (
    LoopFacts,
    LoopFeedback,
    LoopProgram,
    LoopReport,
    LoopRequest,
    LoopState,
)
from vibench_fast_loop.virtual_controller import VirtualController

RATE_HZ = 10_240.0
FACTS = LoopFacts(name="simulated", serial="1", rate_hz=RATE_HZ, latency_s=3e-4, limit_v=2.0, watchdog_s=0.5)


FULL_SCALE = 1e3


class Wire:
    """A sensor that shows a given value, one step at a time."""

    def __init__(self):
        self.shown = np.zeros(1)
        self._arrays = {name: np.ones(1) for name in ("numerator", "denominator", "state", "noise", "volts")}
        self._arrays["state"][:] = self._arrays["noise"][:] = 0.0

    @property
    def parts(self):
        arrays = dict(self._arrays)
        filtered = {name: arrays.pop(name) for name in ("numerator", "denominator", "state")}
        return native_engine().new(
            "Sensor",
            filter=native_engine().new("RecursiveFilter", **filtered),
            motion=self.shown,
            full_scale=FULL_SCALE,
            full_scale_voltage=FULL_SCALE,
            **arrays,
        )


class WiredController:
    """A controller whose inputs are its output three samples ago, and a constant."""

    def __init__(self, gain=1.0):
        self.samples = 0
        self.controller = VirtualController(FACTS, lambda: self.samples / RATE_HZ, 10 * RATE_HZ)
        self.played = [0.0, 0.0, 0.0]
        self.gain = gain
        self.base, self.m0, self.drive, self.late = Wire(), Wire(), np.zeros(1), np.zeros(1)
        self.m0.shown[:] = 0.25
        self.cables = native_engine().new(
            "LoopCables",
            base=self.base.parts,
            m0=self.m0.parts,
            drive=self.drive,
            late=self.late,
            steps_per_sample=1,
        )

    def tell(self, ask, **more):
        line = LoopRequest(ask=ask, **more).model_dump_json().encode()
        return self.controller.execute(line).data

    def report(self):
        return LoopReport.model_validate_json(self.tell("report"))

    def run(self, seconds):
        for _ in range(round(seconds * RATE_HZ)):
            self.base.shown[:], self.drive[:] = self.gain * self.played[-3], 0.0
            with self.controller.hold_state() as controller:
                self.cables["controller"] = controller.ctypes.data
                self.cables["begin"], self.cables["stop"] = 0, 1
                if native_engine().call("hear_loop", self.cables):
                    self.controller.attend(self.samples / RATE_HZ)
            with self.controller.hold_state() as controller:
                self.cables["controller"], self.cables["begin"] = controller.ctypes.data, 0
                native_engine().call("play_loop", self.cables)
            self.played.append(float(self.drive[0]))
            self.samples += 1


@pytest.fixture
def wired():
    return WiredController()


SERIES = ((0.5, 0.0), (0.1, -0.2), (0.0, 0.05))


def test_returned_fourier_coefficients_match_the_played_signal(wired):
    frequency_hz = 97.313
    wired.tell("play", program=LoopProgram(frequency_hz=frequency_hz, reference_v=SERIES, glide_s=0.05))
    wired.run(0.4)
    block = wired.report().blocks[-1]
    assert block.steady
    output = np.array([complex(*each) for each in block.output])
    assert np.abs(output[1:4] - [complex(*each) for each in SERIES]).max() < 1e-4
    assert np.abs(np.append(output[4:], output[0])).max() < 1e-4
    # The input lags by three samples: a phase shift in every order.
    late = np.exp(-2j * np.pi * np.arange(10) * frequency_hz * 3 / RATE_HZ)
    base = np.array([complex(*each) for each in block.base])
    assert np.abs(base - output * late).max() < 1e-4
    assert complex(*block.m0[0]) == pytest.approx(0.25, abs=1e-4)


def test_a_feedback_law_acts_on_the_samples_and_on_its_internal_state(wired):
    feedback = LoopFeedback(step=((0.5,),), inlet=((0.0, 1.0),), output=(2.0,), direct=(0.0, -1.0))
    program = LoopProgram(frequency_hz=100, reference_v=((0.0, 0.0),), feedback=feedback)
    wired.tell("play", program=program)
    wired.run(5 / RATE_HZ)
    # Memory is 0, .25, .375, ...; the output is twice the memory minus the input.
    memory = [0.25 * (2 - 0.5 ** (k - 1)) if k else 0.0 for k in range(5)]
    assert wired.played[3:] == pytest.approx([2 * each - 0.25 for each in memory])


def test_changing_the_program_of_the_controller_causes_no_jump_of_its_output(wired):
    wired.tell("play", program=LoopProgram(frequency_hz=90, reference_v=((1.0, 0.0),), glide_s=0.1))
    wired.run(0.2)
    wired.tell("play", program=LoopProgram(frequency_hz=120, reference_v=((0.2, 0.4),), glide_s=0.1))
    wired.run(0.2)
    assert np.abs(np.diff(wired.played)).max() < 1.3 * 2 * np.pi * 120 / RATE_HZ
    assert wired.report().state is LoopState.PLAYING


def test_without_its_host_the_controller_goes_silent_and_states_the_reason(wired):
    wired.tell("play", program=LoopProgram(frequency_hz=100, reference_v=((1.0, 0.0),)))
    wired.run(0.4)
    wired.report()
    wired.run(0.4)
    assert max(np.abs(wired.played[-100:])) > 0.9
    wired.run(0.2)
    assert not np.any(wired.played[-100:])
    told = wired.report()
    assert told.state is LoopState.SILENT
    assert "sent no request for 0.5 s" in told.reason


def test_the_controller_stops_an_unstable_feedback_law():
    wired = WiredController(gain=1.0)
    feedback = LoopFeedback(step=((0.0,),), inlet=((0.0, 0.0),), output=(0.0,), direct=(1.3, 0.0))
    program = LoopProgram(frequency_hz=100, reference_v=((0.1, 0.0),), feedback=feedback)
    wired.tell("play", program=program)
    wired.run(0.3)
    assert max(np.abs(wired.played)) <= FACTS.limit_v
    assert not np.any(wired.played[-100:])
    assert "at its limit of 2 V" in wired.report().reason


def test_invalid_requests_are_refused_with_a_readable_message(wired):
    wired.tell("play", program=LoopProgram(frequency_hz=100, reference_v=((1.0, 0.0),)))
    for line in (b"{}", b"nonsense", b'{"ask": "play"}', b'{"ask": "play", "program": {"frequency_hz": -1}}'):
        told = json.loads(wired.controller.execute(line).data)
        assert "the output continues" in told["refused"]
    with pytest.raises(ValueError, match="make the shapes agree"):
        LoopFeedback(step=((0.0,),), inlet=((0.0,),), output=(0.0,), direct=(1.0, 0.0))
    assert wired.report().state is LoopState.PLAYING
