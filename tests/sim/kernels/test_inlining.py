"""Kernels that are copied into their callers: code as numba's own inlining makes it, in less time."""

import re
from itertools import count

import numpy as np
import pytest
from numba import njit
from numba.core import ir
from numba.core.compiler import Compiler

from vibench.sim.kernels.inlining import KernelCompiler

NAME = re.compile(r'[%@!#$]"[^"]*"|[%@!#$][\w.$-]+')
BLOCK = re.compile(r"\bB\d+")


@njit(inline="always")
def clipped(value, limit):
    if value > limit:
        return limit
    return -limit if value < -limit else value


@njit(inline="always")
def summed(values, limit):
    total = 0.0
    for value in values:
        total += clipped(value, limit) * clipped(2.0 * value, limit)
    return total


def outer(values):
    total = summed(values, 1.0)
    for limit in range(3):
        total -= summed(values, 0.5 * limit) + clipped(values[0], 0.1)
    return total


def compiled(compiler):
    made = njit(nogil=True, error_model="numpy", _nrt=False, pipeline_class=compiler)(outer)
    return made, made(np.linspace(-2.0, 2.0, 33))


def code_of(made):
    """Give the code of a function, its names by the order in which they come."""
    numbers, known = count(), {}
    (text,) = made.inspect_llvm().values()
    for kind in (BLOCK, NAME):
        text = kind.sub(lambda found: f"%{known.setdefault(found.group(), next(numbers))}", text)
    return re.sub(r" +", " ", text[text.index("define ") :])


def test_the_code_is_that_of_numbas_own_inlining():
    (ours, found), (numbas, wanted) = compiled(KernelCompiler), compiled(Compiler)
    assert found == wanted == outer(np.linspace(-2.0, 2.0, 33))
    assert "clipped" not in "".join(re.findall(r"call [^\n]*", code_of(ours)))
    assert code_of(ours) == code_of(numbas)


@pytest.mark.parametrize(("compiler", "is_copied"), [(KernelCompiler, False), (Compiler, True)])
def test_the_variables_of_a_function_are_not_copied_with_each_of_its_blocks(compiler, is_copied, monkeypatch):
    copies = []

    def noted(scope, memo):
        copies.append(scope)
        memo[id(scope)] = scope
        return scope

    monkeypatch.setattr(ir.Scope, "__deepcopy__", noted, raising=False)
    compiled(compiler)
    assert bool(copies) is is_copied
