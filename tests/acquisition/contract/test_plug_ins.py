"""Instrument plug-ins: built-in and third-party drivers pass the contract tests."""

import os
import subprocess
import sys
from importlib.metadata import EntryPoints
from pathlib import Path

import pytest

from vibench.acquisition import ConfigurationError
from vibench.acquisition.instruments import PlugInKind, _guarded, plug_in, plug_in_names
from vibench.acquisition.instruments._guarded import OURS
from vibench.acquisition.rig import load_rig

ROOT = Path(__file__).resolve().parents[3]
PACKAGE = ROOT / "examples" / "instrument_package"
BENCH = PACKAGE / "bench.toml"
CONFIGS = ROOT / "hardware_configs"

MEASURES = """
import sys
from importlib.metadata import EntryPoints
from pathlib import Path
from vibench.acquisition import open_bench, open_recording, run_measurement
from vibench.acquisition.plan import Dwell, Measurement
plan = Measurement(name="dwell", ramp_s=0.5, excitation=Dwell(
    amplitude_vpp=0.5, frequency_hz=160, settle_s=0.5, duration_s=1.0))
with open_bench(Path(sys.argv[1])) as bench:
    path = run_measurement(bench, plan, Path(sys.argv[2])).path
with open_recording(path) as recording:
    base = recording.channel("base_acceleration")
    print(recording.state.value, recording.instruments["generator"].model, base.long_name)
"""


def run(*arguments, path=None, folder=ROOT):
    """Run a Python program; `path` is put in front of the module search path."""
    kept = os.environ if path is None else {**os.environ, "PYTHONPATH": str(path)}
    return subprocess.run(
        [sys.executable, *map(str, arguments)],
        cwd=folder,
        env=kept,
        capture_output=True,
        text=True,
        check=False,
    )


def run_contract_tests(name, *options, path=None, folder=ROOT):
    return run(
        *("-m", "pytest", "-p", "no:cacheprovider", "-p", "vibench.acquisition.contract._options"),
        *("--pyargs", "vibench.acquisition.contract", "--vibench-instrument", name, *options),
        path=path,
        folder=folder,
    )


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Install the example package into a separate folder; return the folder."""
    target = tmp_path_factory.mktemp("installed")
    done = run(
        "-m", "pip", "--quiet", "install", "--no-deps", "--no-build-isolation", "--target", target, PACKAGE
    )
    assert done.returncode == 0, done.stderr
    return target


def test_every_registered_driver_exists():
    for row in OURS:
        assert plug_in(PlugInKind(row.group), row.name) is row.load()


def test_an_unknown_driver_is_refused_with_the_known_drivers():
    with pytest.raises(ConfigurationError, match=r"'afg' is not in vibench\.generators; give one of afg"):
        plug_in(PlugInKind.GENERATOR, "afg")


def test_an_error_does_not_ask_for_a_package_that_is_installed():
    pytest.importorskip("vibench_fast_loop", reason="pip install -e extensions/fast_loop brings it")
    with pytest.raises(ConfigurationError, match=r"'lines' is not in vibench\.generators; give one of afg"):
        plug_in(PlugInKind.GENERATOR, "lines")


def test_a_configuration_with_a_missing_driver_is_refused_before_opening():
    said = r"generator\.driver = 'plain_scpi' is not in vibench\.generators; give one of afg1022x"
    with pytest.raises(ConfigurationError, match=said):
        load_rig(BENCH)


def test_a_failing_import_of_a_plug_in_is_reported(tmp_path, monkeypatch):
    offer_generator(tmp_path, monkeypatch, "broken", "no_such_module_of_anyone:Driver")
    with pytest.raises(ConfigurationError, match=r"no_such_module_of_anyone:Driver, which cannot be loaded"):
        plug_in(PlugInKind.GENERATOR, "broken")


def test_an_exception_while_importing_a_plug_in_gives_a_one_sentence_error(tmp_path, monkeypatch):
    (tmp_path / "raises_at_once.py").write_text('raise RuntimeError("the firmware is too old")')
    offer_generator(tmp_path, monkeypatch, "broken", "raises_at_once:Driver")
    said = r"raises_at_once:Driver, which cannot be loaded \(RuntimeError: the firmware is too old\)"
    with pytest.raises(ConfigurationError, match=said):
        plug_in(PlugInKind.GENERATOR, "broken")


def test_two_plug_ins_with_the_same_name_are_refused(tmp_path, monkeypatch):
    offer_generator(tmp_path, monkeypatch, "afg1022x", "somebody:Else")
    with pytest.raises(ConfigurationError, match=r"provided twice \(somebody:Else, vibench"):
        plug_in(PlugInKind.GENERATOR, "afg1022x")


def test_plug_ins_are_searched_for_once_per_module_search_path(tmp_path, monkeypatch):
    looks = []
    monkeypatch.setattr(_guarded, "entry_points", lambda: looks.append("look") or EntryPoints())
    monkeypatch.syspath_prepend(tmp_path / "first")
    for _ in range(3):
        plug_in_names(PlugInKind.SENSOR)
    monkeypatch.syspath_prepend(tmp_path / "second")
    plug_in_names(PlugInKind.SENSOR)
    assert looks == ["look"] * 2


def offer_generator(folder, monkeypatch, name, target):
    """Install package metadata that offers a generator plug-in."""
    metadata = folder / "somebody-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: somebody\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(f"[vibench.generators]\n{name} = {target}\n")
    monkeypatch.syspath_prepend(folder)
    assert name in plug_in_names(PlugInKind.GENERATOR)


@pytest.mark.thorough
def test_third_party_instruments_can_be_used_without_changes_to_vibench(installed, tmp_path):
    done = run("-c", MEASURES, BENCH, tmp_path / "dwell.h5", path=installed)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split(maxsplit=2) == ["complete", "AFG1022", "base acceleration (charge amplifier)\n"]


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["plain_scpi", pytest.param("charge_amplifier", marks=pytest.mark.slow)])
def test_third_party_instruments_can_run_the_contract_tests(installed, tmp_path, name):
    """The tests also run from a folder without vibench's pytest settings."""
    done = run_contract_tests(name, f"--vibench-bench={BENCH}", path=installed, folder=tmp_path)
    assert done.returncode == 0, done.stdout
    assert "passed" in done.stdout


@pytest.mark.thorough
def test_contract_tests_find_a_faulty_generator(tmp_path, installed):
    broken = (installed / "example_instruments.py").read_text()
    broken = broken.replace("self._stretch = peak", "self._stretch = 1.0").replace(
        '"OUTP1:STAT OFF"', '"*WAI"'
    )
    (tmp_path / "example_instruments.py").write_text(broken)
    done = run_contract_tests(
        "plain_scpi", f"--vibench-bench={BENCH}", path=os.pathsep.join((str(tmp_path), str(installed)))
    )
    assert done.returncode == 1
    for promise in ("test_a_waveform_is_played_point_by_point", "test_stop_silences_the_output_at_any_time"):
        assert promise in done.stdout


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ((), "--vibench-instrument NAME is missing; give the name of an entry point, such as afg1022x"),
        (
            ("--vibench-instrument=unknown",),
            "'unknown' is not an installed instrument; install its package first",
        ),
        (("--vibench-instrument=afg1022x", "--vibench-bench=nowhere.toml"), "nowhere.toml: cannot be read"),
        (
            ("--vibench-instrument=file",),
            "no shipped virtual bench uses 'file' as one of vibench.generators",
        ),
        (
            ("--vibench-instrument=plain_python", "--vibench-bench=BENCH"),
            "'plain_python' is not an installed instrument",
        ),
        (
            ("--vibench-instrument=file", "--vibench-bench=BENCH"),
            "virtual_rig.toml does not use 'file' as one of",
        ),
    ],
)
def test_a_wrong_command_for_contract_tests_gives_a_single_error_message(tmp_path, options, sentence):
    bench = CONFIGS / "virtual_rig.toml"
    done = run(
        *("-m", "pytest", "-p", "no:cacheprovider", "-p", "vibench.acquisition.contract._options"),
        *("--pyargs", "vibench.acquisition.contract", "--rootdir", tmp_path),
        *(each.replace("BENCH", str(bench)) for each in options),
        folder=tmp_path,
    )
    assert done.returncode == pytest.ExitCode.USAGE_ERROR, done.stdout + done.stderr
    assert (done.stdout + done.stderr).count(sentence) == 1
    assert "no tests ran" in done.stdout


def test_contract_options_do_not_clash_with_options_of_a_project(tmp_path):
    (tmp_path / "conftest.py").write_text(
        "def pytest_addoption(parser):\n"
        "    for name in ('--bench', '--instrument', '--rig'):\n"
        "        parser.addoption(name)\n"
    )
    (tmp_path / "test_theirs.py").write_text(
        "def test_theirs(pytestconfig):\n    assert pytestconfig.getoption('--bench') == 'mine'\n"
    )
    done = run("-m", "pytest", "-p", "no:cacheprovider", "--bench=mine", folder=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


DRIVERS = ("afg1022x", "daqmx")
SENSORS = sorted(row.name for row in OURS if row.group == PlugInKind.SENSOR)
"""Names of our sensors, which are part of a shipped virtual bench, as are the drivers."""


@pytest.mark.timeout(900)
@pytest.mark.parametrize(
    "name",
    [
        *(pytest.param(name, marks=pytest.mark.thorough) for name in DRIVERS),
        *(pytest.param(name, marks=pytest.mark.slow) for name in SENSORS),
    ],
)
def test_the_built_in_drivers_pass_the_contract_tests(name):
    done = run_contract_tests(name)
    assert done.returncode == 0, done.stdout
    assert "passed" in done.stdout
