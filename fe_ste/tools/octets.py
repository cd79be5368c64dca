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

from fe_ste.tools.arrays import Floats, Integers

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


def eight_at(array: Floats, places: Integers, start: int) -> Floats:
    """Return eight entries of a contiguous array (n,) at eight indices, which are read from an array at a start index.

    Examples
    --------
    >>> eight_at(10.0 * np.arange(9.0), np.arange(8, -1, -1), 1).tolist()
    [70.0, 60.0, 50.0, 40.0, 30.0, 20.0, 10.0, 0.0]
    """
    return array[places[start : start + SIZE]]


def put(array: Floats, start: int, values: Floats) -> None:
    """Set eight entries of a contiguous array (n,) from a place on."""
    array[start : start + SIZE] = values


def all_eight(number: float) -> Floats:
    """Eight times the same number."""
    return np.full(SIZE, number)


def sum_of(values: Floats) -> float:
    """Sum of the eight."""
    return float(np.sum(values))


def sums_of(a: Floats, b: Floats, c: Floats, d: Floats, e: Floats, f: Floats, g: Floats, h: Floats) -> Floats:
    """Take the sums of eight octets, as one octet: half the instructions of one sum after the other.

    Examples
    --------
    >>> sums_of(*(all_eight(float(n)) for n in range(8))).tolist()
    [0.0, 8.0, 16.0, 24.0, 32.0, 40.0, 48.0, 56.0]
    """
    return np.array([np.sum(values) for values in (a, b, c, d, e, f, g, h)])


def aligned_zeros(size: int) -> Floats:
    """Zeros (size,) that begin where a line of the processor's memory does: octets of it are read at once."""
    room = np.zeros(size + SIZE)
    begin = -(room.ctypes.data // room.itemsize) % SIZE
    return room[begin : begin + size]


def _type_eight(context: Any) -> Any:
    return lambda array, start: octet if _is_flat(array) else None


def _type_eight_at(context: Any) -> Any:
    return lambda array, places, start: octet if _is_flat(array) and _is_flat(places, types.int64) else None


def _type_put(context: Any) -> Any:
    return lambda array, start, values: types.none if _is_flat(array) and values == octet else None


def _type_all(context: Any) -> Any:
    return lambda number: octet


def _type_sum(context: Any) -> Any:
    return lambda values: types.float64 if values == octet else None


def _type_sums(context: Any) -> Any:
    return lambda a, b, c, d, e, f, g, h: octet if {a, b, c, d, e, f, g, h} == {octet} else None


def _is_flat(array: Any, kind: Any = types.float64) -> bool:
    return isinstance(array, types.Array) and array.ndim == 1 and array.layout == "C" and array.dtype == kind


def _data(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    """Address of an array's entries."""
    proxy: Any = cgutils.create_struct_proxy
    return proxy(kind)(context, builder, array).data


def _place(context: Any, builder: Any, kind: Any, array: Any, start: Any) -> Any:
    """Address of eight entries."""
    return builder.bitcast(builder.gep(_data(context, builder, kind, array), [start]), _VECTOR.as_pointer())


def _lower_eight(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    loaded = builder.load(_place(context, builder, sig.args[0], *args))
    loaded.align = SIZE  # bytes of one number: rows may begin anywhere
    return loaded


def _lower_eight_at(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    indices = ir.VectorType(ir.IntType(64), SIZE)
    first = builder.gep(_data(context, builder, sig.args[1], args[1]), [args[2]])
    places = builder.load(builder.bitcast(first, indices.as_pointer()))
    places.align = SIZE
    begin = builder.ptrtoint(_data(context, builder, sig.args[0], args[0]), ir.IntType(64))
    bytes_of_one = ir.Constant(indices, [SIZE] * SIZE)
    addresses = builder.add(_spread(builder, begin), builder.mul(places, bytes_of_one))
    pointers = ir.VectorType(ir.DoubleType().as_pointer(), SIZE)
    arguments = (
        builder.inttoptr(addresses, pointers),
        ir.Constant(ir.IntType(32), SIZE),
        ir.Constant(ir.VectorType(ir.IntType(1), SIZE), [1] * SIZE),
        ir.Constant(_VECTOR, ir.Undefined),
    )
    kinds = ir.FunctionType(_VECTOR, [argument.type for argument in arguments])
    declared: Any = cgutils.get_or_insert_function
    gather = declared(builder.module, kinds, "llvm.masked.gather.v8f64.v8p0")
    return builder.call(gather, arguments)


def _lower_put(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    builder.store(args[2], _place(context, builder, sig.args[0], *args[:2]), align=SIZE)
    return context.get_dummy_value()


def _lower_all(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return _spread(builder, args[0])


def _spread(builder: Any, number: Any) -> Any:
    vector = ir.VectorType(number.type, SIZE)
    element = builder.insert_element(ir.Constant(vector, ir.Undefined), number, ir.Constant(ir.IntType(32), 0))
    return builder.shuffle_vector(element, element, ir.Constant(ir.VectorType(ir.IntType(32), SIZE), [0] * SIZE))


def _lower_sum(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    values = args[0]
    size = SIZE
    while size > 1:  # halves onto each other
        size //= 2
        index = ir.VectorType(ir.IntType(32), size)
        low, high = (
            builder.shuffle_vector(values, values, ir.Constant(index, list(range(begin, begin + size))))
            for begin in (0, size)
        )
        values = builder.fadd(low, high, flags=_FLAGS)
    return builder.extract_element(values, ir.Constant(ir.IntType(32), 0))


def _lower_sums(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    # Neighbouring numbers of two octets first, then halves of what stands in groups of two.
    rows = list(args)
    pairs = [0, 8, 2, 10, 4, 12, 6, 14]
    halves = [0, 1, 4, 5, 8, 9, 12, 13]
    rows = [_fold(builder, rows[n], rows[n + 1], pairs, 1) for n in range(0, SIZE, 2)]
    while len(rows) > 1:
        rows = [_fold(builder, rows[n], rows[n + 1], halves, 2) for n in range(0, len(rows), 2)]
    return rows[0]


def _fold(builder: Any, first: Any, second: Any, places: list[int], step: int) -> Any:
    """Sum of the numbers of two octets at some places and of those a step behind."""
    index = ir.VectorType(ir.IntType(32), SIZE)
    low, high = (
        builder.shuffle_vector(first, second, ir.Constant(index, [place + ahead for place in places]))
        for ahead in (0, step)
    )
    return builder.fadd(low, high, flags=_FLAGS)


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
_type(eight_at)(_type_eight_at)
_type(put)(_type_put)
_type(all_eight)(_type_all)
_type(sum_of)(_type_sum)
_type(sums_of)(_type_sums)
_lower(eight, types.Array, types.Integer)(_lower_eight)
_lower(eight_at, types.Array, types.Array, types.Integer)(_lower_eight_at)
_lower(put, types.Array, types.Integer, _OctetType)(_lower_put)
_lower(all_eight, types.Float)(_lower_all)
_lower(sum_of, _OctetType)(_lower_sum)
_lower(sums_of, *SIZE * [_OctetType])(_lower_sums)
_define(operator.add, "fadd")
_define(operator.sub, "fsub")
_define(operator.mul, "fmul")
