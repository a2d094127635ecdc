"""Only one program can use a bench, for all users and all spellings of its addresses."""

import os
import sys
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from vibench.acquisition import open_bench
from vibench.acquisition.bench import BenchLock
from vibench.acquisition.errors import InstrumentBusy
from vibench.acquisition.rig import load_rig

RIG = load_rig("lab_rig")
NOBODY = 65534
posix = pytest.mark.skipif(not hasattr(os, "fork"), reason="modes and links as POSIX has them")


@pytest.fixture(autouse=True)
def shared(monkeypatch):
    """Create a folder like /tmp: every user may create files, and remove only their own."""
    with TemporaryDirectory() as folder:
        Path(folder).chmod(0o1777)
        monkeypatch.setenv("VIBENCH_LOCK_DIR", folder)
        yield Path(folder)


@pytest.fixture
def user(tmp_path_factory, monkeypatch):
    """Act as a user with a separate state folder, with this user number if given."""

    @contextmanager
    def somebody(number=None):
        with TemporaryDirectory() as state:
            if number is not None:
                os.chown(state, number, number)
                os.seteuid(number)
            monkeypatch.setenv("VIBENCH_STATE_DIR", state)
            try:
                yield
            finally:
                if number is not None:
                    os.seteuid(0)

    return somebody


def generator(**changed):
    return RIG.model_copy(update={"generator": RIG.generator.model_copy(update=changed)})


def test_a_bench_that_another_user_drives_is_refused(user):
    with (
        user(),
        closing(BenchLock.of(RIG)),
        user(),
        pytest.raises(InstrumentBusy, match=rf"in use by process {os.getpid()} of [\w.-]+\. Nothing was"),
    ):
        open_bench(RIG, calibration="waived")
    with user(), closing(BenchLock.of(RIG)):
        pass


@posix
@pytest.mark.parametrize(("first", "second"), [(None, NOBODY), (NOBODY, None), (NOBODY, NOBODY - 1)])
def test_a_second_program_is_refused_until_the_first_program_ends(user, first, second):
    if os.geteuid() != 0:
        pytest.skip("only root can be another user")
    for one, other in ((first, second), (second, first)):
        with user(one):
            held = BenchLock.of(RIG)
        with user(other), pytest.raises(InstrumentBusy, match=f"in use by process {os.getpid()} of"):
            BenchLock.of(RIG)
        held.close()


@pytest.mark.parametrize(
    ("resource", "other"),
    [
        ("USB0::0x0699::0x0353::C012345::INSTR", "USB0::1689::851::C012345::INSTR"),
        ("USB0::0x0699::0x0353::C012345::INSTR", "usb::0x699::0x0353::C012345::0::instr"),
        ("TCPIP0::127.0.0.1::5025::SOCKET", "TCPIP::localhost::5025::SOCKET"),
    ],
)
def test_one_generator_under_two_names_has_one_lock(user, resource, other):
    first = generator(resource=resource)
    daq = first.daq.model_copy(update={"server": "another:31763"})
    second = generator(resource=other).model_copy(update={"daq": daq})
    with closing(BenchLock.of(first)), pytest.raises(InstrumentBusy, match="in use by process"):
        BenchLock.of(second)


def test_two_benches_on_one_computer_have_separate_locks():
    other = generator(resource="USB0::0x0699::0x0353::C999999::INSTR")
    other = other.model_copy(update={"daq": other.daq.model_copy(update={"device": "Dev2"})})
    with closing(BenchLock.of(RIG)), closing(BenchLock.of(other)):
        pass


def a_symbolic_link(path, aim):
    path.symlink_to(aim)


def a_hard_link(path, aim):
    path.hardlink_to(aim)


def a_pipe(path, aim):
    os.mkfifo(path)


def a_folder(path, aim):
    path.mkdir()


@posix
@pytest.mark.timeout(10)
@pytest.mark.parametrize("trap", [a_symbolic_link, a_hard_link, a_pipe, a_folder])
def test_a_foreign_file_in_place_of_a_lock_is_refused_and_kept(shared, tmp_path, trap):
    BenchLock.of(RIG).close()
    aim = tmp_path / "precious"
    aim.write_text("kept")
    for path in list(shared.iterdir()):
        path.unlink()
        trap(path, aim)
    with pytest.raises(InstrumentBusy, match=r"cannot be marked as in use: .*\.lock cannot be locked"):
        BenchLock.of(RIG)
    assert aim.read_text() == "kept"


def test_only_the_process_number_in_a_lock_file_is_shown(shared, monkeypatch):
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(shared))
    with closing(BenchLock.of(RIG)):
        for path in shared.iterdir():
            path.write_bytes(b"\x1b[2J of everything")
        with pytest.raises(InstrumentBusy, match="in use by process unknown"):
            BenchLock.of(RIG)


@pytest.mark.skipif(sys.platform != "linux", reason="systemd's")
def test_lock_files_have_the_sticky_bit_that_protects_them_from_cleanup(shared):
    with closing(BenchLock.of(RIG)):
        assert all(path.stat().st_mode & 0o1777 == 0o1666 for path in shared.iterdir())
