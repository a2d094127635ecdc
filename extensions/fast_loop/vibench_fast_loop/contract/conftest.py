"""The bench and the options are those of the contract tests of vibench."""

from vibench.acquisition.contract.conftest import bench, pytest_collection_modifyitems, rig

__all__ = ["bench", "pytest_collection_modifyitems", "rig"]
