"""Recordings of the virtual rig's world, each made once, and specimens described otherwise than they are."""

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path

import pytest


def _load(name):
    """The tests are no package: a module beside this file is loaded by its path."""
    spec = importlib.util.spec_from_file_location(name, Path(__file__).with_name(f"{name}.py"))
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


world = _load("shaken_world")
live = _load("live_world")


@pytest.fixture(scope="session")
def live_world():
    """Shake the rig's specimen, and follow it with a live twin."""
    return live.live_world


@pytest.fixture
def at_once():
    """Where numbers are found before anything goes on."""
    return live.AtOnce()


@pytest.fixture
def virtual_rig():
    """The shipped virtual rig's configuration."""
    return world.RIG


@pytest.fixture(scope="session")
def world_recording(tmp_path_factory):
    """Shake a specimen in the world and record it; the same shaking is done once."""
    made = {}

    def make(kind, level_vpp, **how):
        key = (kind, level_vpp, repr(sorted(how.items())))
        if key not in made:
            made[key] = world.shaken(tmp_path_factory.mktemp("shaken"), kind, level_vpp, **how)
        return made[key]

    return make


def other(specimen, *, m1=1.0, gaps=(1.0, 1.0), dampings=(1.0, 1.0, 1.0)):
    """Describe a specimen with other numbers, each a factor."""
    lower, upper = specimen.gaps_m
    m0, mass, m2 = specimen.masses
    return replace(
        specimen,
        masses=(m0, m1 * mass, m2),
        dampings=tuple(f * c for f, c in zip(dampings, specimen.dampings, strict=True)),
        gap_m=gaps[1] * upper,
        lower_gap_m=gaps[0] * lower,
    )


@pytest.fixture
def described_otherwise():
    """Give a specimen other numbers than it has."""
    return other
