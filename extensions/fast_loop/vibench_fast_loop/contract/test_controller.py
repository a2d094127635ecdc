"""Requirements of every real-time controller: play its program, report its inputs, and end by itself."""

from collections.abc import Sequence
from typing import cast

import numpy as np
import pytest

from vibench.acquisition.bench import Bench
from vibench.acquisition.contract.conftest import LEVEL, line_v, measured_v, refusal
from vibench.acquisition.instruments import PlugInKind, Samples
from vibench.acquisition.rig import LoopInput, Role

from ..protocol import LoopBlock, LoopController, LoopFeedback, LoopProgram, LoopState

KIND = PlugInKind.CONTROLLER
TONE_HZ = 160.0
TALK_S = 0.1
"""Interval between reports, shorter than any watchdog."""
LAW = 0.05
"""Output voltage of the law relative to that of the program."""


def controller_of(bench: Bench) -> LoopController:
    assert bench.controller is not None
    return cast("LoopController", bench.controller)


def level_v(bench: Bench) -> float:
    return LEVEL * controller_of(bench).facts.limit_v


def series(bench: Bench, feedback: LoopFeedback | None = None) -> LoopProgram:
    level = level_v(bench)
    return LoopProgram(
        frequency_hz=TONE_HZ, reference_v=((level, 0.0), (0.1 * level, -0.2 * level)), feedback=feedback
    )


def read_with_requests(bench: Bench, duration_s: float) -> tuple[Samples, list[LoopBlock]]:
    """Read samples for a duration while sending requests; return the samples and the controller's blocks."""
    stretch = int(TALK_S * bench.digitizer.sample_rate_hz)
    parts, blocks = [], list[LoopBlock]()
    for _ in range(round(duration_s / TALK_S)):
        parts.append(bench.digitizer.read(stretch).volts)
        blocks += controller_of(bench).report().blocks
    return np.concatenate(parts, axis=1), blocks


def complex_of(row: Sequence[tuple[float, float]]) -> list[complex]:
    return [complex(*pair) for pair in row]


def response_to(block: LoopBlock, of_base: bool) -> complex:  # noqa: FBT001 - which of two inputs
    return complex_of(block.base if of_base else block.m0)[1]


def test_the_controller_reports_its_identity_and_its_configuration(bench: Bench) -> None:
    facts, config = controller_of(bench).facts, bench.rig.controller
    assert controller_of(bench).identity.reply
    assert controller_of(bench).identity == controller_of(bench).identity
    assert config is not None
    assert facts.rate_hz == pytest.approx(config.rate_hz, rel=0.01)
    assert facts.latency_s == pytest.approx(config.latency_s, abs=1 / facts.rate_hz)
    assert facts.limit_v <= 1.01 * config.limit_v
    assert facts.watchdog_s <= 1.01 * config.watchdog_s
    assert facts.pd_of == config.pd_of
    assert controller_of(bench).report().state is LoopState.SILENT


def test_a_fourier_series_appears_at_the_terminal_as_requested(bench: Bench) -> None:
    bench.digitizer.start()
    controller_of(bench).play(series(bench))
    volts, blocks = read_with_requests(bench, 0.8)
    row = bench.digitizer.roles.index(Role.DRIVE_VOLTAGE.value)
    heard = (volts[row] * bench.channels[row].units_per_volt)[volts.shape[1] // 2 :]
    level, rate_hz = level_v(bench), bench.digitizer.sample_rate_hz
    assert line_v(heard, TONE_HZ, rate_hz) == pytest.approx(level, rel=0.03)
    assert line_v(heard, 2 * TONE_HZ, rate_hz) == pytest.approx(np.hypot(0.1, 0.2) * level, rel=0.05)
    assert [each.end_s for each in blocks] == sorted(each.end_s for each in blocks)


def test_the_coefficients_match_the_played_signal_and_the_sensors(bench: Bench) -> None:
    bench.digitizer.start()
    controller_of(bench).play(series(bench))
    volts, blocks = read_with_requests(bench, 1.2)
    block = [each for each in blocks if each.steady][-1]
    output, level = complex_of(block.output), level_v(bench)
    assert abs(output[1] - level) < 0.01 * level
    assert abs(output[2] - complex(0.1, -0.2) * level) < 0.01 * level
    for role, coefficients in ((Role.BASE_ACCELERATION, block.base), (Role.M0_VELOCITY, block.m0)):
        row = volts[bench.digitizer.roles.index(role.value)]
        shown = line_v(row[len(row) // 2 :], TONE_HZ, bench.digitizer.sample_rate_hz)
        assert abs(complex_of(coefficients)[1]) == pytest.approx(shown, rel=0.05)


def test_a_feedback_law_adds_its_response_to_the_played_series(bench: Bench) -> None:
    bench.digitizer.start()
    controller_of(bench).play(series(bench))
    _, blocks = read_with_requests(bench, 0.8)
    of_base = controller_of(bench).facts.pd_of in (None, LoopInput.BASE)
    gain = LAW * level_v(bench) / abs(response_to(blocks[-1], of_base))
    # As a proportional-derivative law does, this law weights the newest and the previous sample.
    into = (1.0, 0.0) if of_base else (0.0, 1.0)
    direct = (0.5 * gain * into[0], 0.5 * gain * into[1])
    law = LoopFeedback(step=((0.0,),), inlet=(into,), output=(0.5 * gain,), direct=direct)
    controller_of(bench).play(series(bench, law))
    _, blocks = read_with_requests(bench, 0.8)
    block = [each for each in blocks if each.steady][-1]
    late = np.exp(-2j * np.pi * TONE_HZ / controller_of(bench).facts.rate_hz)
    wanted = level_v(bench) + 0.5 * gain * (1 + late) * response_to(block, of_base)
    assert abs(complex_of(block.output)[1] - wanted) < 0.1 * LAW * level_v(bench)


def test_the_controller_falls_silent_without_requests_and_gives_the_reason(bench: Bench) -> None:
    controller = controller_of(bench)
    bench.digitizer.start()
    controller.play(series(bench))
    bench.digitizer.read(int((controller.facts.watchdog_s + 0.5) * bench.digitizer.sample_rate_hz))
    assert line_v(measured_v(bench, 0.2), TONE_HZ, bench.digitizer.sample_rate_hz) < 0.05 * level_v(bench)
    report = controller.report()
    assert report.state is LoopState.SILENT
    assert report.reason
    controller.play(series(bench))
    assert controller.report().state is LoopState.PLAYING, "the controller must play again on request"


def test_silence_may_be_requested_at_any_time_and_reaches_the_terminal(bench: Bench) -> None:
    controller_of(bench).silence(0.0)
    bench.digitizer.start()
    controller_of(bench).play(series(bench))
    read_with_requests(bench, 0.3)
    controller_of(bench).silence(0.05)
    controller_of(bench).silence(0.0)
    assert line_v(measured_v(bench, 0.2), TONE_HZ, bench.digitizer.sample_rate_hz) < 0.05 * level_v(bench)
    assert controller_of(bench).report().state is LoopState.SILENT


def test_closing_silences_the_controller_and_may_be_repeated(bench: Bench) -> None:
    controller = controller_of(bench)
    bench.digitizer.start()
    controller.play(series(bench))
    read_with_requests(bench, 0.3)
    controller.close()
    controller.close()
    assert line_v(measured_v(bench, 0.2), TONE_HZ, bench.digitizer.sample_rate_hz) < 0.05 * level_v(bench)
    with refusal():
        controller.play(series(bench))
