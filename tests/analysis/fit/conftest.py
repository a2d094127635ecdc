"""Recordings of the virtual rig's world, as the tests of hidden motion make them."""

import importlib.util
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def world():
    """Give the module that shakes specimens in the world; the tests are no package."""
    place = Path(__file__).parents[1] / "hidden_motion" / "shaken_world.py"
    spec = importlib.util.spec_from_file_location("shaken_world", place)
    module = importlib.util.module_from_spec(spec)
    sys.modules.setdefault("shaken_world", module)
    spec.loader.exec_module(module)
    return module
