"""Bundles: named tuples of arrays that compiled functions hand on by one address.

numba takes a named tuple apart: each of its arrays becomes seven numbers of every function that it is handed to, which
are written, read and sorted out again for each call. The equations of motion hold a hundred arrays; handed on as plain
tuples, they take twice as long to compile. Of a bundle, the addresses and shapes of its arrays are stored in one row of
memory, including those of nested tuples; compiled functions name its fields as those of the tuple and read them there.
The row never changes and is declared constant to the compiler, so that it is read outside of loops.

The type is defined by numba's documented extension interface (numba.readthedocs.io, "Low-level extension API"). Kernels
of `fe_ste.tools.compilation` take bundles.

Examples
--------
>>> from typing import NamedTuple
>>> import numba
>>> class Spring(NamedTuple):
...     stiffness: float
...     stretch: np.ndarray
>>> @numba.njit
... def force(spring):
...     return spring.stiffness * spring.stretch[1]
>>> force(bundle(Spring(2.0, np.array([0.0, 3.0]))))
6.0
"""

from __future__ import annotations

import hashlib
import struct
import threading
from functools import cache
from typing import Any, TypeVar, cast

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing.templates import AttributeTemplate
from numba.extending import (
    NativeValue,
    infer_getattr,
    lower_getattr_generic,
    models,
    register_model,
    typeof_impl,
    unbox,
)

Given = TypeVar("Given", bound=tuple[Any, ...])
#: numba's extension interface, which has no types.
_typeof: Any = typeof_impl
_attributes: Any = infer_getattr
_lower_attributes: Any = lower_getattr_generic
_register: Any = register_model
_unbox: Any = unbox
_WORDS = ir.IntType(64).as_pointer()


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
    if cast(Any, numba).config.DISABLE_JIT:
        return given
    return cast(Given, _Bundle(given))


def cached_bundle(given: Given) -> Given:
    """Return the bundle of a named tuple, the same one for the same tuple while it is among the latest.

    For functions that Python calls often: to make a bundle takes longer than many of them.
    """
    if cast(Any, numba).config.DISABLE_JIT:
        return given
    kept = _latest.get(id(given))
    if kept is None or kept.given is not given:
        kept = _Bundle(given)
        with _one_thread:
            _latest.pop(id(given), None)
            _latest[id(given)] = kept
            while len(_latest) > _MOST_KEPT:
                _latest.pop(next(iter(_latest)))
    return cast(Given, kept)


class _Bundle:
    """A named tuple, the row of memory that describes it, and its numba type."""

    def __init__(self, given: tuple[Any, ...]) -> None:
        self.given = given
        self._row = np.array(_words_of(given), dtype=np.int64)
        self._address = self._row.ctypes.data
        self.kind = _type_of(given)


_latest: dict[int, _Bundle] = {}
_MOST_KEPT = 64
_one_thread = threading.Lock()


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
    if isinstance(value, tuple):
        return _bundle_type(type(value), tuple(map(_type_of, value)))
    if isinstance(value, np.ndarray) and value.flags.c_contiguous:
        return _array_type(value.dtype, value.ndim, value.flags.writeable)
    return numba.typeof(value)  # type: ignore[no-untyped-call]


# numba takes longer to find these types than many compiled functions run.


@cache
def _bundle_type(of: Any, kinds: tuple[Any, ...]) -> _BundleType:
    return _BundleType(of.__name__, dict(zip(of._fields, kinds, strict=True)))


@cache
def _array_type(dtype: np.dtype[Any], ndim: int, writeable: bool) -> Any:
    example = np.empty((1,) * ndim, dtype)
    example.flags.writeable = writeable
    return numba.typeof(example)  # type: ignore[no-untyped-call]


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


# What numba is told of bundles: their type, how a compiled function takes one from Python, and how it reads a field


def _kind_of(given: _Bundle, context: object) -> _BundleType:
    return cast(_BundleType, given.kind)


class _BundleModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _WORDS)  # type: ignore[no-untyped-call]


def _take(kind: _BundleType, given: Any, context: Any) -> Any:
    address = context.pyapi.object_getattr_string(given, "_address")
    word = context.pyapi.long_as_longlong(address)
    context.pyapi.decref(address)
    return NativeValue(context.builder.inttoptr(word, _WORDS))  # type: ignore[no-untyped-call]


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
    """Structure that numba has of an array that Python keeps alive."""
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


_typeof.register(_Bundle)(_kind_of)
_register(_BundleType)(_BundleModel)
_unbox(_BundleType)(_take)
_attributes(_Fields)
_lower_attributes(_BundleType)(_lower_field)
