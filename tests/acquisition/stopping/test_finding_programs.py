"""Programs that drive a bench are found and stopped, whatever the state folder contains."""

import os
import subprocess
import sys
from pathlib import Path
from subprocess import PIPE
from tempfile import TemporaryDirectory
from threading import Event, Thread
from time import monotonic

import pytest

from vibench.acquisition import (
    AcquisitionError,
    StopLevel,
    StopSwitch,
    open_bench,
    shipped,
    stop_on_signal,
)
from vibench.acquisition.engine import EngineGone, StopDelivery, programs_to_stop, stop_engine
from vibench.acquisition.engine._client import EngineAddress, announce
from vibench.acquisition.stopping.program import (
    KeptStops,
    Program,
    announced_programs,
    engines_folder,
    note_open_bench,
)
from vibench.acquisition.stopping.stop import DRIVES_ON
from vibench.command import stop_programs
from vibench.stop_files import Fate, fate_of, stop_path, write_stop_file

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="pipes and modes as POSIX has them")

NOBODY = 65534


@pytest.fixture(autouse=True)
def own_state(tmp_path_factory, monkeypatch):
    state = tmp_path_factory.mktemp("state")
    monkeypatch.setenv("VIBENCH_STATE_DIR", str(state))
    return state


def until(is_so):
    give_up_s = monotonic() + 20
    while not is_so():
        assert monotonic() < give_up_s
        Event().wait(0.01)


def binary_announcement(folder):
    (folder / "7.json").write_bytes(b"\xff\xfe{")


def pipe(folder):
    os.mkfifo(folder / "7.json")


def subfolder(folder):
    (folder / "7.json").mkdir()


def circular_link(folder):
    (folder / "7.json").symlink_to("7.json")


def non_numeric_name(folder):
    (folder / "²").touch()


def undecodable_name(folder):
    Path(os.fsdecode(os.fsencode(folder) + b"/\xff.json")).touch()


@pytest.mark.timeout(15)
@pytest.mark.parametrize(
    "litter", [binary_announcement, pipe, subfolder, circular_link, non_numeric_name, undecodable_name]
)
def test_other_files_in_the_folder_do_not_hide_announcements(litter):
    switch = StopSwitch()
    with stop_on_signal(switch, "dwell"):
        litter(engines_folder())
        assert stop_engine(programs_to_stop(None)[0], StopLevel.ABORT, "smoke") is StopDelivery.TAKEN
    assert switch.request.reason == "smoke"


@pytest.mark.timeout(15)
def test_a_stop_file_that_is_a_pipe_causes_a_stop_without_a_reason():
    switch = StopSwitch()
    with stop_on_signal(switch, "dwell"):
        (program,) = announced_programs(Program)
        os.mkfifo(engines_folder() / f"{program.pid}.{program.process_start}.stop-off")
        until(lambda: switch.request is not None)
    assert switch.request.level is StopLevel.OFF


def test_a_stop_with_an_undecodable_reason_is_carried_out():
    switch = StopSwitch()
    with stop_on_signal(switch, "dwell"):
        assert stop_engine(programs_to_stop(None)[0], "abort", "smoke \udcff") is StopDelivery.TAKEN
    assert switch.request.reason == "smoke ?"


def test_an_announcement_is_restored_after_the_state_folder_was_emptied(own_state):
    switch = StopSwitch()
    with stop_on_signal(switch, "dwell"):
        engines_folder().rename(own_state / "moved away")
        until(lambda: announced_programs(Program))
        assert stop_engine(programs_to_stop(None)[0], "abort", "smoke") is StopDelivery.TAKEN


@pytest.mark.thorough
def test_a_killed_program_is_reported_until_its_rig_was_opened_again_and_is_silent(capsys):
    script = (
        "from vibench.acquisition import *; from vibench.acquisition.stopping.program import note_open_bench;"
        "note_open_bench('lab'); a = stop_on_signal(StopSwitch(), 'x'); a.__enter__(); input(1)"
    )
    with subprocess.Popen([sys.executable, "-uc", script], stdin=PIPE, stdout=PIPE) as process:
        process.stdout.read(1)
        (left,) = engines_folder().glob("*.json")
        stop = left.with_suffix(".stop-ramp")
        process.kill()
        process.wait()
        stop.touch()
    note_open_bench("another")
    for _ in range(2):
        assert stop_programs("ramp", "smoke", "") == 1
        assert "x, process" in (said := capsys.readouterr().err)
        assert "switch the amplifier off" in said
        with pytest.raises(EngineGone, match="switch the amplifier off"):
            stop_engine(programs_to_stop(None)[0])
        with stop_on_signal(StopSwitch(), "dwell"):
            assert [each.what for each in announced_programs(Program)] == ["dwell"]
    note_open_bench("lab")
    assert not list(engines_folder().iterdir()), left


OPENED_AND_KILLED = """
import os, signal, sys
from pathlib import Path
from vibench.acquisition import StopSwitch, open_bench, stop_on_signal
with open_bench(Path(sys.argv[1])), stop_on_signal(StopSwitch(), "x"):
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.thorough
def test_a_killed_program_is_reported_until_the_same_generator_is_silent(tmp_path, capsys):
    """Two rigs may have the same name, for example after a file was copied."""
    usual = shipped("hardware_configs/virtual_rig.toml")
    other = tmp_path / "other.toml"
    other.write_text(usual.read_text(encoding="utf-8").replace("::C019999::", "::C010001::"))
    subprocess.run([sys.executable, "-c", OPENED_AND_KILLED, other], check=False)
    with open_bench(usual):
        pass
    assert stop_programs("ramp", "smoke", "") == 1
    assert "switch the amplifier off" in capsys.readouterr().err
    with open_bench(other):
        pass
    assert not list(engines_folder().iterdir())


def test_announcements_are_found_after_the_computer_was_renamed(monkeypatch):
    with stop_on_signal(StopSwitch(), "dwell"):
        monkeypatch.setattr("platform.node", lambda: "renamed")
        assert [each.what for each in announced_programs(Program)] == ["dwell"]


def test_a_running_program_that_refuses_connections_is_stopped():
    pressed = []
    with announce(
        EngineAddress(host="127.0.0.1", port=1, token="t"), "night", lambda *told: pressed.append(told)
    ):
        assert stop_engine(programs_to_stop(None)[0], "abort", "smoke") is StopDelivery.TAKEN
    assert pressed == [(StopLevel.ABORT, "smoke")]


@pytest.fixture
def state_of_other_user(monkeypatch):
    """Yield a state folder of a user who cannot read files that root writes there."""
    if os.geteuid() != 0:
        pytest.skip("only root can be another user")
    with TemporaryDirectory() as state:
        monkeypatch.setenv("VIBENCH_STATE_DIR", state)
        os.chown(state, NOBODY, NOBODY)
        os.chown(engines_folder(), NOBODY, NOBODY)
        yield Path(state)
        os.seteuid(0)


def test_a_user_can_stop_a_program_that_root_runs_with_the_state_folder_of_this_user(state_of_other_user):
    switch = StopSwitch()
    with stop_on_signal(switch, "dwell"):
        os.seteuid(NOBODY)
        assert stop_engine(programs_to_stop(None)[0], "abort", "smoke") is StopDelivery.TAKEN
        os.seteuid(0)
    assert switch.request.reason == "smoke"


@pytest.mark.thorough
def test_a_stop_by_root_waits_while_the_program_of_a_user_ramps_down(state_of_other_user, monkeypatch):
    """The program updates the stop's file as a sign of life, and may not do that to a file of root."""
    monkeypatch.setattr("vibench.stop_files.HEEDED_S", 0.5)
    stop = stop_path(str(engines_folder()), 7, "start", "ramp")
    write_stop_file(stop, "smoke")
    heard, clock = [], Event()
    DRIVES_ON.begin("drive")
    os.seteuid(NOBODY)
    kept = KeptStops(7, "start", lambda level, reason: heard.append(reason), engines_folder())

    def ramp_down():
        for _ in range(15):
            DRIVES_ON.note_advance()
            kept.obey()
            clock.wait(0.1)
        DRIVES_ON.confirm_silence("drive")
        kept.obey()

    ramp = Thread(target=ramp_down)
    ramp.start()
    try:
        assert fate_of(stop) is Fate.SILENT
    finally:
        ramp.join()
        kept.close()
    assert heard == ["smoke"]


def test_an_unreadable_folder_is_not_treated_as_empty(state_of_other_user):
    os.chown(engines_folder(), 0, 0)
    os.seteuid(NOBODY)
    with pytest.raises(AcquisitionError, match="the state folder cannot be searched"):
        programs_to_stop(None)[0]


def test_the_wrong_permissions_of_a_state_folder_are_corrected(state_of_other_user):
    engines_folder().chmod(0o300)
    os.seteuid(NOBODY)
    with stop_on_signal(StopSwitch(), "dwell"):
        assert programs_to_stop(None)[0].what == "dwell"


ON_A_FULL_DISK = """
import os, resource
from vibench.acquisition import AcquisitionError, StopSwitch, stop_on_signal
resource.setrlimit(resource.RLIMIT_FSIZE, (20, resource.RLIM_INFINITY))
try:
    with stop_on_signal(StopSwitch(), "a script"):
        print("it drives")
except AcquisitionError as error:
    print(error)
"""


def test_a_program_is_refused_without_leftovers_if_the_state_folder_is_full(own_state):
    script = [sys.executable, "-c", ON_A_FULL_DISK]
    ended = subprocess.run(script, capture_output=True, text=True, check=False)
    assert "a script cannot be entered in the state folder" in ended.stdout, ended.stderr
    assert [each.name for each in own_state.rglob("*") if each.is_file()] == []


def test_the_announcement_of_a_program_that_opened_a_bench_is_removed_when_the_program_ends():
    with stop_on_signal(StopSwitch(), "dwell"):
        note_open_bench("lab")
        assert [each.rigs for each in announced_programs(Program) if "lab" in each.rigs]
    assert not list(engines_folder().iterdir())
