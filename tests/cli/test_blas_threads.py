"""The command sets the threads of linear algebra before numpy reads them, and respects a user's choice."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
import os, sys
import vibench.cli.__main__, vibench.cli.measure
order = list(sys.modules)
print(os.environ["OPENBLAS_NUM_THREADS"], order.index("vibench.cli.blas_threads") < order.index("numpy"))
"""


@pytest.mark.thorough
@pytest.mark.parametrize(("chosen", "told"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "2"}, "2")])
def test_one_thread_unless_the_user_says_otherwise(chosen, told):
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    result = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env={**environment, **chosen},
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert result.stdout.split() == [told, "True"]
