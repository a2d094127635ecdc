"""Fixtures of the tests of acquisition."""

from tests.acquisition.conftest import rig

__all__ = ["rig"]
