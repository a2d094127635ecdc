"""Recordings of the virtual rig's world, each made once, and specimens described otherwise than they are."""

from dataclasses import replace

import pytest

from tests.analysis.hidden_motion import live_world as live, shaken_world as world


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
