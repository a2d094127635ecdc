"""Limit the threads of linear algebra and the memory that processes keep, unless the user has set limits.

Imported before numpy. One thread is best: the matrices are small, and OpenBLAS threads wait for each other in
busy loops. The tests of the bench check take 9 s of processor time with one thread, 11 s with two.

Arrays of a recording take tens of megabytes. Linux's C library keeps such memory after it is freed. With the
threshold below [bytes], background processes return blocks above it to the operating system at once.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MALLOC_MMAP_THRESHOLD_", str(4 << 20))
