"""Control and direction characters in names and texts have no effect on the output of commands."""

import json
import re

import h5py
import numpy as np
import pytest

from vibench.acquisition.recording import _seal
from vibench.cli.__main__ import COMMANDS

from ..attack.instrument_replies import harmful
from ..attack.recordings_corpus import good_recordings

HOSTILE = "a\x1b[2J\x1b]0;title\x07\x1b]52;c;Zm9v\x07\x9b31m\u202eb\u2066\x08\r\nerror: all is well\x7f$^$"
"""Clears the screen, names the window, fills the clipboard, reorders, forges a line, breaks formulas."""
FORGED = re.compile(r"^error: all is well", re.MULTILINE)
TOML = f"""
{json.dumps(HOSTILE)} = 1
name = {json.dumps(HOSTILE)}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hostile") / HOSTILE
    folder.mkdir()
    for name in ("dwell.h5", "with_result.h5", "cut_off.h5.part"):
        path = folder / f"{HOSTILE}{name}"
        path.write_bytes(good_recordings()[name])
        if name != "cut_off.h5.part":
            make_hostile(path)
    (folder / f"{HOSTILE}broken.h5").write_bytes(b"none")
    (folder / f"{HOSTILE}.campaign.sqlite").write_bytes(b"none")
    (folder / f"{HOSTILE}.toml").write_text(TOML.replace("\x7f", "\\u007f"), encoding="utf-8")
    (folder / f"{HOSTILE}.csv").write_text(f"{HOSTILE}\n1,2\n", encoding="utf-8")
    return folder


def make_hostile(path):
    """Put hostile text into all texts of a recording, and seal it again."""
    with h5py.File(path, "r+") as file:
        del file["seal"]
        file.attrs["reason"] = np.bytes_(HOSTILE.encode())
        for text, keys in (("plan_json", ("notes",)), ("bench_json", ("name",))):
            said = json.loads(file[f"configuration/{text}"][()])
            said |= dict.fromkeys(keys, HOSTILE)
            del file[f"configuration/{text}"]
            file[f"configuration/{text}"] = np.bytes_(json.dumps(said).encode())
        for name in ("serial", "units", "long_name"):
            file["m0_velocity"].attrs[name] = np.bytes_(HOSTILE.encode())
        _seal.write_seal(file, {}, None)


def cases(folder):
    """Return arguments for every command: the folder, or a hostile name for commands that read no folder."""
    recordings = [path for path in sorted(folder.iterdir()) if path.suffix in (".h5", ".part")]
    dwell = next(path for path in recordings if path.name.endswith("dwell.h5"))
    toml, new = folder / f"{HOSTILE}.toml", folder / "new"
    unknown = {each: [(HOSTILE,)] for each in ("demo", "gui", "tradeoff", "warm", "docs", "schema", "watch")}
    unknown |= {
        each: [(HOSTILE,)] for each in ("release", "stop", "twin", "doctor", "serve-rig", "reproduce")
    }
    return unknown | {
        "measure": [(toml, "--out", new), (folder / HOSTILE, "--out", new)],
        "analyse": [(folder, "--no-simulate", "--out", new), (folder, "--no-simulate", "--json")]
        + [(each, "--no-simulate", "--out", new) for each in recordings],
        "catalogue": [(folder,), (folder, "--json"), (dwell,)],
        "verify": [(folder,), (folder, "--json"), *((each,) for each in recordings), (folder / HOSTILE,)],
        "export": [(each, "--to", "csv", "--out", new / "one") for each in recordings],
        "pack": [(folder, "--license", "https://creativecommons.org/", "--out", new / "a.zip")],
        "recover": [(each,) for each in recordings],
        "import": [(folder / f"{HOSTILE}.csv",), (dwell,), (folder / HOSTILE,)],
        "specimen": [(toml,), (folder / HOSTILE,)],
        "predict": [("--specimen", toml, "--amplitude", "1e-6", "--frequency", "260"), (HOSTILE,)],
        "branches": [("--specimen", toml, "--amplitude", "1e-6", "--frequency", "260"), (HOSTILE,)],
        "spectrum": [("--specimen", toml, "--amplitude", "1e-6", "--frequency", "260"), (HOSTILE,)],
        "chain": [(HOSTILE,), ("--specimen", toml)],
        "study": [(toml, "--out", new), (folder / HOSTILE, "--out", new)],
        "map": [(toml, "--out", new), (folder / HOSTILE, "--out", new)],
        "figure": [(HOSTILE, "--out", new), ("3", "--out", toml)],
        "bench": [("check", "--bench", toml), ("list", "--bench", folder / HOSTILE), (HOSTILE,)],
        "examples": [("--copy", toml), (HOSTILE,)],
    }


@pytest.mark.thorough
@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_prints_control_characters_of_a_name(vibench_here, folder, command):
    for arguments in cases(folder)[command]:
        ended = vibench_here(command, *arguments, cwd=folder)
        for said in (ended.stdout, ended.stderr):
            assert harmful(said) == [], (arguments, said)
            assert FORGED.search(said) is None, (arguments, said)
            assert "Traceback" not in said
        if "--json" in arguments:
            json.loads(ended.stdout)
    assert not harmful("".join(path.read_text("utf-8") for path in folder.glob("new/*.html")))


@pytest.mark.thorough
def test_the_report_shows_names_and_notes_with_markup_as_plain_text(vibench_here, folder, tmp_path):
    path = next(folder.glob("*dwell.h5"))
    ended = vibench_here("analyse", path, "--no-simulate", "--out", tmp_path / "out", cwd=tmp_path)
    assert ended.returncode == 0, ended.stderr
    text = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert harmful(text) == []
    assert r"a\x1b[2J" in text
    assert r"\u202eb" in text
