"""Options of commands come from the fields of requests: names, help, defaults, and error messages."""

import re

import pytest
import typer

from vibench.analysis import AnalysisOptions
from vibench.analysis.dynamics import BranchRequest, ChainRequest, SpecimenChoice, SpectrumRequest
from vibench.analysis.prediction.field_docstrings import field_docstring
from vibench.cli.__main__ import COMMANDS
from vibench.cli.options import option_name

MODELS = {
    "branches": BranchRequest,
    "spectrum": SpectrumRequest,
    "chain": ChainRequest,
    "predict": SpecimenChoice,
    "analyse": AnalysisOptions,
}


@pytest.mark.parametrize("name", MODELS)
def test_options_take_their_help_and_their_default_from_fields_of_the_request(vibench_here, tmp_path, name):
    shown = " ".join(vibench_here(name, "--help", cwd=tmp_path).stdout.split())
    command = typer.main.get_command(COMMANDS[name].load())
    fields = {field for field, model in command.callback.fields.items() if model is MODELS[name]}
    assert fields
    for field in fields:
        said, declared = (
            " ".join(field_docstring(MODELS[name], field).split()),
            MODELS[name].model_fields[field],
        )
        assert said in shown
        (option,) = (each for each in command.params if each.name == field)
        assert option.opts == [f"--{option_name(field)}"]
        if isinstance(declared.default, int | float):
            assert f"{said} [default: {declared.default}]" in shown


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_has_a_help_text(vibench_here, tmp_path, name):
    shown = vibench_here(name, "--help", cwd=tmp_path)
    assert shown.returncode == 0
    assert re.findall(r"^  --\S+( \S+)?$\n(?=  --|\n|$)", shown.stdout, flags=re.MULTILINE) == []
