"""System calls that report an error with or without having succeeded: the program checks the disk."""

import errno
import os
import shutil
import subprocess
import sys

import pytest

from vibench.acquisition.campaign import JournalPointState, read_journal

from . import recordings_kills
from .recordings_corpus import good_recordings
from .recordings_kills import CALLS, LIBRARY, ROOT, WHEN, KilledCampaigns, at_the_end, build_library

pytestmark = pytest.mark.skipif(
    sys.platform != "linux" or shutil.which("cc") is None, reason="preloads a C library"
)

ARMED = f"""
import ctypes, os, signal, sys
from pathlib import Path
signal.signal(signal.SIGINT, signal.default_int_handler)
folder, call, when, fault = Path(sys.argv[1]), *map(int, sys.argv[2:])
def arm():
    ctypes.CDLL(os.environ["{LIBRARY}"]).arm(call, 1, when, fault, bytes(folder))
"""
EXPORT = """
from vibench.analysis.exchange._export import new_file
with new_file(folder / "file") as path:
    path.write_text("all of it")
    arm()
"""
STOP = """
from vibench.stop_files import write_stop_file
arm()
write_stop_file(str(folder / "file"), "all of it")
"""
ANNOUNCEMENT = """
from vibench.sim.operating_system.this import rename
(folder / "file.coming").write_text("all of it")
arm()
rename(folder / "file.coming", folder / "file")
"""
RESULT = """
import h5py
from vibench.acquisition.recording._preallocate import replace_with_change
arm()
replace_with_change(folder / "dwell.h5", lambda file: file.attrs.__setitem__("note", "all of it"))
"""
HDF5_WRITERS = {
    "finish": """
from vibench.acquisition.recording import recover
def write(folder): recover(folder / "cut_off.h5.part")
""",
    "prepare": """
from vibench.acquisition.recording import ChannelHeader, Origin, RecordingHeader, create_recording
channel = ChannelHeader("m0_velocity", "Dev1/ai0", "velocity", "m s-1", physical_per_volt=0.125, range_v=5.0)
def write(folder):
    header = RecordingHeader((channel,), 1000.0, expected_samples=500, origin=Origin.SIMULATED)
    create_recording(folder / "new.h5", header)
""",
    "result": """
import numpy as np
from vibench.acquisition import open_recording
from vibench.acquisition.recording import ResultArray
def write(folder):
    with open_recording(folder / "dwell.h5") as recording:
        recording.save_results("peak", {"level": ResultArray(np.ones(9), "V")}, {})
""",
    "nexus": """
from vibench.acquisition import open_recording
from vibench.analysis.exchange import Format, excerpt, export_samples
def write(folder):
    with open_recording(folder / "dwell.h5") as recording:
        export_samples(excerpt(recording), Format.NEXUS, folder / "new.nxs")
""",
    "spectrum": """
from vibench.analysis.dynamics._dynamics_file import _new_file
def write(folder):
    with _new_file(folder / "new.h5", "spectrum", "{}", 1.0) as file:
        file["column"] = [0.0] * 9
""",
    "study": """
from vibench.sim.study import Study
from vibench.sim.study._file_store import make_file
def write(folder):
    make_file(folder / "new.h5", Study(frequencies_hz=[200.0, 260.0], amplitudes_m=[5e-6]))
""",
}
"""All functions that write HDF5 files."""
IN_FORKS = """
import shutil
from tests.attack.recordings_kills import LIBRARY
from vibench.acquisition import RecordingError
from vibench.analysis.errors import InvalidRequest
from vibench.sim.study import StudyError
shim, before = ctypes.CDLL(os.environ[LIBRARY]), {path.name for path in folder.iterdir()}
def code_of_write(number):
    copy = shutil.copytree(folder, folder.with_name(f"copy-{when}-{number}"))
    shim.arm(call, number, when, fault, bytes(copy))
    try:
        write(copy)
    except (RecordingError, InvalidRequest, StudyError, KeyboardInterrupt) as error:
        is_explained = str(error).strip() or isinstance(error, KeyboardInterrupt)
        return 1 if is_explained and {path.name for path in copy.iterdir()} == before else 2
    return 0
assert code_of_write(1000) == 0
count = 1000 - ctypes.c_int.in_dll(shim, "left").value
for when, fault in enumerate(FAULTS):
    for number in {1, count // 4, count // 2, 3 * count // 4, count - 1, count}:
        child = os.fork()
        if child == 0:
            os._exit(code_of_write(number))
        print(when, number, os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
CATALOGUE = """
from vibench.acquisition.campaign import list_recordings
first = list_recordings(folder)
arm()
print(len(first), len(list_recordings(folder, "all")))
"""


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    return build_library(tmp_path_factory.mktemp("library"))


@pytest.fixture(scope="module")
def runs(library):
    with KilledCampaigns(library) as runs:
        yield runs


def run_with_fault(library, code, folder, call, when):
    arguments = (folder, list(CALLS).index(call), WHEN.index(when), errno.ENOSPC)
    return subprocess.run(
        [sys.executable, "-c", ARMED + code, *map(str, arguments)],
        env={**os.environ, "LD_PRELOAD": str(library), LIBRARY: str(library)},
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=False,
    )


@pytest.mark.thorough
@pytest.mark.parametrize("code", [EXPORT, STOP, ANNOUNCEMENT])
def test_a_file_is_reported_as_written_only_if_it_exists(library, tmp_path, code):
    refused = run_with_fault(library, code, tmp_path, "rename", "before")
    assert "No space left on device" in refused.stderr
    assert [each.name for each in tmp_path.iterdir()] == (["file.coming"] if code is ANNOUNCEMENT else [])
    (tmp_path / "file.coming").unlink(missing_ok=True)  # as the caller of `rename` does
    made = run_with_fault(library, code, tmp_path, "rename", "after")
    assert (made.returncode, made.stderr) == (0, "")
    assert [each.name for each in tmp_path.iterdir()] == ["file"]
    assert (tmp_path / "file").read_text() == "all of it"


@pytest.mark.thorough
def test_an_export_succeeds_even_if_its_temporary_file_cannot_be_removed(library, tmp_path):
    made = run_with_fault(library, EXPORT, tmp_path, "unlink", "before")
    assert (made.returncode, made.stderr) == (0, "")
    assert (tmp_path / "file").read_text() == "all of it"


@pytest.mark.thorough
@pytest.mark.parametrize("when", WHEN)
def test_a_result_is_reported_as_added_only_if_it_is_stored(library, tmp_path, when):
    path = tmp_path / "dwell.h5"
    path.write_bytes(good_recordings()["dwell.h5"])
    made = run_with_fault(library, RESULT, tmp_path, "rename", when)
    assert (made.returncode == 0) == (b"all of it" in path.read_bytes()) == (when == "after")
    assert [each.name for each in tmp_path.iterdir()] == ["dwell.h5"]


@pytest.mark.thorough
@pytest.mark.parametrize("writer", HDF5_WRITERS)
def test_a_refused_or_interrupted_write_of_hdf5_leaves_no_file(library, tmp_path, writer):
    """Each writer meets one error before, inside and after a write, and the next writer the other error."""
    folder = tmp_path / "folder"
    folder.mkdir()
    for name in ("cut_off.h5.part", "dwell.h5"):
        (folder / name).write_bytes(good_recordings()[name])
    errors = (errno.ENOSPC, errno.EINTR)
    faults = [errors[(list(HDF5_WRITERS).index(writer) + column) % 2] for column in range(len(WHEN))]
    code = f"FAULTS = {faults}\n{HDF5_WRITERS[writer]}{IN_FORKS}"
    made = run_with_fault(library, code, folder, "pwrite", "before")
    assert made.stderr == ""
    assert {line.split()[0] for line in made.stdout.splitlines()} == {"0", "1", "2"}
    assert {line.split()[2] for line in made.stdout.splitlines()} == {"1"}, made.stdout


@pytest.mark.thorough
@pytest.mark.parametrize("when", WHEN)
def test_recordings_are_listed_even_if_the_catalogue_cannot_be_removed(library, tmp_path, when):
    (tmp_path / "dwell.h5").write_bytes(good_recordings()["dwell.h5"])
    listed = run_with_fault(library, CATALOGUE, tmp_path, "unlink", when)
    assert (listed.stdout, listed.stderr) == ("1 1\n", "")


READERS = """
import shutil
from tests.attack.recordings_kills import LIBRARY
from vibench.acquisition import RecordingError, open_recording
from vibench.acquisition.campaign import list_recordings, verify_recordings
from vibench.analysis import analyse
from vibench.analysis.errors import AnalysisError
from vibench.analysis.exchange import Format, excerpt, export_samples, open_source
shim = ctypes.CDLL(os.environ[LIBRARY])
def read_source(path):
    with open_source(path) as source:
        source.read(source.channels[-1], 0, 100)
READ = {
    "verify": lambda path: verify_recordings(path)[0].sentence,
    "catalogue": lambda path: list_recordings(path.parent)[0].reason,
    "analyse": analyse,
    "import": read_source,
}
PREAD = 5
for name, read in READ.items():
    for number in range(1, 300, 9):
        copy = folder.with_name(f"{name}-{number}")
        shutil.copytree(folder, copy)
        shim.arm(PREAD, number, 0, 5, bytes(copy))
        try:
            said = str(read(copy / "dwell.h5"))
        except (RecordingError, AnalysisError) as error:
            said = str(error)
        left = ctypes.c_int.in_dll(shim, "left").value
        if left > 0:
            break
        if "could not be read (Input/output error)" not in said or "damaged" in said:
            print(name, number, said)
    shim.arm(PREAD, 10**6, 0, 5, bytes(copy))
    if name == "catalogue":
        assert list_recordings(copy)[0].verdict == "samples not checked", list_recordings(copy)
    print(name, number)
"""


@pytest.mark.thorough
def test_a_read_error_is_not_reported_as_damage(library, tmp_path):
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "dwell.h5").write_bytes(good_recordings()["dwell.h5"])
    made = run_with_fault(library, READERS, folder, "pwrite", "before")
    assert made.stderr == ""
    assert len(made.stdout.splitlines()) == 4, made.stdout


@pytest.mark.thorough
@pytest.mark.parametrize("number", [1, 2, 3])
def test_a_rename_that_succeeds_but_reports_an_error_does_not_end_the_campaign(runs, tmp_path, number):
    recordings_kills.write_campaign(tmp_path, "virtual_rig_streaming")
    run = runs.measure(tmp_path, kind="rename after ENOSPC", number=number)
    assert (run.code, run.err) == (0, "")
    assert at_the_end(tmp_path / "out", 2) == []


@pytest.mark.thorough
@pytest.mark.parametrize("when", ["before", "after"])
def test_a_point_recovered_after_a_journal_failure_is_not_repeated(runs, tmp_path, when):
    recordings_kills.write_campaign(tmp_path, "virtual_rig_streaming")
    out = tmp_path / "out"
    refused = runs.measure(tmp_path, kind="ftruncate before ENOSPC", number=4)
    assert "All committed samples are safe in out/weak.h5.part" in refused.err
    # The seventh sync of a resume is the commit that would count the recovered recording.
    refused = runs.measure(tmp_path, "--resume", kind=f"fsync {when} EIO", number=7)
    assert "the journal out/killed.campaign.sqlite cannot be read or written" in refused.err
    assert [path.name for path in out.glob("*.h5*")] == ["weak.h5"]
    assert read_journal(out / "killed.campaign.sqlite")[0].state is JournalPointState.FAILED
    resumed = runs.measure(tmp_path, "--resume")
    assert (resumed.code, resumed.err) == (0, "")
    assert at_the_end(out, 2) == []
