"""The fast `vibench stop` loads only the standard library and reports what it cannot verify."""

import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from vibench.acquisition.stopping.program import Program, announced_programs

from .test_stop_all import driving_program

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the complete command stops"),
    pytest.mark.usefixtures("own_state"),
]
COMMAND = (
    "import sys; sys.argv = ['vibench', 'stop', *sys.argv[1:]]; from vibench.command import main; main()"
)
LOADED = """
import sys
before = set(sys.modules)
sys.argv = ["vibench", "stop"]
from vibench.command import main
try:
    main()
finally:
    new = {each.partition(".")[0] for each in set(sys.modules) - before}
    print(*sorted(new - sys.stdlib_module_names - {"vibench"}))
    print(*sorted(each for each in sys.modules if each.startswith("vibench.")))
"""


def vibench_stop(*words, **variables):
    return subprocess.run(
        [sys.executable, "-c", COMMAND, *words],
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | variables,
    )


def test_the_fast_stop_loads_no_library_beyond_the_standard_library():
    with driving_program("north"):
        told = subprocess.run([sys.executable, "-c", LOADED], capture_output=True, text=True, check=True)
    said, others, ours = told.stdout.splitlines()
    assert "its output is off" in said
    assert (others, ours) == ("", "vibench.command vibench.stop_files")


def test_the_stop_command_takes_less_than_0_1_s_of_processor_time():
    with driving_program("north"):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        assert vibench_stop().returncode == 0
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < 0.1


@pytest.mark.parametrize(
    ("words", "told"),
    [(("--level", "off", "--reason", "smoke"), "off smoke"), (("--level=abort",), "abort vibench stop")],
)
def test_the_fast_stop_command_delivers_the_stop_with_its_options(words, told):
    with driving_program("north") as north:
        said = vibench_stop(*words)
        assert said.returncode == 0
        assert f"north, process {north.pid}, has carried out the stop" in said.stdout
        assert north.communicate(timeout=20)[0] == f"{told}\n"


def test_the_fast_stop_stops_the_named_program():
    with driving_program("north") as north, driving_program("south"):
        assert vibench_stop("--pid", str(north.pid)).returncode == 0
        north.wait(20)
        assert [each.what for each in announced_programs(Program)] == ["south"]


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("words", "code"), [(("--level", "loud"), 1), (("--level",), 2), (("--pid", "x"), 1), (("--reason=",), 1)]
)
def test_arguments_that_the_fast_stop_does_not_handle_are_passed_to_the_full_command(words, code):
    with driving_program("north") as north:
        told = vibench_stop(*words)
        assert told.returncode == code, told.stderr
        assert north.poll() is None


@pytest.mark.thorough
def test_the_fast_stop_gives_advice_about_a_killed_program():
    with driving_program("north") as north:
        north.kill()
        north.wait()
        for _ in range(2):
            told = vibench_stop()
            assert told.returncode == 1
            said = "ended without confirming that its output is off. The generator may still be driving"
            assert said in told.stderr


@pytest.mark.parametrize("is_killed", [False, True])
def test_control_characters_in_a_program_name_are_escaped(is_killed):
    with driving_program("a\x1b[2J\u202e\x9b1m") as hostile:
        if is_killed:
            hostile.kill()
            hostile.wait()
        told = vibench_stop()
    assert rf"a\x1b[2J\u202e\x9b1m, process {hostile.pid}" in (told.stderr if is_killed else told.stdout)


@pytest.mark.thorough
def test_a_suspended_program_is_not_reported_as_silent():
    with driving_program("north") as north:
        os.kill(north.pid, 19)
        told = vibench_stop("--level", "abort")
        os.kill(north.pid, 18)
        assert told.returncode == 1
        assert "switch the amplifier off" in " ".join(told.stderr.split())


@pytest.mark.thorough
def test_a_missing_state_folder_is_reported(tmp_path):
    told = vibench_stop(VIBENCH_STATE_DIR=str(Path(tmp_path) / "nowhere"))
    assert told.returncode == 1
    assert "no engine is running" in told.stderr
