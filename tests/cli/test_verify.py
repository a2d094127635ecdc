"""`vibench verify`, and how other commands treat damaged or malicious recordings."""

import contextlib
import hashlib
import json
import os
import re
import shutil
import sys
from zipfile import ZipFile

import h5py
import numpy as np
import pytest

from vibench.acquisition import Block
from vibench.acquisition.recording import ChannelHeader, Origin, RecordingHeader, create_recording

LICENCE = "https://creativecommons.org/licenses/by/4.0/"
TINY = """
name = "tiny"
[defaults]
ramp_s = 0.1
ramp_step_s = 0.02
[[measurements]]
name = "tone"
excitation = { kind = "dwell", amplitude_vpp = 0.1, frequency_hz = 150, settle_s = 0, duration_s = 0.2 }
"""
SECRET = b"root:x:0:0:root:/root:/bin/bash\n" * 200


@pytest.fixture
def folder(tmp_path):
    for name in ("one", "two", "three"):
        with growing_recording(tmp_path / f"{name}.h5"):
            pass
    return tmp_path


@contextlib.contextmanager
def growing_recording(path):
    """Write half a second of three channels; the recording is finished when the block ends."""
    channels = tuple(
        ChannelHeader(role, "ai0", "voltage", "V", 1.0, 5.0)
        for role in ("drive_voltage", "base_acceleration", "m0_velocity")
    )
    with create_recording(path, RecordingHeader(channels, 1000.0, 500, Origin.SIMULATED)) as writer:
        writer.append(Block(0, np.sin(0.1 * np.arange(1500)).reshape(3, 500)))
        yield


def damage(path):
    with h5py.File(path, "r+") as file:
        file["m0_velocity"][7] += 1


def point_outside(path):
    """Make the samples of a recording an external link to a local file."""
    path.with_name("passwd").write_bytes(SECRET)
    with h5py.File(path, "r+") as file:
        kept = {name: value for name, value in file["m0_velocity"].attrs.items() if name != "DIMENSION_LIST"}
        del file["m0_velocity"], file["seal"]
        where = [(str(path.with_name("passwd")), 0, 2000)]
        made = file.create_dataset("m0_velocity", shape=(500,), dtype="<i4", external=where)
        made.attrs.update(kept)
        # A person who forges samples can also forge their checksum.
        made.attrs["sha256"] = np.bytes_(hashlib.sha256(SECRET[:2000]).hexdigest())


@pytest.mark.thorough
def test_every_recording_of_a_folder_is_verified(vibench_here, folder):
    good = vibench_here("verify", ".", "--json", cwd=folder)
    assert good.returncode == 0, good.stderr
    assert json.loads(good.stdout)["counts"] == {"intact": 3}
    damage(folder / "two.h5")
    bad = vibench_here("verify", ".", "--json", cwd=folder)
    assert bad.returncode == 1
    assert bad.stderr == "error: 1 of 3 recordings cannot be trusted: two.h5\n"
    told = {each["path"]: each for each in json.loads(bad.stdout)["recordings"]}
    assert told["two.h5"]["sentence"] == "changed since sealing: data of /m0_velocity"
    assert (told["one.h5"]["verdict"], told["two.h5"]["verdict"]) == ("intact", "damaged")
    assert vibench_here("verify", "two.h5", cwd=folder).returncode == 1
    assert vibench_here("verify", "one.h5", cwd=folder).returncode == 0


@pytest.mark.thorough
def test_a_wrong_or_missing_key_is_reported(vibench_here, folder):
    (folder / "key").write_text("a key that was not used here")
    found = vibench_here("verify", ".", "--key", "key", "--json", cwd=folder)
    assert found.returncode == 1
    assert json.loads(found.stdout)["counts"] == {"other_key": 3}
    none = vibench_here("verify", ".", "--key", "nowhere", cwd=folder)
    assert none.returncode == 1
    assert "error: The key nowhere for seals cannot be read" in none.stderr


@pytest.mark.thorough
@pytest.mark.parametrize("arguments", [("analyse", "two.h5", "--json"), ("export", "two.h5", "--to", "csv")])
def test_damaged_recordings_are_not_analysed(vibench_here, folder, arguments):
    damage(folder / "two.h5")
    found = vibench_here(*arguments, cwd=folder)
    assert found.returncode == 1
    assert "error: two.h5 is damaged (changed since sealing: data of /m0_velocity)" in found.stderr
    assert not list(folder.glob("two*.csv"))


@pytest.mark.thorough
def test_the_catalogue_command_names_a_damaged_recording_and_fails(vibench_here, folder):
    with h5py.File(folder / "two.h5", "r+") as file:
        file["m0_velocity"].attrs["delay_s"] = 1.0
    found = vibench_here("catalogue", ".", "--json", cwd=folder)
    assert found.returncode == 1
    assert found.stderr.startswith("error: two.h5: changed since sealing: attributes")
    seals = [each["seal"] for each in json.loads(found.stdout)["recordings"]]
    assert seals == ["intact", "damaged", "intact"]


def pack_folder(vibench_here, folder):
    """Pack a folder; return the output, and the entities of the crate by name."""
    found = vibench_here("pack", ".", "--license", LICENCE, "--out", "crate.zip", cwd=folder)
    with ZipFile(folder / "crate.zip") as archive:
        names = set(archive.namelist())
        graph = json.loads(archive.read("ro-crate-metadata.json"))["@graph"]
    return found, names, {each["@id"]: each for each in graph}


@pytest.mark.thorough
def test_unfinished_recordings_are_excluded_from_a_crate_and_named(vibench_here, folder):
    with growing_recording(folder / "four.h5"):
        shutil.copy(folder / "four.h5.part", folder / "five.h5.part")
    found, names, graph = pack_folder(vibench_here, folder)
    assert (found.returncode, "error" in found.stderr, "five.h5.part" in names) == (0, False, False)
    assert {"one.h5", "two.h5", "three.h5"} < names
    assert "; complete: " in graph["two.h5"]["description"]
    assert "cannot be trusted" not in graph["./"]["description"]
    assert "note: five.h5.part is not finished and was omitted" in found.stderr


@pytest.mark.thorough
def test_a_crate_marks_damaged_recordings(vibench_here, folder):
    damage(folder / "two.h5")
    (folder / "three.h5").write_bytes((folder / "three.h5").read_bytes()[:5000])
    found, names, graph = pack_folder(vibench_here, folder)
    assert found.returncode == 1
    errors = [line for line in found.stderr.splitlines() if line.startswith("error: ")]
    assert len(errors) == 2
    assert "two.h5 cannot be trusted (damaged: changed since sealing: data of /m0_velocity)" in found.stderr
    assert "three.h5 cannot be trusted (unreadable: " in found.stderr
    # A damaged recording is packed too: the crate may be all that remains.
    assert {"one.h5", "two.h5", "three.h5"} < names
    for name in ("two.h5", "three.h5"):
        assert graph[name]["description"].startswith("Cannot be trusted")
        assert "complete" not in graph[name]["description"]
        assert name in graph["./"]["description"]
    assert "; complete: " in graph["one.h5"]["description"]


@pytest.mark.thorough
def test_an_ro_crate_states_which_recordings_of_its_campaign_are_missing(vibench_here, folder):
    campaign = folder / "tiny.toml"
    campaign.write_text(TINY)
    made = vibench_here("measure", "tiny.toml", "--out", ".", "--check", "waived", cwd=folder)
    assert made.returncode == 0, made.stderr
    (folder / "tone.h5").unlink()
    found, names, graph = pack_folder(vibench_here, folder)
    assert found.returncode == 1
    assert "error: tone.h5 cannot be trusted (missing: the campaign recorded tone here)" in found.stderr
    assert "tone.h5" not in {*names, *graph}
    assert "tone.h5 cannot be trusted (missing" in graph["./"]["description"]


@pytest.mark.thorough
@pytest.mark.parametrize(
    "arguments",
    [
        ("analyse", "two.h5", "--json"),
        ("export", "two.h5", "--to", "csv"),
        ("verify", "two.h5"),
        ("catalogue", "."),
        ("import", "two.h5", "--json"),
    ],
)
def test_a_recording_with_external_links_is_refused(vibench_here, folder, arguments):
    point_outside(folder / "two.h5")
    found = vibench_here(*arguments, cwd=folder)
    assert found.returncode == 1
    said = found.stderr + found.stdout
    assert "refers to another file" in said
    assert "--allow-external" in said
    assert not list(folder.glob("*.csv"))


def test_external_links_are_followed_on_request(vibench_here, folder):
    point_outside(folder / "two.h5")
    found = vibench_here("export", "two.h5", "--to", "csv", "--allow-external", cwd=folder)
    assert found.returncode == 0, found.stderr
    assert (folder / "two.csv").exists()


@pytest.mark.thorough
def test_the_command_recover_follows_external_links_on_request(vibench_here, refusal, folder):
    with growing_recording(folder / "four.h5"):
        shutil.copy(folder / "four.h5.part", folder / "five.h5.part")
    with h5py.File(folder / "five.h5.part", "r+") as file:
        file["elsewhere"] = h5py.ExternalLink("one.h5", "/")
    assert re.search("refers to another file.*--allow-external", refusal("recover", "five.h5.part"))
    found = vibench_here("recover", "five.h5.part", "--allow-external", cwd=folder)
    assert found.returncode == 0, found.stderr
    assert vibench_here("verify", "five.h5", cwd=folder).returncode == 0


def test_a_finished_recording_named_as_a_part_file_is_not_recovered(refusal, folder):
    (folder / "two.h5").rename(folder / "four.h5.part")
    before = (folder / "four.h5.part").read_bytes()
    said = refusal("recover", "four.h5.part")
    assert said == "error: four.h5.part is a finished recording; rename it to four.h5"
    assert (folder / "four.h5.part").read_bytes() == before


@pytest.mark.thorough
def test_bad_recordings_do_not_affect_other_recordings_of_a_folder(vibench_here, folder):
    shutil.copy(folder / "one.h5", folder / "four.h5")
    with h5py.File(folder / "four.h5", "r+") as file:
        del file["seal"]
        file.attrs["started_utc"] = np.bytes_(b"-5")
    with h5py.File(folder / "two.h5", "r+") as file:
        del file["seal"], file["configuration/plan_json"]
        file["configuration/plan_json"] = np.bytes_(b"[1, 2]")
    found = vibench_here("catalogue", ".", "--json", cwd=folder)
    entries = {each["path"]: each for each in json.loads(found.stdout)["recordings"]}
    assert {name: each["state"] for name, each in entries.items()} == {
        "one.h5": "complete",
        "two.h5": "unreadable",
        "three.h5": "complete",
        "four.h5": "unreadable",
    }
    assert "started_utc" in entries["four.h5"]["reason"]
    assert "plan_json" in entries["two.h5"]["reason"]
    analysed = vibench_here("analyse", ".", "--json", cwd=folder)
    assert analysed.returncode == 1
    assert len([line for line in analysed.stderr.splitlines() if line.startswith("error: ")]) == 4


@pytest.mark.skipif(sys.platform != "linux", reason="names of any bytes, as Linux has them")
def test_a_file_name_that_cannot_be_stored_as_text_is_refused(folder, refusal):
    name = os.fsdecode(b"\xff.h5")
    (folder / "one.h5").rename(folder / name)
    said = refusal("export", name, "--to", "csv", "--out", "x")
    assert r"\udcff" in said
    assert "contains bytes that are not text; rename the file or folder" in said
