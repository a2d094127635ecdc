"""Which physics this process runs: a digest of all sources of `vibench.sim`, the native ones included."""

import hashlib
from functools import cache
from pathlib import Path

from .library import native_digest

SIM = Path(__file__).parents[1]


@cache
def physics_digest() -> str:
    """Return the digest, the same in a checkout and in an installed wheel."""
    digest = hashlib.sha256(native_digest().encode())
    for path in sorted(each for kind in ("*.py", "*.pyi") for each in SIM.rglob(kind)):
        digest.update(path.relative_to(SIM).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
