"""Limit linear algebra to one thread unless the user has set a number; imported before numpy.

The matrices are small, and OpenBLAS's threads then wait for each other in busy loops. Measured on two busy
cores: the tests of the harmonic balance take 2.6 to 3.1 s of processor time with one thread and 3.7 to 5.8 s
with two; those of the bench check take 8.8 to 9.7 s and 10.5 to 11.6 s.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
