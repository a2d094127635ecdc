"""`--allow-external`: files whose data lie in other files are read only when the user says so."""

from contextlib import AbstractContextManager, nullcontext
from typing import Annotated

from .options import option

AllowExternal = Annotated[
    bool,
    option(
        "Follow an HDF5 file into other files: external storage and links, virtual datasets.",
        name="--allow-external",
    ),
]


def external_data(allowed: bool) -> AbstractContextManager[None]:
    """Allow it while inside, if the user said so."""
    if not allowed:
        return nullcontext()
    from vibench.sim.hdf5_files.door import external_data_allowed

    return external_data_allowed()
