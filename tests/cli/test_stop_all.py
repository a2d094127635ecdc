"""`vibench stop` in an emergency stops every driving program without naming one."""

import subprocess
import sys
from contextlib import ExitStack, contextmanager

import pytest

from tests.frozen import frozen
from tests.windows_here import sees_locks
from vibench.acquisition.stopping.program import (
    Program,
    announced_programs,
    engines_folder,
    facts_of_this_process,
    note_open_bench,
)
from vibench.sim.operating_system.this import OpenFile

DRIVING = """
import sys
from threading import Event
from vibench.acquisition import StopSwitch, stop_on_signal

switch, clock = StopSwitch(), Event()
with stop_on_signal(switch, sys.argv[1]):
    print("driving", flush=True)
    while switch.request is None:
        clock.wait(0.01)
print(switch.request.level, switch.request.reason)
"""
CONTAINER = ("unshare", "--user", "--map-root-user", "--pid", "--fork", "--mount-proc")
"""A process number space as in a container, with a shared state folder."""

pytestmark = [sees_locks, pytest.mark.usefixtures("own_state")]


@contextmanager
def driving_program(what, *within):
    with subprocess.Popen(
        [*within, sys.executable, "-c", DRIVING, what],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as program:
        try:
            if program.stdout.readline() != "driving\n":
                pytest.skip(f"this user may make no container: {program.stderr.read()}")
            yield program
        finally:
            program.kill()


def test_the_stop_command_without_a_name_stops_every_program(vibench_here, tmp_path):
    with driving_program("north") as north, driving_program("south") as south:
        told = vibench_here("stop", "--level", "off", "--reason", "smoke", cwd=tmp_path)
        assert told.returncode == 0, told.stderr
        for what, program in (("north", north), ("south", south)):
            assert f"{what}, process {program.pid}, has carried out the stop (off)" in told.stdout
            assert program.communicate(timeout=20)[0] == "off smoke\n"


def test_the_stop_command_with_a_name_stops_only_that_program(vibench_here, tmp_path):
    with driving_program("north") as north, driving_program("south") as south:
        assert vibench_here("stop", "--pid", north.pid, cwd=tmp_path).returncode == 0
        north.wait(20)
        assert [each.what for each in announced_programs(Program)] == ["south"]
        assert south.poll() is None


def test_a_hold_without_a_named_program_is_refused_if_several_programs_run(vibench_here, tmp_path):
    with driving_program("north"), driving_program("south"):
        told = vibench_here("stop", "--level", "hold", cwd=tmp_path)
        assert told.returncode == 1
        assert len(announced_programs(Program)) == 2


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGSTOP")
def test_a_blocked_program_is_named_and_all_other_programs_are_stopped(vibench_here, tmp_path):
    with driving_program("hangs") as hangs, driving_program("south") as south:
        with frozen(hangs.pid):
            told = vibench_here("stop", "--level", "abort", cwd=tmp_path)
            assert south.communicate(timeout=20)[0] == "abort vibench stop\n"
            assert told.returncode == 1
            assert f"south, process {south.pid}, has carried out the stop (abort)" in told.stdout
            assert f"hangs, process {hangs.pid} runs but does not answer" in told.stderr
        assert hangs.communicate(timeout=20)[0] == "abort vibench stop\n"


@pytest.mark.skipif(sys.platform != "linux", reason="containers as Linux has them")
def test_all_programs_are_found_in_containers_that_share_a_state_folder(vibench_here, tmp_path):
    """Both have process number 1 in their containers; neither may overwrite the other's announcement."""
    with ExitStack() as running:
        programs = [running.enter_context(driving_program(what, *CONTAINER)) for what in ("north", "south")]
        told = vibench_here("stop", "--level", "abort", "--reason", "smoke", cwd=tmp_path)
        assert told.returncode == 0, told.stderr
        assert "north, process 1, has carried out the stop (abort)" in told.stdout
        assert "south, process 1, has carried out the stop (abort)" in told.stdout
        assert [each.communicate(timeout=20)[0] for each in programs] == ["abort smoke\n"] * 2
    assert all(".silent-" in each.name for each in engines_folder().iterdir())


@contextmanager
def on_another_computer(what):
    """Announce a program of another computer with the same home folder, and hold its lock."""
    facts = facts_of_this_process(what)
    boot, *others = facts["process_start"].split("_")
    assert others
    there = facts | {"process_start": "_".join([boot[::-1], *others]), "computer": "lab2"}
    path = engines_folder() / f"{facts['pid']}.{there['process_start']}.json"
    path.write_text(Program.model_validate(there).model_dump_json())
    lock = OpenFile(path)
    assert lock.is_locked_alone()
    yield path
    lock.close()


@pytest.mark.skipif(sys.platform != "linux", reason="how Linux numbers its starts")
def test_a_program_on_another_computer_is_reported_as_unreachable(vibench_here, tmp_path):
    there = "Programs on other computers were not reached: night (process"
    with on_another_computer("night") as path:
        alone = vibench_here("stop", cwd=tmp_path)
        assert alone.returncode == 1
        assert "no engine is running" in alone.stderr
        assert there in alone.stderr
        with driving_program("here"):
            told = vibench_here("stop", cwd=tmp_path)
        assert told.returncode == 0
        assert there in told.stdout
        assert "run 'vibench stop' there" in told.stdout
    assert "not reached" not in vibench_here("stop", cwd=tmp_path).stderr
    assert path.exists()


@pytest.mark.skipif(sys.platform != "linux", reason="how Linux numbers its starts")
def test_a_program_from_before_a_restart_is_reported_until_its_bench_is_silent(vibench_here, tmp_path):
    """The generator has its own mains supply, and keeps playing while the computer restarts."""
    facts = facts_of_this_process("night")
    boot, *others = facts["process_start"].split("_")
    before = facts | {"process_start": "_".join([boot[::-1], *others]), "rigs": ("lab",)}
    path = engines_folder() / f"{facts['pid']}.{before['process_start']}.json"
    path.write_text(Program.model_validate(before).model_dump_json())
    for each in ("ramp", "hold"):  # the short and the complete command
        told = vibench_here("stop", "--level", each, cwd=tmp_path)
        assert told.returncode == 1
        assert "night" in told.stderr
        assert "ended without confirming" in told.stderr
        assert "switch the amplifier off" in told.stderr
    note_open_bench("lab")
    assert not path.exists()


@pytest.mark.parametrize("given", ["", "given"])
def test_a_running_program_is_found_from_every_working_folder(vibench_here, tmp_path, monkeypatch, given):
    monkeypatch.delenv("VIBENCH_STATE_DIR")
    monkeypatch.setenv("XDG_STATE_HOME", given)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "elsewhere").mkdir()
    with driving_program("night"):
        told = vibench_here("stop", cwd=tmp_path / "elsewhere")
        assert told.returncode == 0, told.stderr
