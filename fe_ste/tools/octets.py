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
from numba.core.typing import signature
from numba.core.typing.templates import ConcreteTemplate, infer_global
from numba.extending import lower_builtin, models, register_model, type_callable

from fe_ste.tools.arrays import Floats

SIZE = 8
_VECTOR = ir.VectorType(ir.DoubleType(), SIZE)
_FLAGS = ("contract", "nsz")


class _OctetType(types.Type):  # type: ignore[misc]
    def __init__(self) -> None:
        super().__init__(name="Octet")


octet = _OctetType()


@register_model(_OctetType)
class _OctetModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


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


@type_callable(eight)
def _type_eight(context: Any) -> Any:
    return lambda array, start: octet if _is_flat(array) else None


@type_callable(put)
def _type_put(context: Any) -> Any:
    return lambda array, start, values: types.none if _is_flat(array) and values == octet else None


@type_callable(all_eight)
def _type_all(context: Any) -> Any:
    return lambda number: octet


@type_callable(sum_of)
def _type_sum(context: Any) -> Any:
    return lambda values: types.float64 if values == octet else None


def _is_flat(array: Any) -> bool:
    return isinstance(array, types.Array) and array.ndim == 1 and array.layout == "C" and array.dtype == types.float64


def _place(context: Any, builder: Any, kind: Any, array: Any, start: Any) -> Any:
    """Address of eight entries."""
    data = cgutils.create_struct_proxy(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [start]), _VECTOR.as_pointer())


@lower_builtin(eight, types.Array, types.Integer)
def _lower_eight(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    loaded = builder.load(_place(context, builder, sig.args[0], *args))
    loaded.align = SIZE  # bytes of one number: rows may begin anywhere
    return loaded


@lower_builtin(put, types.Array, types.Integer, _OctetType)
def _lower_put(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    builder.store(args[2], _place(context, builder, sig.args[0], *args[:2]), align=SIZE)
    return context.get_dummy_value()


@lower_builtin(all_eight, types.Float)
def _lower_all(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return _spread(builder, args[0])


def _spread(builder: Any, number: Any) -> Any:
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(one, one, ir.Constant(ir.VectorType(ir.IntType(32), SIZE), [0] * SIZE))


@lower_builtin(sum_of, _OctetType)
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

    @infer_global(operation)
    class Template(ConcreteTemplate):  # type: ignore[misc]
        cases = [signature(octet, *pair) for pair in pairs]

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        both = [value if kind == octet else _spread(builder, value) for kind, value in zip(sig.args, args, strict=True)]
        return getattr(builder, build)(*both, flags=_FLAGS)

    for pair in ((_OctetType, _OctetType), (_OctetType, types.Float), (types.Float, _OctetType)):
        lower_builtin(operation, *pair)(lower)


_define(operator.add, "fadd")
_define(operator.sub, "fsub")
_define(operator.mul, "fmul")
