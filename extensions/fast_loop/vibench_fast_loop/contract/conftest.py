"""Fixtures and options of vibench's contract tests, which the tests of this folder use too."""

from vibench.acquisition.contract.conftest import bench, pytest_collection_modifyitems, rig

__all__ = ["bench", "pytest_collection_modifyitems", "rig"]
