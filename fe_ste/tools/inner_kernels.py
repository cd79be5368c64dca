"""Kernels as other kernels call them: parts of their caller, without machine code of their own.

numba makes every function ready for Python: it translates its arguments, whose cost grows with the square of the number
of arrays (100 of them, a second), and turns it into machine code, although a kernel that is called by kernels becomes
part of these. Here such a kernel ends as the input of its caller, which optimises all of it at once. Who calls whom
decides: `fe_ste.tools.compilation` makes both sorts of every function, each when it is first asked for.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba.core import types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.registry import CPUDispatcher

_NO_WRAPPERS = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}


class Kernel(CPUDispatcher):
    """A function that Python calls, and that stands for its inner sort where another kernel calls it.

    Parameters
    ----------
    function : callable
    options : dict
        Options of numba.
    """

    def __init__(self, function: Callable[..., object], options: dict[str, Any]) -> None:
        super().__init__(py_func=function, targetoptions=options)
        inner = {**options, **_NO_WRAPPERS}
        # numba's type holds it by a weak reference.
        self._part = CPUDispatcher(py_func=function, targetoptions=inner, pipeline_class=_PartCompiler)

    @property
    def _numba_type_(self) -> Any:
        """What numba's type inference takes this object for when a kernel names it."""
        return types.Dispatcher(self._part)


class _PartCompiler(Compiler):
    """numba's compiler, whose result is not made machine code."""

    def __init__(self, typing: Any, target: Any, library: Any, *rest: Any) -> None:
        super().__init__(typing, target, library, *rest)  # type: ignore[no-untyped-call]
        self.state.library = _Part(self.state.targetctx.codegen(), "part")  # type: ignore[no-untyped-call]


class _Part(JITCodeLibrary):
    """Code that only waits to be linked into that of its caller."""

    @property
    def codegen(self) -> Any:
        return _WithoutEnvironment(self._codegen)

    def _optimize_final_module(self) -> None:
        """Leave it to the caller, who sees all at once."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()  # type: ignore[no-untyped-call]
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        return 0  # nothing that Python could call


class _WithoutEnvironment:
    """numba's code generator for code that has no place in memory yet, where an environment could be put."""

    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing."""
