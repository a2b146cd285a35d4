"""Eight complex numbers that Numba adds and multiplies as one, in vector instructions.

Inside compiled functions `get(z, slot)` reads the eight complex numbers of a slot of a flat
float64 array, real parts before imaginary ones, and `put` writes them; between the two they
are values with +, - and * (by lanes, or by a number that all lanes share). LLVM cannot be
talked into this by loops over arrays, since it must assume that slots overlap: for the 6x6
factorisation, loops took 79 ns a lane and these values take 22.

LLVM splits the vectors of eight into what the processor has (AVX-512, AVX2, NEON).
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any, cast

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

LANES = 8
SLOT = 2 * LANES  # doubles per slot
_VECTOR = ir.VectorType(ir.DoubleType(), LANES)
_FLAGS = ("contract", "nsz")


def _builtin(function: Callable) -> Callable[..., Any]:
    """A function of compiled code; its first parameter and its types are Numba's affair."""
    return intrinsic(function)


class LanesType(types.Type):
    """Numba's type of eight complex numbers."""

    def __init__(self) -> None:
        super().__init__(name="ComplexLanes8")


class _VectorType(types.Type):
    def __init__(self) -> None:
        super().__init__(name="RealLanes8")


lanes = LanesType()
_vector = _VectorType()


@register_model(_VectorType)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, dmm, fe_type) -> None:
        super().__init__(dmm, fe_type, _VECTOR)


@register_model(LanesType)
class _LanesModel(models.StructModel):
    def __init__(self, dmm, fe_type) -> None:
        super().__init__(dmm, fe_type, [("re", _vector), ("im", _vector)])


def _make(context, builder, re, im):
    value = cgutils.create_struct_proxy(lanes)(context, builder)
    value.re, value.im = re, im
    return value._getvalue()


def _parts(context, builder, value):
    proxy = cgutils.create_struct_proxy(lanes)(context, builder, value=value)
    return proxy.re, proxy.im


def _splat(builder, scalar):
    """A vector of eight times the same double."""
    zero = ir.Constant(ir.IntType(32), 0)
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), scalar, zero)
    mask = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(one, ir.Constant(_VECTOR, ir.Undefined), mask)


class _Arithmetic(AbstractTemplate):
    def generic(self, args, kws):
        for kind, scalars in (
            (lanes, (types.float64, types.complex128)),
            (_vector, (types.float64,)),
        ):
            if len(args) == 2 and kind in args and all(a == kind or a in scalars for a in args):
                return signature(kind, *args)
        return None


for _op in (operator.add, operator.sub, operator.mul, operator.truediv):
    cast(Any, infer_global)(_op)(type(f"_{_op.__name__}", (_Arithmetic,), {}))


def _real(instruction: str):
    """Lower an instruction for vectors of eight reals, either of which may be one double."""

    def lower(context, builder, sig, args):
        pairs = zip(sig.args, args, strict=True)
        a, b = (v if kind == _vector else _splat(builder, v) for kind, v in pairs)
        return getattr(builder, instruction)(a, b, flags=_FLAGS)

    return lower


for _op, _name in (("add", "fadd"), ("sub", "fsub"), ("mul", "fmul"), ("truediv", "fdiv")):
    for _kinds in ((_VectorType,) * 2, (_VectorType, types.Float), (types.Float, _VectorType)):
        lower_builtin(getattr(operator, _op), *_kinds)(_real(_name))


def _add(context, builder, sig, args):
    (ar, ai), (br, bi) = (_parts(context, builder, v) for v in args)
    return _make(context, builder, builder.fadd(ar, br, _FLAGS), builder.fadd(ai, bi, _FLAGS))


def _sub(context, builder, sig, args):
    (ar, ai), (br, bi) = (_parts(context, builder, v) for v in args)
    return _make(context, builder, builder.fsub(ar, br, _FLAGS), builder.fsub(ai, bi, _FLAGS))


def _mul(context, builder, sig, args):
    (ar, ai), (br, bi) = (_parts(context, builder, v) for v in args)

    def mul(a, b):
        return builder.fmul(a, b, _FLAGS)

    re = builder.fsub(mul(ar, br), mul(ai, bi), _FLAGS)
    im = builder.fadd(mul(ar, bi), mul(ai, br), _FLAGS)
    return _make(context, builder, re, im)


def _scale(context, builder, sig, args):
    value, scalar = args if sig.args[0] == lanes else args[::-1]
    re, im = _parts(context, builder, value)
    factor = _splat(builder, scalar)
    re, im = builder.fmul(re, factor, _FLAGS), builder.fmul(im, factor, _FLAGS)
    return _make(context, builder, re, im)


def _scale_complex(context, builder, sig, args):
    scalar, value = args if sig.args[1] == lanes else args[::-1]
    number = context.make_complex(builder, types.complex128, value=scalar)
    shared = _make(context, builder, _splat(builder, number.real), _splat(builder, number.imag))
    return _mul(context, builder, sig, (shared, value))


lower_builtin(operator.add, LanesType, LanesType)(_add)
lower_builtin(operator.sub, LanesType, LanesType)(_sub)
lower_builtin(operator.mul, LanesType, LanesType)(_mul)
lower_builtin(operator.mul, LanesType, types.Float)(_scale)
lower_builtin(operator.mul, types.Float, LanesType)(_scale)
lower_builtin(operator.mul, LanesType, types.Complex)(_scale_complex)
lower_builtin(operator.mul, types.Complex, LanesType)(_scale_complex)


def _pointers(context, builder, array_type, array, slot):
    """Addresses of the real and the imaginary parts of a slot."""
    data = context.make_array(array_type)(context, builder, array).data
    out = []
    for part in range(2):
        first = builder.add(builder.mul(slot, slot.type(SLOT)), slot.type(part * LANES))
        address = builder.gep(data, [first])
        out.append(builder.bitcast(address, _VECTOR.as_pointer()))
    return out


@_builtin
def get(typingctx, z, slot):
    """The eight complex numbers in a slot of the flat float64 array z."""

    def codegen(context, builder, sig, args):
        pointers = _pointers(context, builder, sig.args[0], *args)
        re, im = (builder.load(p, align=8) for p in pointers)
        return _make(context, builder, re, im)

    return lanes(z, types.int64), codegen


@_builtin
def put(typingctx, z, slot, value):
    """Write eight complex numbers to a slot of the flat float64 array z."""

    def codegen(context, builder, sig, args):
        pointers = _pointers(context, builder, sig.args[0], args[0], args[1])
        for part, pointer in zip(_parts(context, builder, args[2]), pointers, strict=True):
            builder.store(part, pointer, align=8)
        return context.get_dummy_value()

    return types.void(z, types.int64, lanes), codegen


@_builtin
def reciprocal(typingctx, value):
    """1 / value in every lane."""

    def codegen(context, builder, sig, args):
        re, im = _parts(context, builder, args[0])
        square = builder.fadd(builder.fmul(re, re, _FLAGS), builder.fmul(im, im, _FLAGS), _FLAGS)
        over = builder.fdiv(_splat(builder, ir.Constant(ir.DoubleType(), 1.0)), square)
        minus = builder.fneg(over)
        return _make(context, builder, builder.fmul(re, over), builder.fmul(im, minus))

    return lanes(lanes), codegen


@_builtin
def zero(typingctx):
    """Eight zeros."""

    def codegen(context, builder, sig, args):
        nought = ir.Constant(_VECTOR, [0.0] * LANES)
        return _make(context, builder, nought, nought)

    return lanes(), codegen


@_builtin
def ones(typingctx):
    """Eight ones."""

    def codegen(context, builder, sig, args):
        re, im = (ir.Constant(_VECTOR, [value] * LANES) for value in (1.0, 0.0))
        return _make(context, builder, re, im)

    return lanes(), codegen


@_builtin
def get_real(typingctx, z, slot):
    """Eight real numbers: entries 8 slot to 8 slot + 7 of the flat float64 array z."""

    def codegen(context, builder, sig, args):
        return builder.load(_real_pointer(context, builder, sig.args[0], *args), align=8)

    return _vector(z, types.int64), codegen


@_builtin
def put_real(typingctx, z, slot, value):
    """Write eight real numbers to entries 8 slot to 8 slot + 7 of the flat float64 array z."""

    def codegen(context, builder, sig, args):
        pointer = _real_pointer(context, builder, sig.args[0], args[0], args[1])
        builder.store(args[2], pointer, align=8)
        return context.get_dummy_value()

    return types.void(z, types.int64, _vector), codegen


def _real_pointer(context, builder, array_type, array, slot):
    data = context.make_array(array_type)(context, builder, array).data
    first = builder.mul(slot, slot.type(LANES))
    return builder.bitcast(builder.gep(data, [first]), _VECTOR.as_pointer())


@_builtin
def root(typingctx, value):
    """Square roots of eight reals."""
    return _vector(_vector), _llvm("sqrt")


@_builtin
def magnitude(typingctx, value):
    """Absolute values of eight reals."""
    return _vector(_vector), _llvm("fabs")


def _llvm(name: str):
    """Code that calls one of LLVM's functions of eight reals."""

    def codegen(context, builder, sig, args):
        kind = ir.FunctionType(_VECTOR, [_VECTOR])
        full = f"llvm.{name}.v{LANES}f64"
        function = cgutils.get_or_insert_function(builder.module, kind, full)
        return builder.call(function, args)

    return codegen


@_builtin
def larger(typingctx, a, b):
    """The larger of each two of eight reals; b where they do not compare."""

    def codegen(context, builder, sig, args):
        return builder.select(builder.fcmp_ordered(">", *args), *args)

    return _vector(_vector, _vector), codegen
