"""Eight numbers at once in kernels: one register of a processor, or two.

numba makes vectors of loops by itself only where it can see that it is worth it, which short loops over rows of eight
seldom show. Here a kernel says so: an octet is eight neighbouring entries of an array, taken by `eight`, that can be
added, subtracted and multiplied, by numbers as well. Products and sums are fused where the processor can. Without
compiling octets are arrays. Kernels use this through `fe_ste.tools.compilation`.

Examples
--------
>>> values = np.arange(8.0)
>>> float(sum_of(eight(values, 0) * 2.0))
56.0
"""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import lower_builtin, models, register_model, type_callable

from fe_ste.tools.arrays import Floats

SIZE = 8
#: numba's ways to be extended, which have no types.
_type: Any = type_callable
_lower: Any = lower_builtin
_register: Any = register_model
_infer: Any = infer_global
_signature: Any = signature
_VECTOR = ir.VectorType(ir.DoubleType(), SIZE)
_FLAGS = ("contract", "nsz")


class _OctetType(types.Type):
    def __init__(self) -> None:
        super().__init__(name="Octet")


octet = _OctetType()


class _OctetModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)  # type: ignore[no-untyped-call]


_register(_OctetType)(_OctetModel)


def eight(array: Floats, start: int) -> Floats:
    """Eight entries of a contiguous array (n,) from a place on."""
    return array[start : start + SIZE].copy()


def put(array: Floats, start: int, values: Floats) -> None:
    """Set eight entries of a contiguous array (n,) from a place on."""
    array[start : start + SIZE] = values


def all_eight(number: float) -> Floats:
    """Eight times the same number."""
    return np.full(SIZE, number)


def sum_of(values: Floats) -> float:
    """Sum of the eight."""
    return float(np.sum(values))


def aligned_zeros(size: int) -> Floats:
    """Zeros (size,) that begin where a line of the processor's memory does: octets of it are read at once."""
    room = np.zeros(size + SIZE)
    begin = -(room.ctypes.data // room.itemsize) % SIZE
    return room[begin : begin + size]


def _type_eight(context: Any) -> Any:
    return lambda array, start: octet if _is_flat(array) else None


def _type_put(context: Any) -> Any:
    return lambda array, start, values: types.none if _is_flat(array) and values == octet else None


def _type_all(context: Any) -> Any:
    return lambda number: octet


def _type_sum(context: Any) -> Any:
    return lambda values: types.float64 if values == octet else None


def _is_flat(array: Any) -> bool:
    return isinstance(array, types.Array) and array.ndim == 1 and array.layout == "C" and array.dtype == types.float64


def _place(context: Any, builder: Any, kind: Any, array: Any, start: Any) -> Any:
    """Address of eight entries."""
    proxy: Any = cgutils.create_struct_proxy
    data = proxy(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [start]), _VECTOR.as_pointer())


def _lower_eight(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    loaded = builder.load(_place(context, builder, sig.args[0], *args))
    loaded.align = SIZE  # bytes of one number: rows may begin anywhere
    return loaded


def _lower_put(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    builder.store(args[2], _place(context, builder, sig.args[0], *args[:2]), align=SIZE)
    return context.get_dummy_value()


def _lower_all(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return _spread(builder, args[0])


def _spread(builder: Any, number: Any) -> Any:
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(ir.IntType(32), SIZE), [0] * SIZE))


def _lower_sum(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    values, size = args[0], SIZE
    while size > 1:  # halves onto each other
        size //= 2
        index = ir.VectorType(ir.IntType(32), size)
        low, high = (
            builder.shuffle_vector(values, values, ir.Constant(index, list(range(begin, begin + size))))
            for begin in (0, size)
        )
        values = builder.fadd(low, high, flags=_FLAGS)
    return builder.extract_element(values, ir.Constant(ir.IntType(32), 0))


def _define(operation: Any, build: str) -> None:
    """Make an operator work on two octets, and on an octet and a number."""
    pairs = [(octet, octet), (octet, types.float64), (types.float64, octet)]

    class Template(ConcreteTemplate):
        cases = [_signature(octet, *pair) for pair in pairs]

    _infer(operation)(Template)

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        both = [value if kind == octet else _spread(builder, value) for kind, value in zip(sig.args, args, strict=True)]
        return getattr(builder, build)(*both, flags=_FLAGS)

    for pair in ((_OctetType, _OctetType), (_OctetType, types.Float), (types.Float, _OctetType)):
        _lower(operation, *pair)(lower)


_type(eight)(_type_eight)
_type(put)(_type_put)
_type(all_eight)(_type_all)
_type(sum_of)(_type_sum)
_lower(eight, types.Array, types.Integer)(_lower_eight)
_lower(put, types.Array, types.Integer, _OctetType)(_lower_put)
_lower(all_eight, types.Float)(_lower_all)
_lower(sum_of, _OctetType)(_lower_sum)
_define(operator.add, "fadd")
_define(operator.sub, "fsub")
_define(operator.mul, "fmul")
