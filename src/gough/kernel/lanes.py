"""Eight numbers at once: arithmetic written in Python, traced into vector instructions.

A function of (z, shared) that calculates with the slots of `z` becomes a function of compiled
code by `compiled`: Numba calls it once, with `z` and `shared` standing for two flat float64
arrays, and every + - * / on what it reads emits one LLVM instruction for eight numbers. Its
loops and conditions run at that time and leave no trace. So the mathematics is plain Python,
which tests run on NumPy arrays too; nothing is inferred or optimised statement by statement,
which is what Numba spends its time on; and the order of operations is the source's, but for
products and sums that become one fused instruction with one rounding in place of two.

Slot k of an array of reals is its entries 8 k to 8 k + 7. A slot of complex numbers is two of
those, real parts before imaginary ones. LLVM splits vectors of eight into what the processor has
(AVX-512, AVX2, NEON).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import intrinsic

LANES = 8
SLOT = 2 * LANES  # doubles in a slot of complex numbers
_DOUBLE = ir.DoubleType()
_VECTOR = ir.VectorType(_DOUBLE, LANES)
_FLAGS = ("contract", "nsz")


class Reals:
    """Eight real numbers: an LLVM vector, and the builder that emits what is done with it."""

    def __init__(self, builder: Any, value: Any) -> None:
        self.builder, self.value = builder, value

    def _emit(self, instruction: str, a: Any, b: Any) -> Any:
        if isinstance(a, Complexes) or isinstance(b, Complexes):
            return NotImplemented  # which knows how to
        a, b = (x.value if isinstance(x, Reals) else _constant(x) for x in (a, b))
        return Reals(self.builder, getattr(self.builder, instruction)(a, b, flags=_FLAGS))

    def __add__(self, other):
        return self._emit("fadd", self, other)

    def __sub__(self, other):
        return self._emit("fsub", self, other)

    def __mul__(self, other):
        return self._emit("fmul", self, other)

    def __truediv__(self, other):
        return self._emit("fdiv", self, other)

    def __rsub__(self, other):
        return self._emit("fsub", other, self)

    def __rtruediv__(self, other):
        return self._emit("fdiv", other, self)

    __radd__, __rmul__ = __add__, __mul__

    def __neg__(self):
        return Reals(self.builder, self.builder.fneg(self.value))

    def __abs__(self):
        return self._call("fabs")

    def sqrt(self):
        """Square roots; NumPy's `sqrt` calls this."""
        return self._call("sqrt")

    def larger(self, other):
        """The larger of each two; `other` where they do not compare."""
        other = other.value if isinstance(other, Reals) else _constant(other)
        above = self.builder.fcmp_ordered(">", self.value, other)
        return Reals(self.builder, self.builder.select(above, self.value, other))

    def _call(self, name: str) -> Reals:
        kind = ir.FunctionType(_VECTOR, [_VECTOR])
        full = f"llvm.{name}.v{LANES}f64"
        function = cgutils.get_or_insert_function(self.builder.module, kind, full)
        return Reals(self.builder, self.builder.call(function, [self.value]))


def _constant(number: float) -> Any:
    return ir.Constant(_VECTOR, [float(number)] * LANES)


class Complexes:
    """Eight complex numbers. A term that is the number 0 emits nothing."""

    def __init__(self, real: Reals, imag: Reals) -> None:
        self.real, self.imag = real, imag

    def __add__(self, other):
        if isinstance(other, Complexes):
            return Complexes(self.real + other.real, self.imag + other.imag)
        return self if other == 0 else Complexes(self.real + other, self.imag)

    def __sub__(self, other):
        if isinstance(other, Complexes):
            return Complexes(self.real - other.real, self.imag - other.imag)
        return self + -other

    def __rsub__(self, other):
        return self * -1.0 + other

    def __mul__(self, other):
        if isinstance(other, Complexes):
            real = self.real * other.real - self.imag * other.imag
            return Complexes(real, self.real * other.imag + self.imag * other.real)
        return other if other == 0 else Complexes(self.real * other, self.imag * other)

    __radd__, __rmul__ = __add__, __mul__

    def __rtruediv__(self, number):
        over = number / (self.real * self.real + self.imag * self.imag)
        return Complexes(self.real * over, self.imag * over * -1.0)


class _Slots:
    """A flat array seen as slots of eight real or complex numbers.

    Args:
        shared: each number stands alone in the array, and is read into all eight lanes.
    """

    def __init__(self, builder, data, kind: type, shared: bool) -> None:
        self.builder, self.data, self.kind, self.shared = builder, data, kind, shared

    def __getitem__(self, slot: int | _Index) -> Any:
        if self.kind is Reals:
            return self._load(slot)
        return Complexes(self._load(2 * slot), self._load(2 * slot + 1))

    def __setitem__(self, slot: int, value: Any) -> None:
        parts = [value] if self.kind is Reals else [value.real, value.imag]
        for k, part in enumerate(parts):
            self.builder.store(part.value, self._address(len(parts) * slot + k), align=8)

    def _load(self, k: int | _Index) -> Reals:
        if not self.shared:
            return Reals(self.builder, self.builder.load(self._address(k), align=8))
        number = self.builder.load(self._pointer(k, 1))
        first, undefined = ir.Constant(ir.IntType(32), 0), ir.Constant(_VECTOR, ir.Undefined)
        one = self.builder.insert_element(undefined, number, first)
        everywhere = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
        return Reals(self.builder, self.builder.shuffle_vector(one, undefined, everywhere))

    def _address(self, k: int | _Index) -> Any:
        return self.builder.bitcast(self._pointer(k, LANES), _VECTOR.as_pointer())

    def _pointer(self, k: int | _Index, size: int) -> Any:
        """Address of entry k * size of the array."""
        if isinstance(k, _Index):
            place = self.builder.mul(k.value, k.value.type(k.scale * size))
            place = self.builder.add(place, place.type(k.offset * size))
        else:
            place = ir.IntType(64)(k * size)
        return self.builder.gep(self.data, [place])


class _Index:
    """A whole number that the machine finds, times a number, plus another."""

    def __init__(self, value: Any, scale: int = 1, offset: int = 0) -> None:
        self.value, self.scale, self.offset = value, scale, offset

    def __add__(self, number: int) -> _Index:
        return _Index(self.value, self.scale, self.offset + number)

    def __mul__(self, number: int) -> _Index:
        return _Index(self.value, self.scale * number, self.offset * number)

    __radd__, __rmul__ = __add__, __mul__


def loop(z: Any, count: int) -> Iterator[Any]:
    """The numbers 0 to count - 1; in traced code as a loop of the machine's, not unrolled."""
    if not isinstance(z, _Slots):
        yield from range(count)
        return
    with cgutils.for_range(z.builder, ir.IntType(64)(count)) as running:
        yield _Index(running.index)


def rows(z: Any, table: Any) -> Iterator[tuple[Any, list[Any]]]:
    """The rows of a table of whole numbers, numbered from 0; traced as `loop` is."""
    if not isinstance(z, _Slots):
        yield from enumerate(table)
        return
    builder = z.builder
    with cgutils.for_range(builder, builder.extract_value(table.shape, 0)) as running:
        first = builder.mul(running.index, running.index.type(2))
        places = (builder.add(first, first.type(k)) for k in range(2))
        yield (
            _Index(running.index),
            [_Index(builder.load(builder.gep(table.data, [place]))) for place in places],
        )


def registers(z: Any, count: int) -> Any:
    """Return slots of real numbers that are kept in registers, also through a loop."""
    if not isinstance(z, _Slots):
        return [0.0] * count
    data = cgutils.alloca_once(z.builder, _DOUBLE, size=count * LANES)
    return _Slots(z.builder, data, Reals, shared=False)


def compiled(function: Callable[..., None], kind: type, table: bool = False) -> Callable[..., None]:
    """Return `function` as a function of compiled code.

    Args:
        function: of z and shared, both indexed by slots; it writes its results into z.
        kind: `Reals` or `Complexes`, what a slot holds.
        table: it takes a table (M, 2) of whole numbers, too, for `rows`.

    Returns:
        A function of two contiguous float64 arrays, for use in jitted functions, and of an int64
        array if there is a table.
    """
    if table:
        return intrinsic(_with_table(function, kind))

    def typed(typingctx, z, shared):
        def codegen(context, builder, sig, args):
            arrays = [
                context.make_array(array)(context, builder, value).data
                for array, value in zip(sig.args, args, strict=True)
            ]
            function(*(_Slots(builder, data, kind, k == 1) for k, data in enumerate(arrays)))
            return context.get_dummy_value()

        return types.void(z, shared), codegen

    return intrinsic(typed)


def _with_table(function: Callable[[Any, Any, Any], None], kind: type) -> Callable[..., Any]:
    def typed(typingctx, z, shared, table):
        def codegen(context, builder, sig, args):
            first, second, third = (
                context.make_array(array)(context, builder, value)
                for array, value in zip(sig.args, args, strict=True)
            )
            slots = _Slots(builder, first.data, kind, False)
            function(slots, _Slots(builder, second.data, kind, True), third)
            return context.get_dummy_value()

        return types.void(z, shared, table), codegen

    return typed


def larger(a: Any, b: Any) -> Any:
    """The larger of each two numbers; b where they do not compare."""
    return a.larger(b) if isinstance(a, Reals) else np.where(a > b, a, b)
