"""One thread for linear algebra, as for the command, before any test imports numpy."""

import cli.blas_threads  # noqa: F401 - it is the import that counts
