"""Versions of the software, which show whether two machines compute the same results."""

import json
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version

from ..engine.library import physics_digest

PACKAGES = ("vibench", "numpy", "scipy")


@cache
def software() -> str:
    """Return package versions and a digest of the simulation's sources, as JSON text with sorted keys."""
    found = {"python": platform.python_version(), "sim_sources": physics_digest()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return json.dumps(found, sort_keys=True)
