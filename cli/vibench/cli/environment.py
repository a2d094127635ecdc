"""Limit the threads of linear algebra and the memory that processes keep, unless the user has set numbers.

Imported before numpy. The matrices are small, and OpenBLAS's threads then wait for each other in busy loops.
Measured on two busy cores: the tests of the harmonic balance take 2.6 to 3.1 s of processor time with one
thread and 3.7 to 5.8 s with two; those of the bench check take 8.8 to 9.7 s and 10.5 to 11.6 s.

Arrays of a recording have tens of megabytes. The C library of Linux keeps such pieces after they are freed;
with this threshold [bytes] background processes give them back at once.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("MALLOC_MMAP_THRESHOLD_", str(4 << 20))
