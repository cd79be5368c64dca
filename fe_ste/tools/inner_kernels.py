"""Kernels as other kernels call them: parts of their caller, with little to hand over, quickly compiled.

numba makes every function ready for Python: it translates its arguments, whose cost grows with the square of the number
of arrays (100 of them, a second), and turns it into machine code, although a kernel that is called by kernels becomes
part of these. Here such a kernel ends as the input of its caller, which optimises all of it at once. Who calls whom
decides: `fe_ste.tools.compilation` makes both sorts of every function, each when it is first asked for.

A bundle is a named tuple that kernels hand on by one address. numba takes a named tuple apart: each of its arrays
becomes seven numbers of every function that it is handed to, written, read and sorted out again for each call. Of a
bundle, addresses and shapes of its arrays are stored in one row of memory, including those of nested tuples; kernels
name its fields as those of the tuple and read them there. The row never changes and is declared constant to the
compiler, so that it is read outside of loops.
"""

from __future__ import annotations

import gc
import hashlib
import operator
import struct
from collections.abc import Callable
from functools import cached_property
from typing import Any, TypeVar, cast

import numpy as np
from llvmlite import ir
from numba.core import cgutils, config, types
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.core.compiler_machinery import PassManager
from numba.core.datamodel import models
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import DumpParforDiagnostics, InlineOverloads, NopythonRewrites
from numba.core.typing.arraydecl import GetItemBuffer, SetItemBuffer
from numba.core.typing.builtins import BinOpAdd, BinOpMul, BinOpSub
from numba.core.typing.templates import AttributeTemplate, infer_global
from numba.core.typing.typeof import typeof
from numba.core.untyped_passes import (
    FindLiterallyCalls,
    InlineClosureLikes,
    InlineInlinables,
    LiteralUnroll,
    WithLifting,
)
from numba.extending import NativeValue, infer_getattr, lower_getattr_generic, register_model, unbox

Given = TypeVar("Given", bound=tuple[Any, ...])
#: numba's ways to be extended, which have no types.
_settings: Any = config
_infer: Any = infer_global
_attributes: Any = infer_getattr
_lower_attributes: Any = lower_getattr_generic
_register: Any = register_model
_unbox: Any = unbox
_NO_WRAPPERS = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_WORDS = ir.IntType(64).as_pointer()
#: After how many new objects Python looks for garbage while it compiles, which by default takes a tenth of the time.
_SELDOM = 100_000, 50, 100
#: Passes of numba that look for expressions of arrays, closures, literals and the like.
_FOR_ARRAYS = {
    WithLifting,
    InlineClosureLikes,
    InlineInlinables,
    FindLiterallyCalls,
    LiteralUnroll,
    InlineOverloads,
    NopythonRewrites,
    DumpParforDiagnostics,
}


# -- kernels -------------------------------------------------------------------------------------------------------


class Kernel(CPUDispatcher):
    """A function that Python calls, and that stands for its inner sort where another kernel calls it.

    Parameters
    ----------
    options : options of numba
    """

    def __init__(self, function: Callable[..., object], options: dict[str, Any]) -> None:
        super().__init__(py_func=function, targetoptions=options, pipeline_class=_WholeCompiler)
        cast(Any, self)._compiler._customize_flags = _Flags

    @cached_property
    def _part(self) -> Any:
        """What it is for another kernel; made when one asks for it, and kept, since numba's type holds it weakly."""
        options = {**self.targetoptions, **_NO_WRAPPERS}
        part: Any = CPUDispatcher(py_func=self.py_func, targetoptions=options, pipeline_class=_PartCompiler)
        part._compiler._customize_flags = _Flags
        return part

    def compile(self, signature: Any) -> Any:
        """Compile for types of arguments, as numba; Python looks for garbage less often, of which there is none."""
        often = gc.get_threshold()
        gc.set_threshold(*map(max, often, _SELDOM))
        try:
            return super().compile(signature)
        finally:
            gc.set_threshold(*often)

    @property
    def _numba_type_(self) -> Any:
        """What numba's type inference takes this object for when a kernel names it."""
        return types.Dispatcher(self._part)


class _Flags(Flags):
    """Flags that are compared by those which are set: numba does so for every call that it finds in a function."""

    __slots__ = ()

    def __hash__(self) -> int:
        return hash(_Flags)

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, Flags) and bool(self._values == other._values))


class _LeanCompiler(Compiler):
    """numba's compiler without passes that find nothing in functions that make no arrays: a tenth of the time."""

    def define_pipelines(self) -> list[Any]:
        pipelines: list[Any] = super().define_pipelines()  # type: ignore[no-untyped-call]
        if self.state.flags.nrt:
            return pipelines
        lean: Any = PassManager("lean")  # type: ignore[no-untyped-call]
        lean.passes.extend(one for one in pipelines[0].passes if one[0] not in _FOR_ARRAYS)
        lean.finalize()
        return [lean]


class _WholeCompiler(_LeanCompiler):
    """numba's compiler for what Python calls."""

    def __init__(self, typing: Any, target: Any, library: Any, *rest: Any) -> None:
        super().__init__(typing, target, library, *rest)  # type: ignore[no-untyped-call]
        self.state.library = _Whole(self.state.targetctx.codegen(), "whole")  # type: ignore[no-untyped-call]
        self.state.library.enable_object_caching()


class _Whole(JITCodeLibrary):
    """Code that is optimised once: numba's cheaper round before gathers reference counts, which kernels do not have."""

    def _optimize_final_module(self) -> None:
        passes, builder = cast(Any, self._codegen)._module_pass_manager()
        passes.run(self._final_module, builder)


class _PartCompiler(_LeanCompiler):
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


def _try_first(operation: Any, template: Any) -> None:
    """Let numba try what fits numbers and arrays before what it has for texts, sets and dates, which takes longer."""
    _infer(operation)(type(f"First{template.__name__}", (template,), {"metadata": {"target": "cpu"}}))


for _operation, _template in (
    (operator.add, BinOpAdd),
    (operator.sub, BinOpSub),
    (operator.mul, BinOpMul),
    (operator.iadd, BinOpAdd),
    (operator.isub, BinOpSub),
    (operator.imul, BinOpMul),
    (operator.getitem, GetItemBuffer),
    (operator.setitem, SetItemBuffer),
):
    _try_first(_operation, _template)


# -- bundles -------------------------------------------------------------------------------------------------------


def bundle(given: Given) -> Given:
    """Make a named tuple a bundle, for compiled functions alone; without compiling it stays as it is.

    Parameters
    ----------
    given : named tuple
        Of arrays in C order, numbers, tuples of such, and None. The bundle keeps it alive; what changes in the arrays
        shows in both.

    Raises
    ------
    ValueError
        If an array is not in C order.
    """
    if _settings.DISABLE_JIT:
        return given
    return cast(Given, _Bundle(given))


def cached_struct(given: Given) -> Given:
    """Return the bundle of a named tuple, the same one for the same tuple while it is among the latest.

    For functions that Python calls often: to make a bundle takes longer than many of them.
    """
    if _settings.DISABLE_JIT:
        return given
    kept = _latest.get(id(given))
    if kept is None or kept.given is not given:
        kept = _Bundle(given)
        _latest.pop(id(given), None)
        _latest[id(given)] = kept
        while len(_latest) > _MOST_KEPT:
            _latest.pop(next(iter(_latest)))
    return cast(Given, kept)


class _Bundle:
    """A named tuple and its row."""

    def __init__(self, given: tuple[Any, ...]) -> None:
        self.given = given
        self._row = np.array(_words_of(given), dtype=np.int64)
        self._address = self._row.ctypes.data
        self._numba_type_ = _type_of(given)


_latest: dict[int, _Bundle] = {}
_MOST_KEPT = 64


class _BundleType(types.Type):
    """Types of a bundle's fields by name, and the index in the row where each begins."""

    def __init__(self, name: str, fields: dict[str, Any]) -> None:
        self.fields = fields
        self.begin: dict[str, int] = {}
        self.size = 0
        for field, kind in fields.items():
            self.begin[field] = self.size
            self.size += _size_of(kind)
        # A short name, for it becomes part of the names of all functions that take the bundle.
        digest = hashlib.sha256(repr([(field, str(kind)) for field, kind in fields.items()]).encode()).hexdigest()
        super().__init__(name=f"{name}_{digest[:16]}")


def _type_of(value: Any) -> Any:
    if not isinstance(value, tuple):
        return typeof(value)  # type: ignore[no-untyped-call]
    named: Any = value
    return _BundleType(type(value).__name__, {f: _type_of(v) for f, v in zip(named._fields, value, strict=True)})


def _size_of(kind: Any) -> int:
    """Words that a field takes: of an array its address, and sizes and strides by axis."""
    if isinstance(kind, _BundleType):
        return kind.size
    if isinstance(kind, types.Array):
        return 1 + 2 * int(kind.ndim)
    if kind == types.none:
        return 0
    return 1


def _words_of(value: Any) -> list[int]:
    if isinstance(value, tuple):
        return [word for part in value for word in _words_of(part)]
    if isinstance(value, np.ndarray):
        if not value.flags.c_contiguous:
            raise ValueError(f"array of shape {value.shape} with strides {value.strides}: a bundle takes C order")
        return [value.ctypes.data, *value.shape, *value.strides]
    if isinstance(value, float):
        return list(struct.unpack("q", struct.pack("d", value)))
    if value is None:
        return []
    return [int(value)]


class _BundleModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _WORDS)  # type: ignore[no-untyped-call]


class _Fields(AttributeTemplate):
    key = _BundleType

    def generic_resolve(self, kind: _BundleType, name: str) -> Any:  # type: ignore[override]
        return kind.fields.get(name)


def _lower_field(context: Any, builder: Any, kind: _BundleType, row: Any, name: str) -> Any:
    field = kind.fields[name]
    begin = kind.begin[name]
    if isinstance(field, _BundleType):
        return builder.gep(row, [ir.Constant(ir.IntType(32), begin)])
    if isinstance(field, types.Array):
        return _array(context, builder, field, [_read(builder, row, begin + k) for k in range(_size_of(field))])
    if field == types.none:
        return context.get_dummy_value()
    return builder.bitcast(_read(builder, row, begin), context.get_value_type(field))


def _read(builder: Any, row: Any, place: int) -> Any:
    word = builder.load(builder.gep(row, [ir.Constant(ir.IntType(32), place)]))
    word.set_metadata("invariant.load", builder.module.add_metadata([]))
    return word


def _array(context: Any, builder: Any, kind: Any, words: list[Any]) -> Any:
    """Structure that numba has of an array that somebody else keeps alive."""
    proxy: Any = cgutils.create_struct_proxy
    array = proxy(kind)(context, builder)
    shape = words[1 : 1 + kind.ndim]
    strides = words[1 + kind.ndim :]
    item = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(kind.dtype)))
    count = shape[0]
    for size in shape[1:]:
        count = builder.mul(count, size)
    array.meminfo = ir.Constant(array.meminfo.type, None)
    array.parent = ir.Constant(array.parent.type, None)
    array.nitems, array.itemsize = count, item
    array.data = builder.inttoptr(words[0], array.data.type)
    pack: Any = cgutils.pack_array
    array.shape, array.strides = pack(builder, shape), pack(builder, [*strides[:-1], item])
    return array._getvalue()


def _take(kind: _BundleType, given: Any, context: Any) -> Any:
    """Take a bundle from Python."""
    address = context.pyapi.object_getattr_string(given, "_address")
    word = context.pyapi.long_as_longlong(address)
    context.pyapi.decref(address)
    return NativeValue(context.builder.inttoptr(word, _WORDS))  # type: ignore[no-untyped-call]


_register(_BundleType)(_BundleModel)
_attributes(_Fields)
_lower_attributes(_BundleType)(_lower_field)
_unbox(_BundleType)(_take)
