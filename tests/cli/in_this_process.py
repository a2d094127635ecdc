"""Commands invoked in this process without a folder: their result, their JSON, or their refusal."""

import json

from typer.testing import CliRunner

from vibench.cli.__main__ import app


def invoke(*arguments):
    return CliRunner().invoke(app, [str(each) for each in arguments])


def json_of(*arguments):
    result = invoke(*arguments, "--json")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


def refusal_of(*arguments):
    """Return the sentence with which a command refuses."""
    result = invoke(*arguments)
    assert result.exit_code != 0
    return str(result.exception)
