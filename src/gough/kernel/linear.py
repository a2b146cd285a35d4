"""Small dense algebra for single rows: 6x6 systems with pivoting or damping, singular values."""

from __future__ import annotations

from math import sqrt

from gough.kernel.jit import inner


@inner
def pivoted_solve(J, r, system, step):
    """Solve J step = r by elimination with partial pivoting; return the determinant of J.

    Where the determinant is zero, `step` is not the solution. `system` (6, 6) is overwritten.
    """
    for i in range(6):
        step[i] = r[i]
        for j in range(6):
            system[i, j] = J[i, j]
    determinant = 1.0
    for p in range(6):
        best = p
        for i in range(p + 1, 6):
            if abs(system[i, p]) > abs(system[best, p]):
                best = i
        if not abs(system[best, p]) > 0.0:
            return 0.0
        if best != p:
            for j in range(p, 6):
                system[p, j], system[best, j] = system[best, j], system[p, j]
            step[p], step[best] = step[best], step[p]
            determinant = -determinant
        determinant *= system[p, p]
        for i in range(p + 1, 6):
            factor = system[i, p] / system[p, p]
            for j in range(p + 1, 6):
                system[i, j] -= factor * system[p, j]
            step[i] -= factor * step[p]
    for p in range(5, -1, -1):
        for j in range(p + 1, 6):
            step[p] -= system[p, j] * step[j]
        step[p] /= system[p, p]
    return determinant


@inner
def damped_solve(J, r, damping, system, step):
    """Solve (J' J + damping I) step = J' r by Cholesky; return the largest entry of |J' r|.

    `system` (6, 6) is overwritten by the factor.
    """
    steepest = 0.0
    for i in range(6):
        step[i] = 0.0
        for k in range(6):
            step[i] += J[k, i] * r[k]
        steepest = abs(step[i]) if abs(step[i]) > steepest else steepest
    floor = 1e-16 + 0.5 * damping  # damping keeps pivots above it but for rounding
    for i in range(6):
        for j in range(i + 1):
            total = damping if i == j else 0.0
            for k in range(6):
                total += J[k, i] * J[k, j]
            for k in range(j):
                total -= system[i, k] * system[j, k]
            if i == j:
                system[i, i] = sqrt(total if total > floor else floor)
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


@inner
def smallest_singular_value(J, system):
    """Smallest singular value of J (6, 6), by Jacobi rotations of J' J (`system`).

    Good to about 1e-8 of the largest: enough to compare with a threshold well above that.
    Each rotation makes one entry off the diagonal zero (Golub and Van Loan, sec. 8.5).
    """
    A = system
    for i in range(6):
        for j in range(6):
            A[i, j] = 0.0
            for k in range(6):
                A[i, j] += J[k, i] * J[k, j]
    for _ in range(12):
        off = 0.0
        for q in range(6):
            for p in range(q):
                if A[p, q] == 0.0:
                    continue
                off += A[p, q] * A[p, q]
                theta = (A[q, q] - A[p, p]) / (2 * A[p, q])
                t = (1.0 if theta >= 0 else -1.0) / (abs(theta) + sqrt(theta * theta + 1))
                c = 1 / sqrt(t * t + 1)
                s = t * c
                for k in range(6):
                    A[k, p], A[k, q] = c * A[k, p] - s * A[k, q], s * A[k, p] + c * A[k, q]
                for k in range(6):
                    A[p, k], A[q, k] = c * A[p, k] - s * A[q, k], s * A[p, k] + c * A[q, k]
        if off < 1e-30:
            break
    smallest = A[0, 0]
    for i in range(1, 6):
        smallest = A[i, i] if A[i, i] < smallest else smallest
    return sqrt(smallest if smallest > 0.0 else 0.0)
