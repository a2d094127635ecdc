"""numba's inlining of a kernel into its callers, without copying what nobody else holds."""

from types import FunctionType
from typing import Any

from numba.core import ir
from numba.core.compiler import Compiler, DefaultPassBuilder
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.inline_closurecall import InlineWorker, callee_ir_validator
from numba.core.untyped_passes import InlineInlinables


class _Fresh(ir.Block):
    """A block of a callee that was translated for one call: its copy is the block itself.

    numba copies every block of a callee twice, and with each all variables of the function: that grows with
    the square of its length.
    """

    def __deepcopy__(self, memo: dict[int, Any]) -> "_Fresh":
        return self


class _FreshWorker(InlineWorker):
    """Puts a callee in place of its call."""

    def run_untyped_passes(self, func: FunctionType, enable_ssa: bool = False) -> Any:  # noqa: FBT001, FBT002 - numba's
        """Translate a callee; calls inside of it are inlined the same way."""
        self._compiler_pipeline = _untyped_pipeline  # type: ignore[assignment] # it is kept, not bound
        translated = super().run_untyped_passes(func, enable_ssa)
        for block in translated.blocks.values():
            block.__class__ = _Fresh
        return translated

    def inline_function(self, *arguments: Any, **named: Any) -> Any:
        """Put the callee in; its blocks are the caller's from then on, and are copied like any other."""
        inlined = super().inline_function(*arguments, **named)
        for block in inlined[1].values():
            block.__class__ = ir.Block
        return inlined


@register_pass(mutates_CFG=True, analysis_only=False)
class _InlineKernels(InlineInlinables):
    _name = "inline_kernels"

    def _do_work(self, state: Any, work_list: Any, block: Any, i: int, expr: Any, _worker: Any) -> bool:
        ours = _FreshWorker(
            state.typingctx, state.targetctx, state.locals, state.pipeline, state.flags, callee_ir_validator
        )
        return bool(super()._do_work(state, work_list, block, i, expr, ours))


def _with_own_inlining(passes: PassManager) -> PassManager:
    passes.passes = [
        (_InlineKernels if each is InlineInlinables else each, what) for each, what in passes.passes
    ]
    return passes


def _untyped_pipeline(state: Any) -> PassManager:
    return _with_own_inlining(DefaultPassBuilder.define_untyped_pipeline(state))


class KernelCompiler(Compiler):
    """numba's compiler, but for how calls are inlined: the same code in less time."""

    def define_pipelines(self) -> list[PassManager]:
        """Give numba's passes, one of them exchanged."""
        return [_with_own_inlining(each) for each in super().define_pipelines()]
