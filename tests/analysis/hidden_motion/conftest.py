"""Recordings of the virtual rig, each made once, and specimens with a wrong description."""

from dataclasses import replace

import pytest

from tests.analysis.hidden_motion import live_world as live, shaken_world as world


@pytest.fixture(scope="session")
def live_world():
    """Return a function that shakes the rig's specimen and tracks it with a live twin."""
    return live.live_world


@pytest.fixture
def at_once():
    """Return an executor that computes each job at once in the calling thread."""
    return live.AtOnce()


@pytest.fixture
def virtual_rig():
    """Configuration of the shipped virtual rig."""
    return world.RIG


@pytest.fixture(scope="session")
def world_recording(tmp_path_factory):
    """Return a function that records a simulated specimen; equal requests are recorded once."""
    made = {}

    def make(kind, level_vpp, **how):
        key = (kind, level_vpp, repr(sorted(how.items())))
        if key not in made:
            made[key] = world.shake(tmp_path_factory.mktemp("shaken"), kind, level_vpp, **how)
        return made[key]

    return make


def other(specimen, *, m1=1.0, gaps=(1.0, 1.0), dampings=(1.0, 1.0, 1.0)):
    """Return a specimen whose m1, gaps and dampings are multiplied by the given factors."""
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
    """Return the function that describes a specimen with wrong values."""
    return other
