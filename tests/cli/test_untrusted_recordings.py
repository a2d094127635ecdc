"""No command accepts an altered, unsealed or swapped recording as intact."""

import hashlib
import shutil

import h5py
import numpy as np
import pytest

from vibench.acquisition.recording import _seal

from ..attack.altered_recordings import write_journal
from ..attack.recordings_corpus import good_recordings

LICENCE = ("--license", "https://creativecommons.org/licenses/by/4.0/")


@pytest.fixture
def folder(tmp_path):
    """Return a folder with two recordings and the journal of their campaign."""
    folder = tmp_path / "recordings"
    folder.mkdir()
    for name in ("dwell.h5", "noise.h5"):
        (folder / name).write_bytes(good_recordings()[name])
    return folder


def halve_samples(file):
    file["m0_velocity"][...] = file["m0_velocity"][...] // 2


def change_scale(file):
    attributes = file["m0_velocity"].attrs
    for name in ("scale_factor", "physical_per_volt"):
        attributes[name] = 2 * attributes[name]


def change_units(file):
    file["m0_velocity"].attrs["units"] = np.bytes_(b"mm s-1")


def change_rate(file):
    file.attrs["sample_rate_hz"] = 2 * file.attrs["sample_rate_hz"]


def change_text(name, old, new):
    def change(file):
        text = file[f"configuration/{name}"][()].replace(old, new)
        del file[f"configuration/{name}"]
        file[f"configuration/{name}"] = np.bytes_(text)

    return change


def shift_samples(file):
    file["segments/first_sample"][0] += 1


def delay_channel(file):
    file["m0_velocity"].attrs["delay_s"] = 1e-4


CHANGES = {
    "nothing": lambda file: None,
    "samples": halve_samples,
    "scale": change_scale,
    "units": change_units,
    "rate": change_rate,
    "plan": change_text("plan_json", b"260.0", b"261.0"),
    "rig": change_text("bench_json", b"{", b'{"calibration_valid_days": 9, '),
    "segment": shift_samples,
    "delay": delay_channel,
}


def outputs_of_all_commands(vibench_here, folder, name="dwell.h5"):
    """Return the exit code and the output of each command for a recording."""
    for each in {*folder.parent.iterdir()} - {folder}:
        shutil.rmtree(each) if each.is_dir() else each.unlink()
    asked = {
        "analyse": ("analyse", name, "--no-simulate", "--out", folder.parent / "one"),
        "analyse folder": ("analyse", ".", "--no-simulate", "--out", folder.parent / "all"),
        "verify": ("verify", name),
        "verify folder": ("verify", "."),
        "catalogue": ("catalogue", "."),
        "export": ("export", name, "--to", "csv", "--out", folder.parent / "csv"),
        "spectra": ("export", name, "--to", "uff", "--spectra", "--out", folder.parent / "uff"),
        "pack": ("pack", ".", *LICENCE, "--out", folder.parent / "crate.zip"),
    }
    told = {}
    for word, arguments in asked.items():
        ended = vibench_here(*arguments, cwd=folder)
        told[word] = (ended.returncode, ended.stdout + ended.stderr)
    return told


@pytest.mark.thorough
@pytest.mark.parametrize(
    "change",
    [
        pytest.param(each, marks=[pytest.mark.slow] if each in {"units", "rig", "delay", "plan"} else [])
        for each in CHANGES
    ],
)
def test_every_command_refuses_or_warns_about_a_recording_without_its_seal(vibench_here, folder, change):
    with h5py.File(folder / "dwell.h5", "r+") as file:
        del file["seal"]
        CHANGES[change](file)
    told = outputs_of_all_commands(vibench_here, folder)
    for word in ("verify", "verify folder", "pack"):
        assert told[word][0] == 1, told[word]
        assert "error: " in told[word][1]
    for word in ("analyse", "analyse folder", "export", "spectra"):
        code, text = told[word]
        assert code == 1 or "seal is gone" in text, (word, text)
        assert change != "samples" or (code == 1 and "do not match their checksum" in text), (word, text)
    (row,) = (line for line in told["catalogue"][1].splitlines() if line.startswith("dwell.h5"))
    assert "seal gone" in row or "damaged" in row, row
    report = folder.parent / "one" / "report.html"
    assert change != "nothing" or "its seal is gone" in report.read_text("utf-8")


@pytest.mark.thorough
@pytest.mark.parametrize("how", [pytest.param("copied over", marks=pytest.mark.slow), "sealed anew"])
def test_a_swapped_recording_is_refused_by_every_command(vibench_here, folder, how):
    write_journal(folder, ("dwell", "noise"))
    assert {code for code, _ in outputs_of_all_commands(vibench_here, folder).values()} == {0}
    if how == "copied over":
        shutil.copy(folder / "noise.h5", folder / "dwell.h5")
    else:
        with h5py.File(folder / "dwell.h5", "r+") as file:
            del file["seal"], file["m0_velocity"].attrs["sha256"]
            halve_samples(file)
            counts = file["m0_velocity"][()].tobytes()
            file["m0_velocity"].attrs["sha256"] = np.bytes_(hashlib.sha256(counts).hexdigest().encode())
            _seal.write_seal(file, {}, None)
    for word, (code, text) in outputs_of_all_commands(vibench_here, folder).items():
        assert code == 1, (word, text)
        assert "the campaign's journal for dwell: another recording" in text, (word, text)


def test_export_warns_about_a_recording_without_its_seal(vibench_here, folder):
    with h5py.File(folder / "dwell.h5", "r+") as file:
        del file["seal"]
    ended = vibench_here("export", "dwell.h5", "--to", "csv", cwd=folder)
    assert (ended.returncode, ended.stderr.count("warning: dwell.h5: its seal is gone")) == (0, 1)
