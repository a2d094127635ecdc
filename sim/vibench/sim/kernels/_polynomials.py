"""Polynomials of several variables, at eight points at once: every product and sum written out for LLVM."""

from collections.abc import Callable, Sequence
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from ._arrays import Table, Vector
from ._simd import ALIGNED, CHAINS, EIGHT, PLACE, fused, load_row, numbers_of, spread_over

Polynomials = Callable[[Table, Vector, Table], None]
Monomial = tuple[int, int]
"""The place of an earlier monomial, and the variable that it is multiplied with."""


def polynomials(products: Sequence[Monomial], counts: Sequence[int]) -> Polynomials:
    """Make a kernel that evaluates polynomials of eight points at once, written out without a loop.

    Parameters
    ----------
    products
        Of each monomial but the first, which is 1: an earlier one times a variable.
    counts
        How many monomials, from the first on, each polynomial has.

    Returns
    -------
    A kernel of the variables, shape (variables, 8), the coefficients, polynomial after polynomial, shape
    (sum(counts),), and the values, shape (polynomials, 8), which it writes.

    """

    @intrinsic
    def evaluate(_context: Any, variables: Any, coefficients: Any, values: Any) -> Any:
        def code(context: Any, builder: Any, _signature: Any, given: Any) -> Any:
            at, out = (
                context.make_array(kind)(context, builder, given[place]).data
                for kind, place in ((variables, 0), (values, 2))
            )
            number = numbers_of(context, builder, coefficients, given[1])
            nothing, first = ir.Constant(EIGHT.vector, [0.0] * 8), np.cumsum([0, *counts])
            found = [ir.Constant(EIGHT.vector, [1.0] * 8)]
            sums = [[nothing] * CHAINS for _ in counts]
            for k in range(max(counts)):
                if k > 0:
                    before, variable = products[k - 1]
                    factor = load_row(builder, at, variable, EIGHT.vector)
                    found.append(factor if before == 0 else builder.fmul(found[before], factor))
                for begins, count, chains in zip(first, counts, sums, strict=False):
                    if k < count:
                        weight = spread_over(builder, number(int(begins) + k), EIGHT.vector)
                        chains[k % CHAINS] = fused(builder, weight, found[k], chains[k % CHAINS])
            for place, chains in enumerate(sums):
                one, two = (builder.fadd(chains[i], chains[i + 1]) for i in (0, 2))
                row = builder.bitcast(builder.gep(out, [PLACE(place * 8)]), EIGHT.vector.as_pointer())
                builder.store(builder.fadd(one, two), row, align=ALIGNED)
            return context.get_dummy_value()

        return types.none(variables, coefficients, values), code

    return cast("Polynomials", evaluate)
