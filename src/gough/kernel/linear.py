"""Small dense algebra for the row solver: 6x6 systems, with pivoting or damping."""

from __future__ import annotations

import numpy as np

from gough.kernel.jit import jit


@jit()
def pivoted_solve(J, r, system, step):
    """Solve J step = r by elimination with complete pivoting; the determinant of J.

    Where the determinant is zero, `step` is not filled. `system` (6, 6) is overwritten.
    """
    system[:] = J
    right = r.copy()
    columns = np.arange(6)
    determinant = 1.0
    for p in range(6):
        best, row, column = 0.0, p, p
        for i in range(p, 6):
            for j in range(p, 6):
                if abs(system[i, j]) > best:
                    best, row, column = abs(system[i, j]), i, j
        if not best > 0.0:
            return 0.0
        if row != p:
            for j in range(6):
                system[p, j], system[row, j] = system[row, j], system[p, j]
            right[p], right[row] = right[row], right[p]
            determinant = -determinant
        if column != p:
            for i in range(6):
                system[i, p], system[i, column] = system[i, column], system[i, p]
            columns[p], columns[column] = columns[column], columns[p]
            determinant = -determinant
        determinant *= system[p, p]
        for i in range(p + 1, 6):
            factor = system[i, p] / system[p, p]
            for j in range(p + 1, 6):
                system[i, j] -= factor * system[p, j]
            right[i] -= factor * right[p]
    for p in range(5, -1, -1):
        total = right[p]
        for j in range(p + 1, 6):
            total -= system[p, j] * right[j]
        right[p] = total / system[p, p]
    for p in range(6):
        step[columns[p]] = right[p]
    return determinant


@jit()
def shifted_solve(J, r, damping, system, step):
    """Solve (J' J + damping I) step = J' r by Cholesky; the largest entry of |J' r|.

    `system` (6, 6) is overwritten by the factor.
    """
    steepest = 0.0
    for i in range(6):
        step[i] = 0.0
        for k in range(6):
            step[i] += J[k, i] * r[k]
        steepest = max(steepest, abs(step[i]))
    for i in range(6):
        for j in range(i + 1):
            total = damping if i == j else 0.0
            for k in range(6):
                total += J[k, i] * J[k, j]
            for k in range(j):
                total -= system[i, k] * system[j, k]
            if i == j:
                # damping keeps this positive but for rounding, which the floor stands for
                system[i, i] = np.sqrt(max(total, 1e-16 + 0.5 * damping))
            else:
                system[i, j] = total / system[j, j]
        for k in range(i):
            step[i] -= system[i, k] * step[k]
        step[i] /= system[i, i]
    for i in range(5, -1, -1):
        for k in range(i + 1, 6):
            step[i] -= system[k, i] * step[k]
        step[i] /= system[i, i]
    return steepest


@jit()
def smallest_singular_value(J, system):
    """Smallest singular value of J (6, 6), by Jacobi rotations of J' J (`system`).

    Good to about 1e-8 of the largest: enough to compare with a threshold well above that.
    """
    for i in range(6):
        for j in range(6):
            system[i, j] = 0.0
            for k in range(6):
                system[i, j] += J[k, i] * J[k, j]
    for _ in range(12):
        off = 0.0
        for i in range(6):
            for j in range(i):
                off += system[i, j] ** 2
        if off < 1e-30:
            break
        for i in range(6):
            for j in range(i):
                _annihilate(system, j, i)
    smallest = system[0, 0]
    for i in range(1, 6):
        smallest = min(smallest, system[i, i])
    return np.sqrt(max(smallest, 0.0))


@jit()
def _annihilate(A, p, q):
    """One Jacobi rotation that zeroes A[p, q] (Golub and Van Loan, sec. 8.5)."""
    if A[p, q] == 0.0:
        return
    theta = (A[q, q] - A[p, p]) / (2 * A[p, q])
    t = (1.0 if theta >= 0 else -1.0) / (abs(theta) + np.sqrt(theta * theta + 1))
    c = 1 / np.sqrt(t * t + 1)
    s = t * c
    for k in range(6):
        A[k, p], A[k, q] = c * A[k, p] - s * A[k, q], s * A[k, p] + c * A[k, q]
    for k in range(6):
        A[p, k], A[q, k] = c * A[p, k] - s * A[q, k], s * A[p, k] + c * A[q, k]
