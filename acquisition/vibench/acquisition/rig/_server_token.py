"""The word that lets a client in to a virtual rig that is served beyond its own computer."""

import os

METADATA_KEY = "vibench-token"
"""Where a gRPC call carries it."""
VARIABLE = "VIBENCH_RIG_TOKEN"
"""Where our own programs find it: the environment, never a command line that others can read."""


def given_token() -> str:
    """Token from the environment; empty where none is needed."""
    return os.environ.get(VARIABLE, "")
