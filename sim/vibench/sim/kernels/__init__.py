"""Building blocks of compiled code: compilation, vectors in registers, a clock, polynomials.

`kernel`, `kernel_without_refcount` and `inlined` are the three ways to compile a function with numba
(docs/decisions: 0018-first-use.md, 0027-numbers-in-registers.md); the cache on disk is keyed by all sources
of the package. Also: SIMD vectors of eight or sixteen numbers, a clock of two doubles (Dekker 1971), and
names of array types. Nothing here knows what is simulated.
"""
