"""Curves of any length in little memory: the lowest and highest value of many rows."""

from __future__ import annotations

import numpy as np

from gough.checks import Array

BINS = 600  # at least; a page is hardly finer


class Envelope:
    """Lowest and highest value of each of K signals over equal runs of rows.

    Rows come in blocks. As long as there are few, each has a bin of its own; when bins run out,
    neighbours are merged, so that a bin stands for 2, 4, 8, ... rows and no peak is lost.

    Attributes:
        names: of the signals.
        width: rows in a bin.
        rows: rows seen.
        unanswered: rows of them that have no usable answer.
    """

    def __init__(self, names: tuple[str, ...], bins: int = BINS) -> None:
        self.names, self.width, self.rows, self.unanswered = names, 1, 0, 0
        self._most = 2 * bins
        columns = 2 + 2 * len(names)  # first and last x, then lows, then highs
        self._bins = np.empty((0, columns))
        self._missing = np.empty(0, dtype=np.int64)
        self._waiting = self._bins, self._missing

    def add(self, x: Array, values: Array, answered: np.ndarray) -> None:
        """More rows: x (n,), values (n, K), NaN where there is none, and which (n,) of the
        rows have a usable answer.
        """
        gone = ~answered
        rows = np.concatenate([x[:, None], x[:, None], values, values], axis=1)
        self.rows += len(x)
        self.unanswered += int(gone.sum())
        rows = np.concatenate([self._waiting[0], rows])
        missing = np.concatenate([self._waiting[1], gone.astype(np.int64)])
        while len(rows) >= self.width:
            room = (self._most - len(self._bins)) * self.width
            whole = min(room, len(rows) // self.width * self.width)
            self._append(*self._merge(rows[:whole], missing[:whole], self.width))
            rows, missing = rows[whole:], missing[whole:]
            if len(self._bins) == self._most:
                self._bins, self._missing = self._merge(self._bins, self._missing, 2)
                self.width *= 2
        self._waiting = rows, missing

    def _append(self, bins: Array, missing: np.ndarray) -> None:
        self._bins = np.concatenate([self._bins, bins])
        self._missing = np.concatenate([self._missing, missing])

    def _merge(self, rows: Array, missing: np.ndarray, width: int) -> tuple[Array, np.ndarray]:
        k = len(self.names)
        groups = rows.reshape(-1, width, rows.shape[1])
        merged = np.concatenate(
            [
                groups[:, 0, :1],
                groups[:, -1, 1:2],
                np.fmin.reduce(groups[:, :, 2 : 2 + k], axis=1),  # NaN only where all are
                np.fmax.reduce(groups[:, :, 2 + k :], axis=1),
            ],
            axis=1,
        )
        return merged, missing.reshape(-1, width).sum(axis=1)

    def _table(self) -> tuple[Array, np.ndarray]:
        """All bins, the last one with what is left over."""
        rows, missing = self._waiting
        if not len(rows):
            return self._bins, self._missing
        last, count = self._merge(rows, missing, len(rows))
        return np.concatenate([self._bins, last]), np.concatenate([self._missing, count])

    @property
    def x(self) -> Array:
        """(B,) the middle of each bin."""
        return self._table()[0][:, :2].mean(axis=1)

    @property
    def low(self) -> Array:
        """(B, K) the lowest value in each bin."""
        return self._table()[0][:, 2 : 2 + len(self.names)]

    @property
    def high(self) -> Array:
        """(B, K) the highest value in each bin."""
        return self._table()[0][:, 2 + len(self.names) :]

    @property
    def missing(self) -> np.ndarray:
        """(B,) rows without a usable answer in each bin."""
        return self._table()[1]
