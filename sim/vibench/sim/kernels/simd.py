"""Eight or sixteen numbers that a kernel computes with as with one: a processor keeps them in its registers.

numba compiles loops over arrays, and LLVM finds the registers in them only where it can prove that what is
written is not what is read; for so few numbers the proof costs more than the sum. So these numbers are a type
of their own. Every operation is IEEE's, place by place and uncontracted: the same on every processor.
"""

import operator
from collections.abc import Callable
from typing import Any, Self, cast

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic, lower_builtin, models, register_model, type_callable

from .arrays import Table, Vector

_DOUBLE, PLACE = ir.DoubleType(), ir.IntType(32)
ALIGNED = 8
"""Bytes: what numpy promises."""
CHAINS = 4
"""Sums of rows that run beside each other, so that no addition waits for the one before."""


class SimdVector:
    """Eight or sixteen numbers, in a kernel only; a number beside them counts as often."""

    def __add__(self, _other: Self | float) -> Self:
        raise NotImplementedError

    def __radd__(self, _other: float) -> Self:
        raise NotImplementedError

    def __sub__(self, _other: Self | float) -> Self:
        raise NotImplementedError

    def __rsub__(self, _other: float) -> Self:
        raise NotImplementedError

    def __mul__(self, _other: Self | float) -> Self:
        raise NotImplementedError

    def __rmul__(self, _other: float) -> Self:
        raise NotImplementedError

    def __neg__(self) -> Self:
        raise NotImplementedError

    def __truediv__(self, _other: Self | float) -> Self:
        raise NotImplementedError


class _SimdVectorType(types.Type):
    def __init__(self, count: int) -> None:
        self.vector = ir.VectorType(_DOUBLE, count)
        super().__init__(name=f"Lanes({count})")


@register_model(_SimdVectorType)
class _SimdVectorModel(models.PrimitiveModel):
    def __init__(self, manager: Any, simd: _SimdVectorType) -> None:
        super().__init__(manager, simd, simd.vector)


EIGHT, _SIXTEEN = _SimdVectorType(8), _SimdVectorType(16)


def spread_over(builder: Any, value: Any, vector: Any) -> Any:
    """Put a number in every lane."""
    if value.type == vector:
        return value
    nothing = ir.Constant(vector, ir.Undefined)
    everywhere = ir.Constant(ir.VectorType(PLACE, vector.count), [0] * vector.count)
    return builder.shuffle_vector(builder.insert_element(nothing, value, PLACE(0)), nothing, everywhere)


def _begins(context: Any, builder: Any, kind: Any, array: Any, row: Any, vector: Any) -> Any:
    """Give the address of a row's first number; an array has as many columns as there are lanes."""
    data = context.make_array(kind)(context, builder, array).data
    return builder.gep(data, [builder.mul(row, ir.Constant(row.type, vector.count))])


def load_row(builder: Any, begins: Any, row: int, vector: Any) -> Any:
    """Load a row from the address of the first one."""
    begins = builder.gep(begins, [PLACE(row * vector.count)])
    return builder.load(builder.bitcast(begins, vector.as_pointer()), align=ALIGNED)


def _is_array(kind: Any) -> bool:
    return isinstance(kind, types.Array) and kind.dtype == types.float64 and kind.layout == "C"


def _loading(simd: _SimdVectorType) -> Any:
    @intrinsic
    def load(_context: Any, array: Any, row: Any) -> Any:
        def code(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            first = _begins(context, builder, signature.args[0], given[0], given[1], simd.vector)
            return load_row(builder, first, 0, simd.vector)

        fits = _is_array(array) and isinstance(row, types.Integer)
        return (simd(array, types.intp), code) if fits else None

    return load


def _spreading(simd: _SimdVectorType) -> Any:
    @intrinsic
    def spread(_context: Any, value: Any) -> Any:
        def code(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
            return spread_over(builder, given[0], simd.vector)

        return (simd(types.float64), code) if isinstance(value, types.Float) else None

    return spread


def _weighing(simd: _SimdVectorType, rows: int) -> Any:
    @intrinsic
    def weigh(_context: Any, table: Any, first: Any, weights: Any) -> Any:  # noqa: ARG001 - numba's names
        def code(context: Any, builder: Any, signature: Any, given: Any) -> Any:
            vector = simd.vector
            top = _begins(context, builder, signature.args[0], given[0], given[1], vector)
            weight = numbers_of(context, builder, weights, given[2])
            parts = (
                builder.fmul(spread_over(builder, weight(row), vector), load_row(builder, top, row, vector))
                for row in range(rows)
            )
            chains = [next(parts) for _ in range(CHAINS)]
            for row, part in enumerate(parts):
                chains[row % CHAINS] = builder.fadd(chains[row % CHAINS], part)
            one, two = (builder.fadd(chains[i], chains[i + 1]) for i in (0, 2))
            return builder.fadd(one, two)

        fits = _is_array(table) and (_is_array(weights) or isinstance(weights, _SimdVectorType))
        return (simd(table, types.intp, weights), code) if fits else None

    return weigh


def numbers_of(context: Any, builder: Any, kind: Any, given: Any) -> Callable[[int], Any]:
    """Give what draws single numbers from lanes, or from an array."""
    if isinstance(kind, _SimdVectorType):
        return lambda place: builder.extract_element(given, PLACE(place))
    data = context.make_array(kind)(context, builder, given).data
    return lambda place: builder.load(builder.gep(data, [PLACE(place)]))


eight = cast("Callable[[Table | Vector, int], SimdVector]", _loading(EIGHT))
"""A row of an array with eight columns."""
sixteen = cast("Callable[[Table | Vector, int], SimdVector]", _loading(_SIXTEEN))
"""A row of an array with sixteen columns."""
eights = cast("Callable[[float], SimdVector]", _spreading(EIGHT))
"""Eight times the same number."""
Weigh = Callable[[Table, int, Vector | SimdVector], SimdVector]
eight_of_eight = cast("Weigh", _weighing(EIGHT, 8))
"""The sum of eight rows of eight numbers from one on, each times its weight."""
eight_of_sixteen = cast("Weigh", _weighing(EIGHT, 16))
"""The sum of sixteen rows of eight numbers."""
sixteen_of_sixteen = cast("Weigh", _weighing(_SIXTEEN, 16))
"""The sum of sixteen rows of sixteen numbers."""


@intrinsic
def _store(_context: Any, array: Any, row: Any, simd: Any) -> Any:  # noqa: ARG001 - numba's names
    def code(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        begins = _begins(context, builder, signature.args[0], given[0], given[1], simd.vector)
        builder.store(given[2], builder.bitcast(begins, simd.vector.as_pointer()), align=ALIGNED)
        return context.get_dummy_value()

    return types.none(array, types.intp, simd), code


store = cast("Callable[[Table | Vector, int, SimdVector], None]", _store)
"""Write to a row of an array with as many columns."""


@intrinsic
def _root(_context: Any, simd: Any) -> Any:
    def code(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        nothing = ir.Constant(simd.vector, [0.0] * simd.vector.count)
        positive = builder.select(builder.fcmp_ordered(">", given[0], nothing), given[0], nothing)
        name, kind = f"llvm.sqrt.v{simd.vector.count}f64", ir.FunctionType(simd.vector, [simd.vector])
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), [positive])

    return simd(simd), code


root = cast("Callable[[SimdVector], SimdVector]", _root)
"""Square roots; zero of what is negative."""


def _by_halves(builder: Any, part: Any, join: Callable[[Any, Any], Any]) -> Any:
    """Join the upper half of all lanes with the lower one until there is one number."""
    count = part.type.count
    while count > 1:
        count //= 2
        nothing = ir.Constant(part.type, ir.Undefined)
        lower, upper = (
            builder.shuffle_vector(
                part, nothing, ir.Constant(ir.VectorType(PLACE, count), list(range(first, first + count)))
            )
            for first in (0, count)
        )
        part = join(lower, upper)
    return builder.extract_element(part, PLACE(0))


@intrinsic
def _total(_context: Any, simd: Any) -> Any:
    def code(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        return _by_halves(builder, given[0], builder.fadd)

    return types.float64(simd), code


total = cast("Callable[[SimdVector], float]", _total)
"""The sum of all, by halves."""


@intrinsic
def _largest(_context: Any, simd: Any) -> Any:
    def code(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
        size, count = ir.FunctionType(simd.vector, [simd.vector]), simd.vector.count
        positive = cgutils.get_or_insert_function(builder.module, size, f"llvm.fabs.v{count}f64")

        def larger(one: Any, other: Any) -> Any:
            # What is not a number wins, from either side.
            kept = builder.or_(builder.fcmp_ordered(">", one, other), builder.fcmp_unordered("!=", one, one))
            return builder.select(kept, one, other)

        return _by_halves(builder, builder.call(positive, [given[0]]), larger)

    return types.float64(simd), code


largest = cast("Callable[[SimdVector], float]", _largest)
"""The largest magnitude of all; NaN where one is not a number."""


def _give_operator(function: Callable[..., object], name: str) -> None:
    """Give lanes an operator of Python."""

    def typer(_context: Any) -> Callable[..., object]:
        def typed(one: object, other: object) -> object:
            found = [each for each in (one, other) if isinstance(each, _SimdVectorType)]
            fits = found and all(each in (found[0], types.float64) for each in (one, other))
            return found[0] if fits else None

        return typed

    def lowered(_context: Any, builder: Any, signature: Any, pair: Any) -> Any:
        vector = signature.return_type.vector
        return getattr(builder, name)(*(spread_over(builder, each, vector) for each in pair))

    type_callable(function)(typer)
    for one, other in (
        (_SimdVectorType, _SimdVectorType),
        (_SimdVectorType, types.Float),
        (types.Float, _SimdVectorType),
    ):
        lower_builtin(function, one, other)(lowered)


for name, functions in {
    "fadd": (operator.add, operator.iadd),
    "fsub": (operator.sub, operator.isub),
    "fmul": (operator.mul, operator.imul),
    "fdiv": (operator.truediv, operator.itruediv),
}.items():
    for function in functions:
        _give_operator(function, name)


def _negated(_context: Any) -> Callable[..., object]:
    def typed(simd: object) -> object:
        return simd if isinstance(simd, _SimdVectorType) else None

    return typed


def _negate(_context: Any, builder: Any, _signature: Any, given: Any) -> Any:
    return builder.fneg(given[0])


type_callable(operator.neg)(_negated)
lower_builtin(operator.neg, _SimdVectorType)(_negate)
