"""Text for people: small HTML tables for notebooks, numbers and vectors as words."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from html import escape
from itertools import chain

import numpy as np
from numpy.typing import ArrayLike

SHOWN = 5  # rows at the start and at the end of a batch


def page(
    title: str, heads: Iterable[str], rows: Iterable[Iterable[str]], notes: Iterable[str] = ()
) -> str:
    """HTML of a table below a title and above notes, all given as plain text.

    No colours: the notebook's own theme, light or dark, gives them.
    """
    head = "".join(f"<th style='text-align:right'>{escape(text)}</th>" for text in heads)
    cell = "<td style='text-align:right;white-space:nowrap'>{}</td>".format
    body = "".join(f"<tr>{''.join(cell(escape(text)) for text in row)}</tr>" for row in rows)
    below = "".join(f"<div>{escape(text)}</div>" for text in notes)
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    return f"<div><strong>{escape(title)}</strong>{table}{below}</div>"


def rows_of(batch: tuple[int, ...], cells: Callable[[tuple[int, ...]], list[str]]) -> Iterator:
    """Yield index and cells of the first and the last rows of a batch, or of a single item."""
    count = int(np.prod(batch))
    cut = count > 2 * SHOWN + 1
    for k in chain(range(SHOWN), range(count - SHOWN, count)) if cut else range(count):
        index = tuple(map(int, np.unravel_index(k, batch)))
        row = [", ".join(map(str, index)), *cells(index)]
        if cut and k == count - SHOWN:
            yield ["⋮"] * len(row)
        yield row


def pose_heads(batch: tuple[int, ...], unit: str) -> list[str]:
    """Column heads of a table of poses: its index, then those of `gough.pose.pose_cells`."""
    units = (unit, unit, unit, "deg", "deg", "deg")
    return ["row" if batch else "", *map(with_unit, ("x", "y", "z", "rx", "ry", "rz"), units)]


def with_unit(name: str, unit: str) -> str:
    """A name and its unit in brackets, if it has one."""
    return f"{name} [{unit}]" if unit else name


def decimals(size: float, digits: int) -> int:
    """Digits after the point that show the first `digits` digits of numbers as large as `size`."""
    return max(0, digits - 1 - math.floor(math.log10(size)))


def number(value: ArrayLike, digits: str = ".4g") -> str:
    """Format a number, without a minus before zero; NaN becomes a dash."""
    real = float(np.asarray(value))
    return "–" if np.isnan(real) else f"{real:z{digits}}"


def vector(values: ArrayLike, between: str = ", ") -> str:
    """Format numbers side by side."""
    return between.join(number(v, ".6g") for v in np.ravel(values))
