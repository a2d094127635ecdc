"""The command sets threads and memory before numpy reads them, and respects a user's choice."""

import os
import subprocess
import sys

import pytest

SCRIPT = """
import os, sys
import vibench.cli.__main__, vibench.cli.measure
order = list(sys.modules)
print(os.environ["OPENBLAS_NUM_THREADS"], os.environ["MALLOC_MMAP_THRESHOLD_"])
print(order.index("vibench.cli.environment") < order.index("numpy"))
"""


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("chosen", "expected"),
    [
        ({}, ["1", "4194304"]),
        ({"OPENBLAS_NUM_THREADS": "2", "MALLOC_MMAP_THRESHOLD_": "131072"}, ["2", "131072"]),
    ],
)
def test_the_thread_and_memory_settings_chosen_by_the_user_are_kept(chosen, expected):
    numbers = ("OPENBLAS_NUM_THREADS", "MALLOC_MMAP_THRESHOLD_")
    environment = {name: value for name, value in os.environ.items() if name not in numbers}
    result = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        env={**environment, **chosen},
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert result.stdout.split() == [*expected, "True"]
