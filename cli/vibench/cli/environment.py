"""Limit the threads of linear algebra and the memory that processes keep, unless the user has set limits.

Imported before numpy. The matrices are small, and OpenBLAS threads wait for each other in busy loops. The
tests of the bench check take 8.8 to 9.7 s of processor time with one thread and 10.5 to 11.6 s with two.

Arrays of a recording take tens of megabytes. The C library of Linux keeps such memory after it is freed.
With this threshold [bytes], background processes return larger blocks to the system at once.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MALLOC_MMAP_THRESHOLD_", str(4 << 20))
