"""The command line as a user runs it: real processes, one-sentence errors, exit codes."""

import contextlib
import json
import signal
import subprocess
import sys

import numpy as np
import pytest
from rich.progress import Progress

from vibench.acquisition import open_recording
from vibench.acquisition.recording import RecordingState
from vibench.cli.__main__ import warning_line
from vibench.cli.output import errors, words

from .conftest import ENVIRONMENT, ROOT

QUICK = """
name = "short"
[[measurements]]
name = "dwell"
ramp_s = 0.2
ramp_step_s = 0.02
excitation = { kind = "dwell", amplitude_vpp = 1.5, frequency_hz = 260, settle_s = 0.1, duration_s = 1.5 }
"""


def campaign(folder, text=QUICK):
    path = folder / "campaign.toml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.thorough
def test_a_measured_campaign_is_recorded_and_a_second_run_overwrites_nothing(vibench_here, tmp_path):
    plan = campaign(tmp_path)
    first = vibench_here("measure", plan, "--out", "recordings", cwd=tmp_path)
    assert first.returncode == 0, first.stderr
    with open_recording(tmp_path / "recordings" / "dwell.h5") as recording:
        assert recording.state is RecordingState.COMPLETE
    before = (tmp_path / "recordings" / "dwell.h5").read_bytes()
    second = vibench_here("measure", plan, "--out", "recordings", cwd=tmp_path)
    assert second.returncode == 1
    assert "dwell.h5 exists already, and nothing is ever overwritten" in second.stderr
    resumed = vibench_here("measure", plan, "--out", "recordings", "--resume", cwd=tmp_path)
    assert resumed.returncode == 0
    assert "kept" in resumed.stdout
    assert (tmp_path / "recordings" / "dwell.h5").read_bytes() == before


@pytest.mark.thorough
def test_the_json_output_of_measure_and_export_and_pack_lists_their_files(vibench_here, tmp_path):
    measured = vibench_here("measure", campaign(tmp_path), "--out", "recordings", "--json", cwd=tmp_path)
    (row,) = json.loads(measured.stdout)["recordings"]
    assert (row["name"], row["outcome"]) == ("dwell", "recorded")
    recording = tmp_path / row["path"]
    exported = vibench_here("export", recording, "--to", "csv", "--until", "0.1", "--json", cwd=tmp_path)
    assert all((tmp_path / each).is_file() for each in json.loads(exported.stdout)["files"])
    packed = vibench_here("pack", "recordings", "--license", "https://example.org/l", "--json", cwd=tmp_path)
    assert json.loads(packed.stdout)["untrusted"] == {}


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no SIGINT to children")
def test_a_stopped_campaign_reports_its_failed_points(tmp_path):
    text = QUICK + QUICK.split("\n", 2)[2].replace('"dwell"\nramp', '"long"\nramp').replace(
        "= 1.5 }", "= 900 }"
    )
    script = tmp_path / "faults.toml"
    script.write_text(
        '[[faults]]\nat_s = 0.5\nfault = "turn_amplifier_gain"\ngain_db = 20\nfor_s = 2.0\n', encoding="utf-8"
    )
    words = ["measure", campaign(tmp_path, text), "--out", "out", "--faults", script, "--check", "waived"]
    words += ["--after-failure", "go_on"]
    with subprocess.Popen(
        [sys.executable, "-m", "vibench.cli", *map(str, words)],
        cwd=tmp_path,
        env=ENVIRONMENT,
        stderr=subprocess.PIPE,
    ) as measuring:
        while not (tmp_path / "out" / "long.h5.part").exists():
            with contextlib.suppress(subprocess.TimeoutExpired):
                measuring.wait(timeout=0.05)
            assert measuring.poll() is None
        measuring.send_signal(signal.SIGINT)
        measuring.communicate(timeout=100)
    assert [path.stem for path in sorted((tmp_path / "out").glob("*.h5"))] == ["dwell", "long"]
    assert measuring.returncode == 1


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("amplitude_vpp = 1.5", "amplitude_v = 1.5", "amplitude_v is not a known key"),
        ("amplitude_vpp = 1.5", "amplitude_vpp = 15", "at most 10 Vpp"),
        ("amplitude_vpp = 1.5", 'amplitude_vpp = "1.5 V"', "give a number"),
        ('kind = "dwell"', 'kind = "dwel"', "white_noise"),
        ("[[measurements]]", "[[measurements]", "not valid TOML"),
    ],
)
def test_a_wrong_campaign_is_refused_with_a_readable_message_before_output(refusal, tmp_path, old, new, said):
    assert said in refusal("measure", campaign(tmp_path, QUICK.replace(old, new)), "--out", "recordings")
    assert not list(tmp_path.glob("recordings/*"))


def test_a_missing_instrument_is_reported_in_one_sentence(refusal, tmp_path):
    text = (ROOT / "hardware_configs" / "virtual_rig.toml").read_text(encoding="utf-8")
    bench = tmp_path / "bench.toml"
    real = text.split("\n[virtual]\n")[0]
    bench.write_text("calibration_valid_days = 100000\n" + real, encoding="utf-8")
    said = refusal("measure", campaign(tmp_path), "--bench", bench, "--out", "recordings")
    assert "no instrument answers at USB0" in said


@pytest.mark.thorough
def test_the_instruments_of_the_virtual_rig_are_listed_by_name(output_of):
    found = output_of("bench", "list", "--bench", ROOT / "hardware_configs" / "virtual_rig.toml", "--json")
    assert any("1689::851" in name for name in found["visa"])
    assert any(line.startswith("vibench.generators: afg1022x, ") for line in found["plug-ins"])
    assert any(device.startswith("cDAQ1Mod1: NI 9234") for device in found["daq"])


@pytest.mark.thorough
def test_a_recording_of_a_killed_program_is_recovered(vibench, tmp_path):
    plan = campaign(tmp_path, QUICK.replace("duration_s = 1.5", "duration_s = 3000"))
    arguments = [sys.executable, "-m", "vibench.cli", "measure", str(plan), "--out", "recordings"]
    part = tmp_path / "recordings" / "dwell.h5.part"
    with subprocess.Popen(arguments, cwd=tmp_path, env=ENVIRONMENT, stdout=subprocess.DEVNULL) as running:
        while running.poll() is None:
            if part.exists() and samples_in(part) > 0:
                running.send_signal(signal.SIGKILL)
            with contextlib.suppress(subprocess.TimeoutExpired):
                running.wait(0.01)
    result = vibench("recover", part, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    with open_recording(part.with_suffix("")) as recording:
        assert recording.state is RecordingState.INTERRUPTED
        assert recording.samples > 0


def samples_in(part):
    try:
        with open_recording(part) as recording:
            return recording.samples
    except OSError:  # the file is not complete enough to be opened
        return 0


@pytest.mark.thorough
def test_a_bench_check_is_stored_and_can_be_shown_again(vibench_here, tmp_path):
    environment = {"VIBENCH_STATE_DIR": str(tmp_path / "state")}
    made = vibench_here("bench", "check", "--json", cwd=tmp_path, environment=environment)
    shown = vibench_here("bench", "check", "--last", "--json", cwd=tmp_path, environment=environment)
    assert json.loads(shown.stdout) == json.loads(made.stdout)
    assert {finding["verdict"] for finding in json.loads(made.stdout)["findings"]} == {"ok"}
    assert len(list((tmp_path / "state").rglob("*.json"))) == 2, "the last check, and the last that passed"


def test_invalid_simulated_faults_are_refused_before_opening(refusal, tmp_path):
    script = tmp_path / "faults.toml"
    script.write_text('[[faults]]\nat_s = 1\nfault = "fill_disk"\n', encoding="utf-8")
    served = refusal("serve-rig", "--address", "127.0.0.1:0", "--faults", script)
    assert "need a program that records" in served
    real = ROOT / "hardware_configs" / "lab_rig.toml"
    measured = refusal("measure", campaign(tmp_path), "--bench", real, "--faults", script, "--out", "out")
    assert "is a real rig" in measured
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "words",
    [("analyse", "file.h5"), ("figure", "2"), ("map", "map"), ("reproduce",), ("tradeoff",)],
    ids=lambda words: words[0],
)
def test_an_impossible_folder_is_refused_before_computation(refusal, tmp_path, words):
    (tmp_path / "file.h5").write_text("no folder", encoding="utf-8")
    said = refusal(*words, "--out", tmp_path / "file.h5" / "figures")
    assert "file.h5 is a file. Nothing was computed" in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("predict", "--frequency", "260", "--amplitude", "5um"),
            "'5um' is not a number; give a number in SI units",
        ),
        (
            ("predict", "--frequency", "260", "--amplitude", "5e-6", "--gap=45um"),
            "'45um' is not a number; give a number in SI units",
        ),
        (("stop", "--level", "hard"), "'--level': 'hard' is not one of 'hold', 'ramp', 'abort', 'off'"),
        (("--log-level", "loud", "doctor"), "'--log-level': 'loud' is not one of 'warning', 'info', 'debug'"),
        (("analyse", "x.h5", "--draws=-3"), "-3"),
        (("analyse", "x.h5", "--draws", "1e9"), "'1e9'"),
        (("analyse", "x.h5", "--draws", "1000000000"), "1000000000"),
        (("analyse", "x.h5", "--draws", "many"), "'many' is not a whole number; give a number such as 5"),
    ],
)
def test_an_invalid_option_value_is_refused_and_quoted(vibench_here, tmp_path, words, said):
    result = vibench_here(*words, cwd=tmp_path)
    assert result.returncode == 1
    assert said in " ".join(result.stderr.replace("│", " ").split())


@pytest.mark.parametrize(
    ("words", "place"),
    [
        (("measure", "quick", "--out", ""), "--out"),
        (("measure", "quick", "--out="), "--out"),
        (("examples", "--copy", ""), "--copy"),
        (("specimen", ""), "an argument"),
        (("export", "a.h5", "--to", "csv", "--channels", ""), "--channels"),
        (("bench", "new", ""), "an argument"),
    ],
)
def test_empty_paths_and_names_are_refused(vibench_here, tmp_path, words, place):
    """An empty shell variable would otherwise name the current folder."""
    result = vibench_here(*words, cwd=tmp_path)
    assert result.returncode == 1
    assert f"{place} was given as '', which is empty" in " ".join(result.stderr.replace("│", " ").split())
    assert list(tmp_path.iterdir()) == []


def test_a_name_may_end_with_an_equals_sign(vibench_here, tmp_path):
    assert "no specimen is called 'x='" in vibench_here("specimen", "x=", cwd=tmp_path).stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("specimen", "--toml"), "--toml was given without a specimen"),
        (("predict", "--amplitude", 1e-6, "--frequency", 9, "--resume"), "--resume was given without --out"),
        (
            ("export", "a.h5", "--to", "uff", "--quantity", "velocity"),
            "--quantity was given without --spectra",
        ),
    ],
)
def test_an_option_without_effect_is_refused(refusal, words, said):
    assert said in refusal(*words)


def test_a_folder_given_as_the_path_of_the_page_is_refused_before_computation(refusal, tmp_path):
    (tmp_path / "pages").mkdir()
    said = refusal("reproduce", "--out", "new", "--markdown", "pages")
    assert "pages is a folder. Nothing was computed; give the name of a file" in said


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--notify", "no-such-program --now"), "was not found"),
        (("--notify", "mail 'me"), "close every quotation mark"),
    ],
)
def test_invalid_notify_options_are_refused_before_output(refusal, tmp_path, words, said):
    assert said in refusal("measure", campaign(tmp_path), "--out", "recordings", *words)
    assert not (tmp_path / "recordings").exists()


@pytest.mark.parametrize("name", [":smile:", "[red]rig[/red]", r"C:\[bold]", "[/]"])
def test_file_names_that_look_like_markup_are_printed_unchanged(vibench_here, tmp_path, name):
    refused = vibench_here("verify", f"{name}.h5", cwd=tmp_path)
    assert f"{name}.h5" in refused.stderr + refused.stdout
    bars = Progress(words("{task.description}"), console=errors)
    bars.add_task(name)
    assert bars.columns[0].render(bars.tasks[0]).plain == name


@pytest.mark.parametrize(
    "words",
    [
        ("spectrum", "--frequency", "240"),
        ("branches", "--frequency", "85:130"),
        ("chain", "--cells", "2", "--frequency", "100"),
    ],
)
def test_every_command_warns_if_a_value_in_micrometres_was_typed_as_metres(vibench_here, tmp_path, words):
    """The invalid output path stops the command after the warning, before a long computation."""
    (tmp_path / "file").write_text("no folder", encoding="utf-8")
    given = ("--amplitude", "5", "--gap", "45", "--out", "file")
    said = vibench_here(*words, *given, cwd=tmp_path).stderr
    assert "warning: a gap of 45 m is wide for a specimen on a shaker" in said
    said = vibench_here(*words, *given[:2], *given[4:], cwd=tmp_path).stderr
    assert "warning: an amplitude of 5 m is 1.1e+05 times the gap" in said
    assert "if 5 micrometres were meant, give 5e-06" in said


def test_a_warning_of_numpy_is_explained():
    with np.errstate(over="warn"), pytest.warns(RuntimeWarning) as seen:
        np.float64(1e300) * np.float64(1e300)
    said = warning_line(seen[0].message)
    assert said.startswith("warning: some numbers are too large or too small to compute with (overflow")
    assert said.count("\n") == 1


def test_a_map_warns_if_a_value_in_micrometres_was_typed_as_metres(vibench_here, tmp_path):
    (tmp_path / "map.toml").write_text("gap_m = 45\namplitude_m = { start = 1, stop = 50, points = 5 }\n")
    said = vibench_here("map", "map.toml", "--out", "map", "--estimate", cwd=tmp_path).stderr
    assert "warning: a gap of 45 m" in said
