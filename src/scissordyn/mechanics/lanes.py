"""Short loops over plane vectors with the processor's vector instructions.

The loop vectorizer leaves loops as short as these to scalar instructions, so that the instructions are written here. In C
and in plain Python the functions are what their own lines say; numba's compiler puts those with `_generate` in their place.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import lower_builtin, register_jitable, type_callable

__all__ = [
    "LANES",
    "PAIRS",
    "SHORT",
    "combine",
    "even",
    "join",
    "padded",
    "part",
    "pull",
    "row_times",
    "stretch",
    "take_row",
    "transform",
]

LANES = 8
"""Rows of tables have a whole multiple of so many numbers, which processors take at once."""

PAIRS = LANES // 2
"""Plane vectors whose components fill the lanes."""

SHORT = 4
"""Numbers that rows of a band are taken by."""

TOGETHER = 2
"""Vectors of numbers that are summed at once: fewer sums wait for each other's latency."""


def combine(table, first, rows, width, x, y, sx, sy):
    """Write the sums of the rows of a table, each times a vector; its rows have whole lanes and begin at `first`."""
    for column in range(width):
        sx[column] = sy[column] = 0.0
    for row in range(rows):
        for column in range(width):
            sx[column] += table[first + row * width + column] * x[row]
            sy[column] += table[first + row * width + column] * y[row]


def transform(table, first, rows, width, x, sx):
    """Write the sums of the rows of a table, each times a number; an even number of rows, which have whole lanes."""
    for column in range(width):
        sx[column] = 0.0
    for row in range(rows):
        for column in range(width):
            sx[column] += table[first + row * width + column] * x[row]


def stretch(rx, ry, free, inverse, strain, width):
    """Write one over the sizes of vectors, and by how much they are longer than 1 + `free`; for whole lanes."""
    for g in range(width):
        size = math.sqrt(rx[g] * rx[g] + ry[g] * ry[g])
        inverse[g] = 1.0 / (size if size > 0.0 else 1.0)
        strain[g] = size - 1.0 - free


def pull(factor, force, inverse, rx, ry, fx, fy, width):
    """Write forces along vectors with one over their sizes, times a factor; for whole lanes."""
    for g in range(width):
        each = factor * force[g] * inverse[g]
        fx[g] = each * rx[g]
        fy[g] = each * ry[g]


def part(source, first, factor, x, y, place, count):
    """Write plane vectors, times a factor, from where they follow each other to their components; for whole `PAIRS`."""
    for k in range(count):
        x[place + k] = factor * source[first + 2 * k]
        y[place + k] = factor * source[first + 2 * k + 1]


def join(target, first, factor, x, y, place, count):
    """Add plane vectors by their components, times a factor, to where they follow each other; for whole `PAIRS`."""
    for k in range(count):
        target[first + 2 * k] += factor * x[place + k]
        target[first + 2 * k + 1] += factor * y[place + k]


def take_row(table, row, column, other, begin, factor, count):
    """Take `count` numbers of the row `other` from `begin` on, times a factor, from a row; `SHORT` - 1 zeros follow them."""
    for k in range(count):
        table[row, column + k] -= factor * table[other, begin + k]


def row_times(table, row, column, x, first, count):
    """The sum of `count` products of a row with numbers of x."""
    total = 0.0
    for k in range(count):
        total += table[row, column + k] * x[first + k]
    return total


@register_jitable
def padded(count: int) -> int:
    """The width of a row with so many numbers, in whole lanes."""
    return LANES * ((count + LANES - 1) // LANES)


@register_jitable
def even(count: int) -> int:
    """The least even number that is not smaller."""
    return count + count % 2


_VECTOR, _WORD = ir.VectorType(ir.DoubleType(), LANES), ir.IntType(64)


type_callable(combine)(lambda context: lambda table, first, rows, width, x, y, sx, sy: types.none)
type_callable(transform)(lambda context: lambda table, first, rows, width, x, sx: types.none)
type_callable(stretch)(lambda context: lambda rx, ry, free, inverse, strain, width: types.none)
type_callable(part)(lambda context: lambda source, first, factor, x, y, place, count: types.none)
type_callable(join)(lambda context: lambda target, first, factor, x, y, place, count: types.none)
type_callable(take_row)(lambda context: lambda table, row, column, other, begin, factor, count: types.none)
type_callable(row_times)(lambda context: lambda table, row, column, x, first, count: types.float64)
type_callable(pull)(lambda context: lambda factor, force, inverse, rx, ry, fx, fy, width: types.none)


def _data(context: Any, builder: Any, signature: Any, arguments: Any) -> list[Any]:
    """Where the numbers of arrays are; vectors of the same number; whole numbers as words."""
    found = []
    for kind, value in zip(signature.args, arguments, strict=True):
        if isinstance(kind, types.Array):
            found.append(context.make_array(kind)(context, builder, value).data)
        elif isinstance(kind, types.Float):
            found.append(_splat(builder, value))
        else:
            found.append(context.cast(builder, value, kind, types.int64))
    return found


def _by_lanes(builder: Any, width: Any, sources: list[Any], targets: list[Any], body: Callable[..., tuple[Any, ...]]) -> None:
    """Write what `body` makes of vectors of the sources to the targets."""
    with cgutils.for_range_slice(builder, ir.Constant(_WORD, 0), width, ir.Constant(_WORD, LANES), _WORD) as (column, _):
        found = body(*(builder.load(_at(builder, each, column), align=8) for each in sources))
        for target, value in zip(targets, found, strict=True):
            builder.store(value, _at(builder, target, column), align=8)


@lower_builtin(stretch, types.Array, types.Array, types.Float, types.Array, types.Array, types.Integer)
def _generate_stretch(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    rx, ry, free, inverse, strain, width = _data(context, builder, signature, arguments)
    root = cgutils.get_or_insert_function(builder.module, ir.FunctionType(_VECTOR, [_VECTOR]), f"llvm.sqrt.v{LANES}f64")
    zero, one = ir.Constant(_VECTOR, [0.0] * LANES), ir.Constant(_VECTOR, [1.0] * LANES)

    def body(x: Any, y: Any) -> tuple[Any, ...]:
        found = builder.call(root, [builder.fadd(builder.fmul(x, x), builder.fmul(y, y))])
        # 1/0 in what fills the lanes would raise a flag of the processor, which LAPACK's callers look at
        divisor = builder.select(builder.fcmp_ordered(">", found, zero), found, one)
        return builder.fdiv(one, divisor), builder.fsub(builder.fsub(found, one), free)

    _by_lanes(builder, width, [rx, ry], [inverse, strain], body)
    return context.get_dummy_value()


@lower_builtin(pull, types.Float, *(types.Array,) * 6, types.Integer)
def _generate_pull(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    factor, force, inverse, rx, ry, fx, fy, width = _data(context, builder, signature, arguments)

    def body(f: Any, i: Any, x: Any, y: Any) -> tuple[Any, ...]:
        each = builder.fmul(builder.fmul(factor, f), i)
        return builder.fmul(each, x), builder.fmul(each, y)

    _by_lanes(builder, width, [force, inverse, rx, ry], [fx, fy], body)
    return context.get_dummy_value()


_QUARTER = ir.VectorType(ir.DoubleType(), SHORT)


def _in_row(context: Any, builder: Any, kind: Any, table: Any, row: Any, column: Any) -> Any:
    """Where an entry of a table of two dimensions is."""
    made = context.make_array(kind)(context, builder, table)
    _, wide = cgutils.unpack_tuple(builder, made.shape)
    words = [context.cast(builder, value, types.intp, types.int64) for value in (row, column)]
    return builder.gep(made.data, [builder.add(builder.mul(words[0], wide), words[1])])


@lower_builtin(take_row, types.Array, *(types.Integer,) * 4, types.Float, types.Integer)
def _generate_take_row(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    table, row, column, other, begin, factor, count = arguments
    target, source = (_in_row(context, builder, signature.args[0], table, *at) for at in ((row, column), (other, begin)))
    fused = _fused(builder, _QUARTER)
    factors = _splat(builder, builder.fneg(factor), SHORT)
    with cgutils.for_range_slice(builder, ir.Constant(_WORD, 0), count, ir.Constant(_WORD, SHORT), _WORD) as (k, _):
        to = _at(builder, target, k, _QUARTER)
        numbers = builder.load(_at(builder, source, k, _QUARTER), align=8)
        builder.store(builder.call(fused, [numbers, factors, builder.load(to, align=8)]), to, align=8)
    return context.get_dummy_value()


@lower_builtin(row_times, types.Array, *(types.Integer,) * 2, types.Array, *(types.Integer,) * 2)
def _generate_row_times(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """By lanes, and what is left one by one."""
    table, row, column, x, first, count = arguments
    numbers = _in_row(context, builder, signature.args[0], table, row, column)
    vector = builder.gep(context.make_array(signature.args[3])(context, builder, x).data, [first])
    step, fused = ir.Constant(_WORD, SHORT), _fused(builder, _QUARTER)
    whole = builder.mul(builder.sdiv(count, step), step)
    sums, total = cgutils.alloca_once(builder, _QUARTER), cgutils.alloca_once(builder, ir.DoubleType())
    builder.store(ir.Constant(_QUARTER, [0.0] * SHORT), sums)
    with cgutils.for_range_slice(builder, ir.Constant(_WORD, 0), whole, step, _WORD) as (k, _):
        pair = [builder.load(_at(builder, each, k, _QUARTER), align=8) for each in (numbers, vector)]
        builder.store(builder.call(fused, [*pair, builder.load(sums)]), sums)
    lanes = [builder.extract_element(builder.load(sums), ir.Constant(ir.IntType(32), k)) for k in range(SHORT)]
    builder.store(builder.fadd(builder.fadd(lanes[0], lanes[1]), builder.fadd(lanes[2], lanes[3])), total)
    with cgutils.for_range_slice(builder, whole, count, ir.Constant(_WORD, 1), _WORD) as (k, _):
        one, other = (builder.load(builder.gep(each, [k])) for each in (numbers, vector))
        builder.store(builder.fadd(builder.load(total), builder.fmul(one, other)), total)
    return builder.load(total)


_VECTORS = (types.Array, types.Integer, types.Float, types.Array, types.Array, types.Integer, types.Integer)
_HALF = ir.VectorType(ir.DoubleType(), PAIRS)


@lower_builtin(part, *_VECTORS)
def _generate_part(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    source, first, factor, x, y, place, count = _data(context, builder, signature, arguments)
    with cgutils.for_range_slice(builder, ir.Constant(_WORD, 0), count, ir.Constant(_WORD, PAIRS), _WORD) as (k, _):
        pairs = builder.load(_at(builder, source, builder.add(first, builder.mul(k, ir.Constant(_WORD, 2)))), align=8)
        scaled = builder.fmul(pairs, factor)
        for target, odd in ((x, 0), (y, 1)):
            chosen = _shuffled(builder, scaled, scaled, [2 * i + odd for i in range(PAIRS)])
            builder.store(chosen, _at(builder, target, builder.add(place, k), _HALF), align=8)
    return context.get_dummy_value()


@lower_builtin(join, *_VECTORS)
def _generate_join(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    target, first, factor, x, y, place, count = _data(context, builder, signature, arguments)
    with cgutils.for_range_slice(builder, ir.Constant(_WORD, 0), count, ir.Constant(_WORD, PAIRS), _WORD) as (k, _):
        one, other = (builder.load(_at(builder, each, builder.add(place, k), _HALF), align=8) for each in (x, y))
        pairs = _shuffled(builder, one, other, [i // 2 + PAIRS * (i % 2) for i in range(LANES)])
        at = _at(builder, target, builder.add(first, builder.mul(k, ir.Constant(_WORD, 2))))
        builder.store(builder.fadd(builder.load(at, align=8), builder.fmul(pairs, factor)), at, align=8)
    return context.get_dummy_value()


def _shuffled(builder: Any, one: Any, other: Any, places: list[int]) -> Any:
    """Numbers of two vectors, by their places."""
    return builder.shuffle_vector(one, other, ir.Constant(ir.VectorType(ir.IntType(32), len(places)), places))


def _splat(builder: Any, number: Any, lanes: int = LANES) -> Any:
    """A vector of the same number."""
    nothing = ir.Constant(ir.VectorType(ir.DoubleType(), lanes), ir.Undefined)
    one = builder.insert_element(nothing, number, ir.Constant(ir.IntType(32), 0))
    return _shuffled(builder, one, nothing, [0] * lanes)


def _at(builder: Any, pointer: Any, place: Any, kind: Any = _VECTOR) -> Any:
    return builder.bitcast(builder.gep(pointer, [place]), kind.as_pointer())


@lower_builtin(transform, types.Array, types.Integer, types.Integer, types.Integer, types.Array, types.Array)
def _generate_transform(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """By lanes, even and odd rows apart: their sums do not wait for each other."""
    table, first, rows, width, x, sx = _data(context, builder, signature, arguments)
    fused = _fused(builder)
    two = ir.Constant(_WORD, 2)
    with cgutils.for_range_slice(builder, ir.Constant(_WORD, 0), width, ir.Constant(_WORD, LANES), _WORD) as (column, _):
        sums = [cgutils.alloca_once(builder, _VECTOR) for _ in range(2)]
        for each in sums:
            builder.store(ir.Constant(_VECTOR, [0.0] * LANES), each)
        with cgutils.for_range_slice(builder, ir.Constant(_WORD, 0), rows, two, _WORD) as (row, _):
            for odd, each in enumerate(sums):
                at = builder.add(row, ir.Constant(_WORD, odd))
                numbers = _at(builder, table, builder.add(builder.add(first, column), builder.mul(at, width)))
                factor = _splat(builder, builder.load(builder.gep(x, [at])))
                builder.store(builder.call(fused, [builder.load(numbers, align=8), factor, builder.load(each)]), each)
        builder.store(builder.fadd(builder.load(sums[0]), builder.load(sums[1])), _at(builder, sx, column), align=8)
    return context.get_dummy_value()


def _fused(builder: Any, vector: Any = _VECTOR) -> Any:
    """Product and sum of vectors."""
    name = f"llvm.fmuladd.v{vector.count}f64"
    return cgutils.get_or_insert_function(builder.module, ir.FunctionType(vector, [vector] * 3), name)


@lower_builtin(combine, types.Array, types.Integer, types.Integer, types.Integer, *(types.Array,) * 4)
def _generate_combine(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """Columns by `TOGETHER` vectors, then what is left of them by one."""
    table, first, rows, width, *vectors = _data(context, builder, signature, arguments)
    arrays = [table, *vectors]
    fused = _fused(builder)
    stride = ir.Constant(_WORD, TOGETHER * LANES)
    whole = builder.mul(builder.sdiv(width, stride), stride)
    for begin, end, count in ((ir.Constant(_WORD, 0), whole, TOGETHER), (whole, width, 1)):
        with cgutils.for_range_slice(builder, begin, end, ir.Constant(_WORD, count * LANES), _WORD) as (column, _):
            _write_sums(builder, fused, arrays, (first, rows, width, column), count)
    return context.get_dummy_value()


def _write_sums(builder: Any, fused: Any, arrays: Any, sizes: Any, count: int) -> None:
    """The sums of `count` vectors of columns, from one column on."""
    (table, x, y, sx, sy), (first, rows, width, column) = arrays, sizes
    lanes = [ir.Constant(_WORD, k * LANES) for k in range(count)]
    sums = [(cgutils.alloca_once(builder, _VECTOR), cgutils.alloca_once(builder, _VECTOR)) for _ in lanes]
    for pair in sums:
        for each in pair:
            builder.store(ir.Constant(_VECTOR, [0.0] * LANES), each)
    with cgutils.for_range(builder, rows) as loop:
        place = builder.add(builder.add(first, column), builder.mul(loop.index, width))
        factors = [_splat(builder, builder.load(builder.gep(each, [loop.index]))) for each in (x, y)]
        for lane, pair in zip(lanes, sums, strict=True):
            numbers = builder.load(_at(builder, table, builder.add(place, lane)), align=8)
            for factor, each in zip(factors, pair, strict=True):
                builder.store(builder.call(fused, [numbers, factor, builder.load(each)]), each)
    for lane, pair in zip(lanes, sums, strict=True):
        for target, each in zip((sx, sy), pair, strict=True):
            builder.store(builder.load(each), _at(builder, target, builder.add(column, lane)), align=8)
