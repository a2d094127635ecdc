"""Fixtures and options of vibench's contract tests, for the tests of this folder."""

from vibench.acquisition.contract.conftest import bench, pytest_collection_modifyitems, rig

__all__ = ["bench", "pytest_collection_modifyitems", "rig"]
