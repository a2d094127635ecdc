"""The command list is shown without importing the commands' modules."""

import subprocess
import sys
from inspect import getdoc

import pytest
import typer

from vibench.cli.__main__ import COMMANDS


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
"""Commands without a document as result; ``bench`` is a group, and ``schema`` always prints JSON."""


@pytest.mark.parametrize("name", sorted(COMMANDS.keys() - WITHOUT_A_RESULT))
def test_every_command_with_a_result_has_a_json_option(name):
    command = typer.main.get_command(COMMANDS[name].load())
    assert "--json" in {option for each in command.params for option in each.opts}


PROGRAM = """
import atexit, sys
from vibench.command import main
atexit.register(lambda: print("loaded", *sys.modules, file=sys.stderr))
main()
"""
LARGE = {"numpy", "scipy", "matplotlib", "h5py", "pydantic", "pyvisa", "nidaqmx", "grpc", "PySide6"}
NOT_TO_PREDICT = {"scipy", "h5py", "matplotlib"}


@pytest.mark.parametrize(
    ("words", "unneeded"),
    [
        (("--help",), LARGE | {"rich.markdown", "typer.rich_utils"}),
        (("predict", "--amplitude", "20e-6", "--frequency", "130"), NOT_TO_PREDICT),
        (("predict", "--amplitude", "5e-6", "--frequency", "260"), NOT_TO_PREDICT),
    ],
    ids=["the command list", "a periodic motion", "a chaotic motion"],
)
def test_a_command_loads_no_library_that_it_does_not_need(words, unneeded):
    process = subprocess.run(
        [sys.executable, "-c", PROGRAM, *words], capture_output=True, text=True, check=True
    )
    loaded = process.stderr.partition("loaded ")[2].split()
    assert "vibench.command" in loaded
    assert unneeded.isdisjoint(loaded)
    if words == ("--help",):
        assert process.stdout.index("Measure:") < process.stdout.index("Predict:")


def test_a_group_of_commands_can_load_its_commands(output_of):
    assert "vibench bench check [OPTIONS]" in output_of("bench", "check", "--help")
    assert isinstance(COMMANDS["bench"].load(), typer.Typer)
