"""The example driver of a real-time controller, on a board simulated from its documentation."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.acquisition.contract.test_plug_ins import run
from vibench.acquisition import (
    ConfigurationError,
    InstrumentError,
    InstrumentLost,
    open_bench,
    run_measurement,
)
from vibench.acquisition.excitation.plan import BaseLevel
from vibench.acquisition.plan import Measurement
from vibench.acquisition.rig import confirm_simulated, load_rig
from vibench_fast_loop.branch_continuation import BranchContinuation
from vibench_fast_loop.contract import test_controller as contract
from vibench_fast_loop.protocol import LoopFeedback, LoopProgram, LoopState

from .helic_board import BUSY, on_rig

ROOT = Path(__file__).resolve().parents[3]
PACKAGE = ROOT / "examples" / "controller_package"
SERIES = LoopProgram(frequency_hz=100, reference_v=((0.1, 0.05),))
PLAYED_V = float(np.hypot(0.1, 0.05))


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Install the example package into a separate folder, and make it importable here."""
    target = tmp_path_factory.mktemp("installed")
    options = ("--quiet", "install", "--no-deps", "--no-build-isolation", "--target", target, PACKAGE)
    done = run("-m", "pip", *options)
    assert done.returncode == 0, done.stderr
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(target))
        yield target


@pytest.fixture
def rig(installed):
    """Return the example's bench on the virtual rig, with its board at half the sample rate."""
    rig, shipped = load_rig(PACKAGE / "bench.toml"), load_rig("virtual_rig_controller")
    quiet = {name: 0.2 * value for name, value in shipped.virtual if "_noise_" in name}
    return rig.model_copy(
        update={
            "virtual": shipped.virtual.model_copy(update={"grid_rate_hz": 64_000.0, **quiet}),
            "daq": rig.daq.model_copy(update={"sample_rate_hz": 12_800}),
            "controller": rig.controller.model_copy(update={"rate_hz": 4000.0}),
        }
    )


@pytest.fixture
def board_and_rig(rig):
    """Yield a board, and the configuration of a rig with this board."""
    with on_rig(rig) as (board, served):
        yield board, served


@pytest.fixture
def playing_board(board_and_rig):
    """Yield a playing board, and the open bench."""
    board, rig = board_and_rig
    with open_bench(rig, confirm=confirm_simulated) as bench:
        bench.digitizer.start()
        bench.controller.play(SERIES)
        contract.read_with_requests(bench, 0.3)
        assert board.is_armed
        yield board, bench


def pd(kp, kd, tau_s, step_s):
    """Return a proportional-derivative law with memory of the filtered rate and the previous sample."""
    share = step_s / (tau_s + step_s)
    rate = (1 - share, -share / step_s)
    return LoopFeedback(
        step=(rate, (0.0, 0.0)),
        inlet=((0.0, share / step_s), (0.0, 1.0)),
        output=(-kd * rate[0], -kd * rate[1]),
        direct=(0.0, -kp - kd * share / step_s),
    )


@pytest.mark.thorough
def test_controller_frames_match_the_protocol_documents(installed):
    from helic_link import frame

    assert frame(1, 1, b"\0\0").hex(" ") == "48 4c 01 01 02 00 00 00 89 0c"
    assert frame(2, 1, b"").hex(" ") == "48 4c 02 01 00 00 98 5e"
    assert frame(6, 3, bytes.fromhex("0c0004030201")).hex(" ") == "48 4c 06 03 06 00 0c 00 04 03 02 01 08 d1"


def test_a_pd_law_is_recovered_exactly_and_other_laws_are_refused(installed):
    from helic_signals import pd_gains

    rng = np.random.default_rng(22)
    for step_s in (1 / 1000, 1 / 8000):
        for kp, kd in rng.normal(0, (3, 3e-3), (50, 2)):
            tau_s = rng.choice([0.0, 1e-4, 2e-3])
            assert pd_gains(pd(kp, kd, tau_s, step_s), step_s) == pytest.approx(
                (kp, kd, tau_s), rel=1e-6, abs=1e-12
            )
        assert pd_gains(pd(2.0, 0.0, 1e-3, step_s), step_s)[:2] == (2.0, 0.0)
        assert pd_gains(None, step_s) == (0.0, 0.0, 0.0)
    of_base = LoopFeedback(step=(), inlet=(), output=(), direct=(1.0, 0.0))
    slow = LoopFeedback(step=((-0.5,),), inlet=((0.0, 1.0),), output=(1.0,), direct=(0.0, 0.0))
    second = LoopFeedback(
        step=((0.9, 0.0), (0.0, 0.5)), inlet=((0.0, 1.0), (0.0, 1.0)), output=(1.0, 1.0), direct=(0.0, 0.0)
    )
    for other in (of_base, slow, second):
        with pytest.raises(InstrumentError, match=r'Nothing was changed; set pd_of = "m0_velocity"'):
            pd_gains(other, 1e-3)


@pytest.mark.thorough
@pytest.mark.parametrize("promise", [name for name in dir(contract) if name.startswith("test_")])
def test_the_controller_board_passes_the_contract_tests(board_and_rig, promise):
    _, rig = board_and_rig
    with open_bench(rig, confirm=confirm_simulated) as bench:
        getattr(contract, promise)(bench)


@pytest.mark.thorough
def test_a_board_that_is_incompatible_or_ungated_or_occupied_is_refused(board_and_rig):
    board, rig = board_and_rig
    board.version = 4
    with pytest.raises(
        InstrumentError, match=r"has version 4 .* this driver needs version 3\. Nothing was played"
    ):
        open_bench(rig, confirm=confirm_simulated)
    board.version, board.is_gated = 3, False
    with pytest.raises(
        InstrumentError, match=r"gate of the board at .* does not open.*build its rig with SAFETY"
    ):
        open_bench(rig, confirm=confirm_simulated)
    board.is_gated = True
    for wrong, said in (
        ({"rate_hz": 8000.0}, r"takes 4000 samples a second .* has 8000"),
        ({"pd_of": None}, r'pd_of = nothing.*make them agree \(pd_of = "m0_velocity"\)'),
        ({"options": {"base": "laser"}}, r"laser, m0: no source in volts at .*, which has adc0, adc1"),
    ):
        told = rig.model_copy(update={"controller": rig.controller.model_copy(update=wrong)})
        with pytest.raises(ConfigurationError, match=said):
            open_bench(told, confirm=confirm_simulated)
    assert not board.is_armed


@pytest.mark.thorough
def test_a_lost_connection_to_the_board_is_reported_and_closes_its_safety_gate(playing_board):
    board, bench = playing_board
    board.drop()
    assert board.is_left.wait(10)
    assert not board.is_armed
    with pytest.raises(InstrumentLost, match=r"does not answer .*Its gate closes by itself"):
        bench.controller.report()
    assert contract.line_v(contract.measured_v(bench, 0.2), 100, 12_800) < 0.02 * PLAYED_V


@pytest.mark.thorough
def test_a_sample_stream_that_ends_is_reported_and_the_board_is_silenced(playing_board):
    board, bench = playing_board
    board.is_mute = True
    bench.digitizer.read(6400)
    with pytest.raises(InstrumentError, match=r"its samples no longer arrive\. The board was silenced"):
        bench.controller.report()
    assert not board.is_armed


@pytest.mark.thorough
def test_a_board_that_refuses_a_command_is_silenced_and_its_message_is_reported(playing_board):
    board, bench = playing_board
    board.refuses = {"forcing_coeffs": BUSY}
    bench.controller.play(SERIES.model_copy(update={"reference_v": ((0.2, 0.0),)}))
    contract.read_with_requests(bench, 0.2)
    told = bench.controller.report()
    assert told.state is LoopState.SILENT
    assert "refused" in told.reason
    assert "busy" in told.reason
    assert not board.is_armed
    board.refuses = {"ctrl_kp": BUSY}
    with pytest.raises(InstrumentError, match=r"refused .* as ctrl_kp: busy\. The board was silenced"):
        bench.controller.play(SERIES.model_copy(update={"feedback": pd(1.0, 0.0, 0.0, 1 / 4000)}))
    assert not board.is_armed


@pytest.mark.thorough
def test_a_safety_gate_that_trips_ends_the_run(board_and_rig, tmp_path):
    board, rig = board_and_rig
    plan = BranchContinuation(
        amplitude_vpp=4, base_level=BaseLevel(displacement_m=3e-6), start_hz=94, low_hz=93, high_hz=95
    )
    with open_bench(rig, confirm=confirm_simulated) as bench:
        bench.controller.play(SERIES)
        board.trips = True
        told = bench.controller.report()
        assert (told.state, told.reason) == (LoopState.SILENT, "its safety gate tripped")
        with pytest.raises(InstrumentError, match=r"the safety gate .* has tripped"):
            run_measurement(bench, Measurement(name="branch", excitation=plan), tmp_path / "tripped.h5")
    assert not board.is_armed


HOST = """
import sys
from vibench_fast_loop.protocol import LoopProgram
from vibench.acquisition.rig import ControllerConfig
from helic_controller import HelicController
config = ControllerConfig.model_validate_json(sys.argv[1])
controller = HelicController.open(config)
controller.play(LoopProgram(frequency_hz=100, reference_v=((0.5, 0.0),)))
print("playing", flush=True)
sys.stdin.read()
"""


@pytest.mark.thorough
def test_a_board_whose_host_is_killed_closes_its_gate_at_once(board_and_rig, installed, monkeypatch):
    board, rig = board_and_rig
    monkeypatch.setenv("PYTHONPATH", str(installed), prepend=":")
    command = [sys.executable, "-c", HOST, rig.controller.model_dump_json()]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as host:
        assert host.stdout.readline() == "playing\n"
        assert board.is_armed
        host.kill()
        assert board.is_left.wait(10)
    assert not board.is_armed
