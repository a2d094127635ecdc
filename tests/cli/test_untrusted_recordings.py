"""No command accepts an altered, unsealed or swapped recording as intact."""

import random
import shutil

import h5py
import pytest

from vibench.acquisition.recording import _seal

from ..attack.altered_recordings import (
    INSIDE,
    NAMES,
    READERS,
    ROLES,
    change_samples,
    fooled_readers,
    run_reader,
    write_journal,
)
from ..attack.recordings_corpus import good_recordings

pytest.importorskip("PySide6.QtWidgets", exc_type=ImportError)


@pytest.fixture
def folder(tmp_path):
    """Return a folder with two recordings."""
    folder = tmp_path / "recordings"
    folder.mkdir()
    for name in NAMES:
        (folder / f"{name}.h5").write_bytes(good_recordings()[f"{name}.h5"])
    return folder


@pytest.mark.thorough
@pytest.mark.parametrize("change", list(dict.fromkeys(INSIDE)))
def test_every_command_refuses_or_warns_about_an_altered_recording_without_its_seal(folder, change):
    with h5py.File(folder / "dwell.h5", "r+") as file:
        del file["seal"]
        change(file, random.Random(1))
    assert fooled_readers(folder, "dwell.h5") == []
    if change is change_samples:
        for command in (("analyse", "dwell.h5", "--no-simulate"), ("export", "dwell.h5", "--to", "csv")):
            code, text = run_reader(folder, *command)
            assert code == 1, text
            assert "do not match their checksum" in text


@pytest.mark.thorough
@pytest.mark.parametrize("how", [pytest.param("copied over", marks=pytest.mark.slow), "sealed anew"])
def test_a_recording_swapped_for_another_is_refused_by_every_command(folder, how):
    write_journal(folder)
    assert [each.split(":")[0] for each in fooled_readers(folder, "dwell.h5")] == list(READERS)
    if how == "copied over":
        shutil.copy(folder / "sweep.h5", folder / "dwell.h5")
    else:
        with h5py.File(folder / "dwell.h5", "r+") as file:
            del file["seal"]
            change_samples(file, random.Random(1))
            for role in ROLES:
                del file[role].attrs["sha256"]
            _seal.write_seal(file, {}, None)
    assert fooled_readers(folder, "dwell.h5") == []
    for command in (("verify", "dwell.h5"), ("analyse", "dwell.h5", "--no-simulate"), ("catalogue", ".")):
        code, text = run_reader(folder, *command)
        assert code == 1, text
        assert "of dwell in the campaign's journal: it is another recording" in text


@pytest.mark.thorough
def test_a_missing_seal_gives_one_warning_and_is_stated_in_the_report(vibench_here, folder):
    with h5py.File(folder / "dwell.h5", "r+") as file:
        del file["seal"]
    ended = vibench_here("export", "dwell.h5", "--to", "csv", cwd=folder)
    assert (ended.returncode, ended.stderr.count("warning: dwell.h5: its seal is gone")) == (0, 1)
    vibench_here("analyse", "dwell.h5", "--no-simulate", "--out", "one", cwd=folder)
    assert "its seal is gone" in (folder / "one" / "report.html").read_text("utf-8")
