"""Count the calls on three data paths: ``python benchmarks/walks.py [predict] [measure] [analyse]``.

The paths are an amplitude from `vibench predict` to the native engine, a block of samples from a campaign to
the writer of the recording, and a recording through `analyse`. For each, the script counts the stack frames
from the first to the last function, at the first call of the last. It also counts the files and folders of
vibench with functions called meanwhile. For `predict`, it counts the files loaded, in all and by the command
itself.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

CHECKOUT = Path(__file__).resolve().parent.parent
FOLLOWED = """
import json, os, sys, threading
begin, end, answer, *words = sys.argv[1:]
sys.argv[1:] = words
root = os.environ["WALK_ROOT"] + os.sep
frames, files = [], set()

def ours(frame):
    return frame.f_code.co_filename.startswith(root)

def named(frame):
    return f"{frame.f_code.co_filename.removeprefix(root)}:{frame.f_code.co_qualname}"

def follow(frame, event, _):
    if event != "call" or not ours(frame):
        return
    here, above = named(frame), []
    while frame is not None:
        if ours(frame):
            above.append(named(frame))
        if above and above[-1].endswith(begin):
            files.add(here.partition(":")[0])
            # A library that has just been loaded is checked with a known scene.
            if here.endswith(end) and not frames and not any("check_known_answer" in each for each in above):
                frames.extend(reversed(above))
            return
        frame = frame.f_back

from vibench.command import main
try:
    sys.setprofile(follow)
    threading.setprofile(follow)
    main()
finally:
    sys.setprofile(None)
    loaded = {each.__file__ for name, each in [*sys.modules.items()] if name.split(".")[0] == "vibench"}
    with open(answer, "w") as file:
        json.dump([frames, sorted(files), sorted(each for each in loaded if each)], file)
"""
PREDICT = ("predict", "--amplitude", "20e-6", "--frequency", "130")
CAMPAIGN = """name = "walk"
[[measurements]]
name = "sweep"
[measurements.excitation]
kind = "sine_sweep"
amplitude_vpp = 0.5
start_hz = 220
stop_hz = 310
duration_s = 2
step_s = 0.2
settle_s = 0.5
"""


@dataclass(frozen=True)
class Walk:
    """Functions and files on one data path."""

    frames: tuple[str, ...]
    """Stack frames from the first function to the last, as ``file:function``."""
    files: tuple[str, ...]
    """Files with functions that were called while the first function ran."""
    loaded: tuple[str, ...]
    """Files of vibench that the process had imported at its end."""

    @property
    def folders(self) -> set[str]:
        """Folders of the files."""
        return {file.rpartition("/")[0] for file in self.files}


def walk(begin: str, end: str, *words: str) -> Walk:
    """Run a command, and record the path from the function ``begin`` to the first call of ``end``.

    Both names are matched with the end of ``file:function``.
    """
    with tempfile.TemporaryDirectory() as folder:
        answer = Path(folder) / "answer.json"
        program = [sys.executable, "-c", FOLLOWED, begin, end, str(answer), *words]
        environment = {**os.environ, "WALK_ROOT": str(CHECKOUT)}
        subprocess.run(program, env=environment, check=True, stdout=subprocess.DEVNULL)
        return Walk(*map(tuple, json.loads(answer.read_text())))


def amplitude_to_engine() -> Walk:
    """Return the path of `vibench predict` for one point to the call of the native engine."""
    return walk("cli/predict.py:predict", "engine/library.py:Engine.run", *PREDICT)


def samples_to_file(folder: Path) -> Walk:
    """Return the path of the first block of a campaign to the writer of its recording, in ``folder/out``."""
    campaign = folder / "walk.toml"
    campaign.write_text(CAMPAIGN)
    words = ("measure", str(campaign), "--out", str(folder / "out"))
    return walk(":run_campaign", "recording/_writer.py:RecordingWriter.append", *words)


def files_of_a_start() -> set[str]:
    """Return the files that every command loads, which are those that ``--version`` loads."""
    return set(walk("", "", "--version").loaded)


def main() -> None:
    """Record and print the requested paths."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("walks", nargs="*", default=["predict", "measure", "analyse"])
    asked = parser.parse_args().walks
    if "predict" in asked:
        found = amplitude_to_engine()
        print_path("amplitude to engine", found)
        own = set(found.loaded) - files_of_a_start()
        print(f"  files loaded: {len(found.loaded)}, {len(own)} of them by the command itself")
    if {"measure", "analyse"} & {*asked}:
        with tempfile.TemporaryDirectory() as folder:
            print_path("samples to file", samples_to_file(Path(folder)))
            if "analyse" in asked:
                recording, report = (str(Path(folder) / each) for each in ("out/sweep.h5", "report"))
                analysed = ("analyse", recording, "--out", report)
                print_path(
                    "recording through analyse",
                    walk(":analyse", "kinds.py:_analyse_sweep", *analysed),
                )


def print_path(what: str, found: Walk) -> None:
    """Print one path."""
    print(f"{what}: {len(found.frames)} frames; {len(found.files)} files in {len(found.folders)} folders")
    for frame in found.frames:
        print(f"  {frame}")


if __name__ == "__main__":
    main()
