"""The environment variables that vibench reads: docs/installation.md."""

import os
from collections.abc import Mapping
from types import MappingProxyType

from vibench.acquisition.recording import KEY_VARIABLE
from vibench.acquisition.rig import TOKEN_VARIABLE
from vibench.sim.operating_system import VARIABLE as STATE_VARIABLE

VARIABLES: Mapping[str, str] = MappingProxyType(
    {
        STATE_VARIABLE: "folder for locks, bench checks and learnt costs; the user's own if absent",
        TOKEN_VARIABLE: "token of a virtual rig that is served to other computers",
        KEY_VARIABLE: "file with the key that seals of recordings are signed with",
        "OPENBLAS_NUM_THREADS": "threads of linear algebra; 1 if absent, since the matrices are small",
        "NUMBA_CACHE_DIR": "folder for compiled kernels; beside the sources if absent",
        "QT_QPA_PLATFORM": "how Qt draws the window; 'offscreen' where there is no display",
        "PYQTGRAPH_QT_LIB": "binding of the window's plots; PySide6 if absent",
    }
)
"""Name: what it is for."""
SECRET = frozenset({TOKEN_VARIABLE})


def shown(name: str) -> str:
    """Give the value of a variable for others to read; of a secret, that there is one."""
    return "(set, secret)" if name in SECRET else os.environ[name]
