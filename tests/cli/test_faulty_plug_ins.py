"""Third-party instruments that fail give one sentence, silence, and a kept recording."""

import re
import sys
from collections import deque
from pathlib import Path

import numpy as np
import pytest

from vibench.acquisition import AcquisitionError, open_bench, run_measurement
from vibench.acquisition.check.admission import check_bench
from vibench.acquisition.drivers import AFG1022_MODEL, DaqmxDigitizer
from vibench.acquisition.errors import BrokenPromise, DataLost
from vibench.acquisition.instruments import Block, SensorFacts
from vibench.acquisition.plan import Dwell, Measurement
from vibench.acquisition.recording import RecordingState, open_recording
from vibench.acquisition.rig import digitizer_driver, load_rig

ROOT = Path(__file__).resolve().parents[2]
GROUPS = {"generator": "vibench.generators", "digitizer": "vibench.digitizers", "sensor": "vibench.sensors"}
DWELL = Measurement(
    name="dwell",
    ramp_s=0.5,
    excitation=Dwell(amplitude_vpp=0.5, frequency_hz=160, settle_s=0.1, duration_s=0.2),
)
PLAN = """
name = "one_dwell"
[[measurements]]
name = "dwell"
ramp_s = 0.5
[measurements.excitation]
kind = "dwell"
amplitude_vpp = 0.5
frequency_hz = 160
settle_s = 0.1
duration_s = 0.2
"""


class FaultyObject:
    """Wraps one of our objects and replaces one member by faulty behaviour."""

    def __init__(self, inside, faulty, does):
        self._inside, self._faulty, self._does = inside, faulty, does

    def __getattr__(self, member):
        found = getattr(self._inside, member)
        if member != self._faulty:
            return found
        return (lambda *given: self._does(found, *given)) if callable(found) else self._does(lambda: found)


class FaultyDriver(FaultyObject):
    """A driver that opens a faulty instrument."""

    def open(self, *given):
        if self._faulty == "open":
            return self._does(self._inside.open, *given)
        return FaultyObject(self._inside.open(*given), self._faulty, self._does)


def raise_error(_found, *_given):
    raise ZeroDivisionError("firmware 1.02")


def return_none(found, *given):
    found(*given)


def run_then_raise(found, *given):
    found(*given)
    raise KeyError("session")


def return_nan(found, *given):
    block = found(*given)
    volts = block.volts.copy()
    volts[0, -1] = np.nan
    return Block(block.first_sample, volts, block.overloads)


def drop_a_row(found, *given):
    block = found(*given)
    return Block(block.first_sample, block.volts[1:], block.overloads)


class Drivers:
    """The entry points of a third-party package; a test sets the drivers."""

    generator, digitizer, sensor = AFG1022_MODEL, DaqmxDigitizer, None


@pytest.fixture
def bench_with(tmp_path, monkeypatch):
    """Install a package that offers three instruments; return a function that makes a bench."""
    metadata = tmp_path / "odd-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: odd\nVersion: 1.0\n")
    rows = [f"[{group}]\nodd = {__name__}:Drivers.{kind}\n" for kind, group in GROUPS.items()]
    (metadata / "entry_points.txt").write_text("\n".join(rows))
    monkeypatch.syspath_prepend(tmp_path)

    def bench(kind, driver):
        monkeypatch.setattr(Drivers, kind, driver)
        text = (ROOT / "hardware_configs" / "virtual_rig.toml").read_text()
        if kind == "sensor":
            text = text.replace('role = "base_acceleration"', 'role = "base_acceleration"\nsensor = "odd"')
        else:
            table = {"generator": "[generator]", "digitizer": "[daq]"}[kind]
            text = text.replace(f"\n{table}\n", f'\n{table}\ndriver = "odd"\n')
        assert 'odd"' in text
        path = tmp_path / "bench.toml"
        path.write_text(text)
        return path

    return bench


@pytest.fixture
def outcome(vibench_here, tmp_path):
    """Return a function that measures on a bench by command; an uncaught exception ends the test."""
    (tmp_path / "plan.toml").write_text(PLAN)

    def run(bench, *more):
        done = vibench_here("measure", "plan.toml", "--bench", bench, "--out", "out", *more, cwd=tmp_path)
        return done.returncode, " ".join((done.stdout + done.stderr).split())

    return run


GENERATOR = ("describe", "open", "identity", "unconfirmed", "amplitude_range_vpp", "load_sine", "start")
DIGITIZER = ("open", "identity", "sample_rate_hz", "roles", "volts_per_count", "start", "read", "stop")


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("kind", "member", "does"),
    [
        *(("generator", each, (raise_error, return_none)[at % 2]) for at, each in enumerate(GENERATOR)),
        *(("digitizer", each, (return_none, raise_error)[at % 2]) for at, each in enumerate(DIGITIZER)),
        ("generator", "open", raise_error),
        ("generator", "start", return_none),
        ("digitizer", "read", raise_error),
    ],
)
def test_a_faulty_third_party_instrument_gives_a_readable_message(bench_with, kind, member, does, outcome):
    inside = AFG1022_MODEL if kind == "generator" else DaqmxDigitizer
    path = bench_with(kind, FaultyDriver(inside, member, does))
    code, said = outcome(path)
    if does is return_none and member in {"load_sine", "start", "stop"}:
        assert code == 0, said  # these members return nothing
        return
    assert code != 0
    assert f"'odd' of {GROUPS[kind]} failed in {member}:" in said or member == "open", said
    assert f"'odd' of {GROUPS[kind]} failed in" in said
    assert ("ZeroDivisionError: firmware 1.02" in said) is (does is raise_error)


@pytest.mark.parametrize(("does", "words"), [(return_nan, "not numbers"), (drop_a_row, "of shape")])
def test_invalid_samples_end_a_check_or_a_run_with_a_readable_message(bench_with, does, words, tmp_path):
    path = bench_with("digitizer", FaultyDriver(DaqmxDigitizer, "read", does))
    with open_bench(path) as bench:
        with pytest.raises(AcquisitionError, match=words):
            check_bench(bench, tmp_path)
        with pytest.raises(AcquisitionError, match=words):
            run_measurement(bench, DWELL, tmp_path / "dwell.h5")


@pytest.mark.thorough
def test_missing_samples_are_reported_and_prevent_playback(bench_with, outcome, tmp_path):
    pytest.importorskip("vibench_more_drivers", reason="pip install -e extensions/more_drivers brings it")
    left = [20]

    def skips(found, *given):
        left[0] -= 1
        if left[0] == 0:
            found(*given)
        return found(*given)

    path = bench_with("digitizer", FaultyDriver(DaqmxDigitizer, "read", skips))
    code, said = outcome(path, "--check", "waived")
    assert code == 0, said
    assert re.search(r"the plan was carried out; the converter lost \d+ samples", said)
    rig = load_rig("virtual_rig")
    played = rig.daq.model_copy(
        update={"driver": "file", "options": {"recording": str(tmp_path / "out" / "dwell.h5")}}
    )
    rig = rig.model_copy(update={"daq": played})
    player = digitizer_driver(rig).open(rig)
    player.start()
    with pytest.raises(DataLost, match="missing samples cannot be played back"):
        deque(iter(lambda: player.read(5120), None), maxlen=0)


def test_a_check_finds_a_converter_that_omits_samples(bench_with, tmp_path):
    def skips(found, *given):
        found(*given)
        return found(*given)

    path = bench_with("digitizer", FaultyDriver(DaqmxDigitizer, "read", skips))
    with open_bench(path) as bench, pytest.raises(DataLost, match="instead of 0: the converter loses"):
        check_bench(bench, tmp_path)


def test_after_a_failed_stop_the_error_warns_that_the_output_may_be_on(bench_with, tmp_path):
    path = bench_with("generator", FaultyDriver(AFG1022_MODEL, "stop", raise_error))
    with pytest.raises(BrokenPromise, match="THE OUTPUT MAY STILL BE ON"), open_bench(path) as bench:
        check_bench(bench, tmp_path)


def test_a_driver_that_raises_system_exit_is_reported(bench_with, outcome):
    def exit_program(_found, *_given):
        sys.exit(0)

    code, said = outcome(bench_with("generator", FaultyDriver(AFG1022_MODEL, "open", exit_program)))
    assert code == 1
    assert "failed in open: SystemExit: 0" in said


def test_a_failure_during_output_ends_in_silence_with_a_recorded_reason(bench_with, tmp_path):
    left = [15]

    def fail_later(found, *given):
        left[0] -= 1
        return found(*given) if left[0] > 0 else raise_error(found)

    path = bench_with("digitizer", FaultyDriver(DaqmxDigitizer, "read", fail_later))
    with pytest.raises(BrokenPromise), open_bench(path) as bench:
        run_measurement(bench, DWELL, tmp_path / "dwell.h5")
    with open_recording(tmp_path / "dwell.h5") as recording:
        assert recording.state is RecordingState.FAILED
        assert "ZeroDivisionError: firmware 1.02" in recording.reason
        assert recording.samples > 0


@pytest.mark.thorough
@pytest.mark.parametrize(("kind", "inside"), [("generator", AFG1022_MODEL), ("digitizer", DaqmxDigitizer)])
def test_an_error_in_closing_a_bench_states_that_the_recording_is_complete(bench_with, kind, inside, outcome):
    path = bench_with(kind, FaultyDriver(inside, "close", run_then_raise))
    code, said = outcome(path)
    assert "recorded out/dwell.h5 (the plan was carried out)" in said
    assert "failed in close: KeyError: 'session'" in said
    assert code == 1


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("facts", "words"),
    [
        ({"units_per_volt": "10 mV/g"}, "SensorFacts.units_per_volt"),
        ({"units_per_volt": 0.0}, "units per volt of a sensor must not be 0"),
        ({"units_per_volt": float("nan")}, "SensorFacts.units_per_volt"),
        ({"full_scale_v": 0.0}, "SensorFacts.full_scale_v"),
        ({"full_scale_v": -1.0}, "SensorFacts.full_scale_v"),
        ({"delay_s": -5.0}, "SensorFacts.delay_s"),
        ({"serial": 4711}, "4711 as SensorFacts.serial"),
        ({"calibrated": "last year"}, "SensorFacts.calibrated"),
        (None, "None as SensorFacts"),
    ],
)
def test_an_impossible_sensor_is_refused(bench_with, facts, words):
    usual = {"units_per_volt": 100.0, "full_scale_v": 5.0, "name": "odd"}

    def sensor(_rig, _config):
        return None if facts is None else SensorFacts("acceleration", "m s-2", **(usual | facts))

    path = bench_with("sensor", sensor)
    with pytest.raises(BrokenPromise, match=words), open_bench(path):
        pass


def test_an_exception_in_a_sensor_plug_in_names_the_sensor(bench_with):
    path = bench_with("sensor", raise_error)
    with pytest.raises(BrokenPromise, match=r"'odd' of vibench\.sensors failed when called"):
        load_rig(path) and open_bench(path)
