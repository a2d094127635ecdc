"""The command list is shown without importing the commands' modules."""

import subprocess
import sys
from inspect import getdoc

import pytest
import typer

from vibench.cli.__main__ import COMMANDS

HEAVY = {"numpy", "scipy", "matplotlib", "h5py", "pydantic", "pyvisa", "nidaqmx", "grpc", "PySide6"}


@pytest.mark.parametrize("name", COMMANDS)
def test_the_command_list_shows_the_first_help_line_of_each_command(name):
    place = COMMANDS[name]
    application = place.load()
    told = application.info.help
    if not isinstance(told, str):
        (command,) = application.registered_commands
        told = getdoc(command.callback)
    assert told.splitlines()[0] == place.summary


WITHOUT_A_RESULT = {"twin", "stop", "release", "gui", "serve-rig", "bench", "schema", "warm"}
"""Their result is not a document; ``bench`` is a group, and ``schema`` always prints JSON."""


@pytest.mark.parametrize("name", sorted(COMMANDS.keys() - WITHOUT_A_RESULT))
def test_every_command_with_a_result_has_a_json_option(name):
    command = typer.main.get_command(COMMANDS[name].load())
    assert "--json" in {option for each in command.params for option in each.opts}


def test_the_command_list_loads_none_of_the_large_libraries():
    loaded = "import vibench.cli.__main__, sys; print(*sys.modules)"
    process = subprocess.run([sys.executable, "-c", loaded], capture_output=True, text=True, check=True)
    assert HEAVY.isdisjoint(process.stdout.split())


@pytest.mark.parametrize("point", [("20e-6", "130"), ("5e-6", "260")], ids=["periodic", "chaotic"])
def test_a_prediction_without_a_file_needs_neither_scipy_nor_h5py(point):
    program = (
        "import atexit, sys; from vibench.command import main\n"
        "atexit.register(lambda: print('loaded', *sys.modules, file=sys.stderr)); main()"
    )
    words = ["predict", "--amplitude", point[0], "--frequency", point[1]]
    process = subprocess.run(
        [sys.executable, "-c", program, *words], capture_output=True, text=True, check=True
    )
    loaded = process.stderr.partition("loaded ")[2].split()
    assert "vibench.sim.scene" in loaded
    assert {"scipy", "h5py", "matplotlib"}.isdisjoint(loaded)


def test_a_command_group_loads_its_own_commands(output_of):
    assert "vibench bench check [OPTIONS]" in output_of("bench", "check", "--help")
    assert isinstance(COMMANDS["bench"].load(), typer.Typer)
