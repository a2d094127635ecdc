"""`--allow-external`: files whose data lie in other files are read only when the user says so."""

from contextlib import AbstractContextManager, nullcontext
from typing import Annotated

import typer

AllowExternal = Annotated[
    bool,
    typer.Option(
        "--allow-external",
        help="Follow an HDF5 file into other files: external storage and links, virtual datasets.",
    ),
]


def external_data(allowed: bool) -> AbstractContextManager[None]:
    """Allow it while inside, if the user said so."""
    if not allowed:
        return nullcontext()
    from vibench.sim.hdf5_files.door import external_data_allowed

    return external_data_allowed()
