"""`vibench export` and `vibench import` as a user runs them."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from vibench.acquisition import Block, open_recording
from vibench.acquisition.recording import ChannelHeader, Origin, RecordingHeader, create_recording
from vibench.cli.__main__ import app

MAPPING = """
started_utc = 2026-03-01T12:00:00Z
[measurement]
name = "dwell"
excitation = { kind = "dwell", amplitude_vpp = 1, frequency_hz = 20, duration_s = 1, settle_s = 0 }
[[channels]]
source = "m0_velocity"
role = "m0_velocity"
"""


def test_the_name_of_a_crate_keeps_a_dot_in_the_name_of_its_folder(h5_path, tmp_path):
    folder = tmp_path / "lauf 0.5Vpp"
    folder.mkdir()
    h5_path.rename(folder / "run.h5")
    licence = "https://creativecommons.org/licenses/by/4.0/"
    packed = CliRunner().invoke(app, ["pack", str(folder), "--license", licence])
    assert packed.exit_code == 0, packed.output
    assert (tmp_path / "lauf 0.5Vpp.zip").is_file()


@pytest.fixture
def h5_path(tmp_path):
    channel = ChannelHeader("m0_velocity", "dev/ai0", "velocity", "m s-1", 0.125, range_v=5.0)
    header = RecordingHeader((channel,), 1000.0, 2000, Origin.SIMULATED)
    with create_recording(tmp_path / "run.h5", header) as writer:
        writer.append(Block(0, np.random.default_rng(3).uniform(-4.0, 4.0, (1, 2000))))
    return writer.path


@pytest.fixture
def run(h5_path, monkeypatch):
    """Run a command in the recording's folder, in this process: starting a new process takes seconds."""
    monkeypatch.chdir(h5_path.parent)
    return lambda *arguments: CliRunner().invoke(app, arguments)


def test_a_recording_round_trips_through_export_and_import(run, h5_path):
    out = run("export", "run.h5", "--to", "uff", "--until", "1.5")
    assert out.stdout.splitlines() == ["wrote run.uff", "wrote run.uff.facts.json"]
    (channel,) = json.loads(run("import", "run.uff", "--json").stdout)["channels"]
    assert (channel["name"], channel["label"], channel["samples"]) == ("1", "m0_velocity", 1500)
    h5_path.with_name("map.toml").write_text(MAPPING)
    back = run("import", "run.uff", "--mapping", "map.toml", "--out", "back.h5", "--json")
    assert json.loads(back.stdout) == {"recording": "back.h5"}
    with open_recording(h5_path) as first, open_recording(h5_path.with_name("back.h5")) as second:
        wanted = first.read("m0_velocity", 0, 1500)
        np.testing.assert_allclose(second.read("m0_velocity"), wanted, rtol=0, atol=1e-8)
        assert [each.label for each in second.segments] == ["dwell"]


@pytest.mark.parametrize("folder", [".", "made", "new/", "other/new"])
def test_an_export_into_a_folder_gets_the_default_file_name(run, h5_path, folder):
    """An existing folder, "." and a new folder as target all get the default file name."""
    h5_path.with_name("made").mkdir()
    place = h5_path.parent / folder
    out = run("export", "run.h5", "--to", "csv", "--out", folder)
    assert out.exit_code == 0, out.output
    assert (place / "run.csv").is_file()
    run("export", "run.h5", "--to", "uff", "--out", "other.uff")
    h5_path.with_name("map.toml").write_text(MAPPING)
    back = run("import", "other.uff", "--mapping", "map.toml", "--out", folder)
    assert back.exit_code == 0, back.output
    assert (place / "other.h5").is_file()
    licence = "https://creativecommons.org/licenses/by/4.0/"
    packed = run("pack", str(h5_path.parent), "--license", licence, "--out", folder)
    assert packed.exit_code == 0, packed.output
    assert (place / f"{h5_path.parent.name}.zip").is_file()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("export", "run.h5", "--to", "csv", "--channels", "x"), "has no channel 'x'; it has m0_velocity"),
        (("export", "run.h5", "--to", "mat", "--results"), "contains no saved results"),
        (("export", "run.h5", "--to", "csv", "--from", "3"), "covers 0 to 2 s"),
        (("export", "run.h5", "--to", "csv", "--from", "nan"), "nan s to the end was requested; run.h5"),
        (("export", "run.h5", "--to", "csv", "--from", "-inf"), "-inf s to the end was requested"),
        (("export", "run.h5", "--to", "csv", "--until", "nan"), "the beginning to nan s was requested"),
        (("export", "run.h5", "--to", "uff", "--spectra", "--until", "inf"), "to inf s was requested"),
        (("export", "run.h5", "--to", "csv", "--until", "1e308"), "to 1e+308 s was requested"),
        (("export", "run.h5", "--to", "csv", "--from", "1", "--until", "0.5"), "a start and a later end"),
        (("export", "run.h5", "--to", "uff", "--out", "a.csv"), "another format; use the suffix .uff"),
        (("pack", ".", "--license", "MIT", "--out", "a.h5"), "another format; use the suffix .zip"),
        (("export", ".", "--to", "csv"), ". is a folder; give a recording (vibench catalogue"),
        (("import", "run.h5", "--out", "a.h5"), "give --mapping"),
        (("recover", "."), "nothing to recover; give the path of a .h5.part"),
        (("import", "."), ". is a folder; give the path of a file to import"),
        (("import", "run.h5", "--mapping", "map.toml"), "run.h5 exists, and nothing is ever overwritten"),
    ],
)
def test_invalid_exports_and_imports_are_refused_without_leftovers(run, h5_path, arguments, said):
    h5_path.with_name("map.toml").write_text("sample_rate_hz = 1000.0\n" + MAPPING)
    assert said in str(run(*arguments).exception)
    assert sorted(each.name for each in h5_path.parent.iterdir()) == ["map.toml", "run.h5"]


@pytest.mark.thorough
def test_the_refusal_of_an_exchange_is_one_sentence_on_standard_error(vibench, h5_path, tmp_path):
    (tmp_path / "run.csv").touch()
    result = vibench("export", "run.h5", "--to", "csv", cwd=tmp_path)
    assert (result.returncode, result.stdout) == (1, "")
    assert "error: run.csv exists, and nothing is ever overwritten; choose another name" in result.stderr
    assert "Traceback" not in result.stderr


def test_an_existing_file_is_refused_before_a_folder_is_analysed(run, h5_path):
    h5_path.with_name("a.uff").touch()
    refused = run("export", ".", "--to", "uff", "--spectra", "--out", "a.uff")  # there is no scan to analyse
    assert "a.uff exists, and nothing is ever overwritten" in str(refused.exception)


@pytest.mark.parametrize("kind", ["stepped_level", "dwell"])
def test_the_like_option_refuses_a_recording_at_one_frequency_before_its_analysis(run, tmp_path, kind):
    channel = ChannelHeader("m0_velocity", "dev/ai0", "velocity", "m s-1", 0.125, range_v=5.0)
    plan = json.dumps({"name": "n", "excitation": {"kind": kind, "amplitude_vpp": 1.0, "frequency_hz": 20.0}})
    header = RecordingHeader((channel,), 1000.0, 9, Origin.SIMULATED, plan_json=plan)
    with create_recording(tmp_path / "one.h5", header) as writer:  # without drive: no analysis is possible
        writer.append(Block(0, np.zeros((1, 9))))
    refused = run("branches", "--like", "one.h5")
    assert "does not contain levels for a range of frequencies" in str(refused.exception)


def test_an_import_warns_if_the_plan_is_longer_than_the_file(run, h5_path):
    h5_path.with_name("map.toml").write_text(MAPPING.replace("duration_s = 1", "duration_s = 5"))
    run("export", "run.h5", "--to", "uff")
    made = run("import", "run.uff", "--mapping", "map.toml", "--out", "back.h5", "--json")
    assert json.loads(made.stdout) == {"recording": "back.h5"}
    assert "only 0 of 1 planned parts are complete in the file" in made.stderr
