"""The DisGNet paper's "GPU-friendly Newton-Raphson" (Algorithm 1): a batch of poses at once.

Poses are xi = log(T) in se(3), in base coordinates. Each sweep takes xi <- xi - Z F(xi) in all
rows (the paper's equation 21), with F(xi) = IK(exp(xi)) - l (16) and Z the inverse of J = dF/dxi
(17) by matrix products alone. From Z_0 = J^T / (|J|_1 |J|_inf) the iteration (20)

    Z <- Z (13 I - JZ (15 I - JZ (7 I - JZ))) / 4

of Razavi et al. (2014) turns the error E = I - JZ into (3 E^3 + E^4) / 4: it cubes. J Z_0 is
symmetric with eigenvalues s^2 / (|J|_1 |J|_inf) in [0, 1], s the singular values of J, so E shrinks
from the first step on if and only if J is regular. Beyond the paper each row stops by itself: it
leaves the batch when it has converged, when its Jacobian has no inverse, or when it diverges.
Derivations: docs/gpu_newton.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from gough.checks import Array, as_batch
from gough.errors import GoughError
from gough.learn.gradients import implicit_pose
from gough.learn.kinematics import (
    TorchPlatform,
    se3_exp,
    se3_exp_jacobian,
    se3_log,
    se3_shortest,
)
from gough.platform import Platform
from gough.pose import Pose
from gough.status import NewtonStatus

REGULAR = 0.5  # largest |I - JZ| of an inverse that is used: the step errs by less than half
FAR = 1e3  # distance from the base [platform size] beyond which a row has diverged


@dataclass(frozen=True, eq=False)
class Refined:
    """Final state of each row, as tensors on the device of the computation.

    Attributes:
        position: (N, 3) [platform unit]; the last pose of rows that did not converge, NaN for rows
            with invalid input.
        rotation: (N, 3, 3).
        status: (N,) uint8, to be compared with `NewtonStatus` members.
        iterations: (N,) int64, steps taken.
        inverse_iterations: (N,) int64, the most iterations that an inverse took.
        step: (N,) `|xi_new - xi|_1` of the last step, [platform unit] and [rad] added up.
        residual: (N,) largest strut length error at the end [platform unit].
        sweeps: passes of the whole batch.
    """

    position: Tensor
    rotation: Tensor
    status: Tensor
    iterations: Tensor
    inverse_iterations: Tensor
    step: Tensor
    residual: Tensor
    sweeps: int


@dataclass(frozen=True, eq=False)
class BatchedSolution:
    """Final state of each row as in `Refined`, with a Pose (N,) and NumPy arrays."""

    pose: Pose
    status: NDArray[np.uint8]
    iterations: NDArray[np.int64]
    inverse_iterations: NDArray[np.int64]
    step: Array
    residual: Array
    sweeps: int

    @property
    def converged(self) -> NDArray[np.bool_]:
        """Rows (N,) that converged."""
        return self.status == NewtonStatus.CONVERGED

    @property
    def singular(self) -> NDArray[np.bool_]:
        """Rows (N,) that reached a Jacobian without inverse."""
        return self.status == NewtonStatus.SINGULAR

    def counts(self) -> dict[NewtonStatus, int]:
        """Number of rows of each status that occurs."""
        numbers = np.bincount(self.status, minlength=len(NewtonStatus))
        return {s: int(numbers[s]) for s in NewtonStatus if numbers[s]}


def batched_newton(
    platform: Platform,
    guess: Pose,
    legs: ArrayLike,
    *,
    gamma: float = 1e-4,
    f_max: int = 20,
    z_max: int = 100,
    scaled: bool = False,
    device: str | torch.device = "cpu",
    dtype: torch.dtype = torch.float64,
) -> BatchedSolution:
    """Refine guesses for readings (N, 6), all rows at once.

    Args:
        platform: the machine.
        guess: one pose, or (N,).
        legs: readings (N, 6).
        gamma: a row has converged when `|xi_new - xi|_1` is below it. As in the paper this adds up
            [platform unit] and [rad]: for a machine in mm it is mostly about mm.
        f_max: most iterations of an inverse.
        z_max: most steps of a row.
        scaled: invert the Jacobian with lengths in units of the machine's size, where it is better
            conditioned; False is the paper's method.
        device: PyTorch's name of the device to compute on.
        dtype: precision of the computation.

    Raises:
        GoughError: legs that are not (N, 6), another number of guesses, an option out of range.

    Example:
        >>> end = batched_newton(platform, platform.home, legs)
        >>> end.pose[end.converged]
    """
    readings = as_batch("legs", legs, (6,))
    if readings.ndim != 2 or guess.batch not in ((), (len(readings),)):
        raise GoughError(
            f"legs, guess: expected (N, 6) and N poses or one, got {readings.shape} and batch "
            f"{guess.batch}"
        )
    tensor = lambda x: torch.tensor(x, dtype=dtype, device=device)  # noqa: E731
    position = tensor(np.broadcast_to(guess.position, (len(readings), 3)))
    rotation = tensor(np.broadcast_to(guess.rotation, (len(readings), 3, 3)))
    end = refine(
        TorchPlatform(platform, dtype).to(device), position, rotation, tensor(readings),
        gamma=gamma, f_max=f_max, z_max=z_max, scaled=scaled,
    )  # fmt: skip
    array = lambda x: x.cpu().numpy()  # noqa: E731
    return BatchedSolution(
        Pose.from_rotation(array(end.position.double()), array(end.rotation.double())),
        array(end.status), array(end.iterations), array(end.inverse_iterations),
        array(end.step.double()), array(end.residual.double()), end.sweeps,
    )  # fmt: skip


def refine(
    platform: TorchPlatform,
    position: Tensor,
    rotation: Tensor,
    legs: Tensor,
    *,
    gamma: float = 1e-4,
    f_max: int = 20,
    z_max: int = 100,
    scaled: bool = False,
) -> Refined:
    """Refine guesses (N, 3), (N, 3, 3) for readings (N, 6), as `batched_newton` on tensors.

    Where legs or the platform's joints (`TorchPlatform.with_joints`) require gradients, the poses
    of converged rows carry them; see `implicit_pose`.

    Raises:
        GoughError: an option out of range.
    """
    if not gamma > 0 or f_max < 0 or z_max < 0:
        raise GoughError(
            f"gamma, f_max, z_max: expected above 0, 0 or more and 0 or more, found {gamma}, "
            f"{f_max}, {z_max}"
        )
    with torch.no_grad():
        rows = _Rows(platform, position, rotation, legs)
        end = _iterate(platform, rows, gamma, f_max, z_max, scaled)
    converged = end.status == NewtonStatus.CONVERGED
    position, rotation = implicit_pose(platform, end.position, end.rotation, legs, converged)
    return replace(end, position=position, rotation=rotation)


def _iterate(platform: TorchPlatform, rows: _Rows, gamma: float, f_max: int, z_max: int,
             scaled: bool) -> Refined:  # fmt: skip
    """Sweep over the active rows until none is left or `z_max` sweeps are done."""
    size = platform.platform.size
    reach = FAR * (size + float(np.linalg.norm(platform.platform.home.position)))
    units = rows.xi.new_tensor([1, 1, 1, size, size, size] if scaled else [1] * 6)
    sweeps = 0
    while len(rows.active) and sweeps < z_max:
        sweeps += 1
        errors, J = rows.equations()
        found = approximate_inverse(J / units, f_max)
        step = (found.Z @ errors[..., None])[..., 0] / units
        regular = found.error < REGULAR  # False where the error is NaN
        rows.take(step, found.iterations, regular, gamma, reach)
    return rows.end(sweeps)


class _Rows:
    """State of the batch; `active` are the numbers of the rows that still move."""

    def __init__(self, platform: TorchPlatform, position: Tensor, rotation: Tensor,
                 legs: Tensor) -> None:  # fmt: skip
        count, device = len(legs), legs.device
        counter = lambda: torch.zeros(count, dtype=torch.int64, device=device)  # noqa: E731
        self.platform = platform
        self.ends, self.lengths = platform.equivalent_struts(legs)
        valid = legs.isfinite().all(-1) & (self.lengths > 0).all(-1)
        valid &= position.isfinite().all(-1) & rotation.isfinite().flatten(1).all(-1)
        eye = torch.eye(3, dtype=legs.dtype, device=device)
        t = torch.where(valid[:, None], position, 0)
        self.xi = se3_log(t, torch.where(valid[:, None, None], rotation, eye))
        self.status = torch.full(
            (count,), NewtonStatus.NOT_CONVERGED, dtype=torch.uint8, device=device
        )
        self.status[~valid] = NewtonStatus.INVALID_INPUT
        self.iterations, self.inverse_iterations = counter(), counter()
        self.step = legs.new_full((count,), torch.nan)
        self.active = valid.nonzero()[:, 0]

    def equations(self) -> tuple[Tensor, Tensor]:
        """F (n, 6) [platform unit] and dF/dxi (n, 6, 6) of the active rows: equations 16, 17."""
        xi, rows = self.xi[self.active], self.active
        position, rotation = se3_exp(xi)
        errors, J = self.platform.strut_errors(
            position, rotation, self.ends[rows], self.lengths[rows]
        )
        return errors, J @ se3_exp_jacobian(xi)

    def take(self, step: Tensor, inverse_iterations: Tensor, regular: Tensor, gamma: float,
             reach: float) -> None:  # fmt: skip
        """Take steps (n, 6), equation 21, where J is regular; rows that have ended leave."""
        rows = self.active
        most = torch.maximum(self.inverse_iterations[rows], inverse_iterations)
        self.inverse_iterations[rows] = most
        self.status[rows[~regular]] = NewtonStatus.SINGULAR
        rows, step = rows[regular], step[regular]
        xi = self.xi[rows] - step
        near = torch.linalg.vector_norm(xi[:, :3], dim=-1) < reach  # False where it is NaN
        self.status[rows[~near]] = NewtonStatus.DIVERGED
        rows, step, xi = rows[near], step[near], xi[near]
        beyond = torch.linalg.vector_norm(xi[:, 3:], dim=-1) > torch.pi
        if beyond.any():
            xi[beyond] = se3_shortest(xi[beyond])
        self.xi[rows] = xi
        self.iterations[rows] += 1
        self.step[rows] = step.abs().sum(-1)
        small = self.step[rows] < gamma
        self.status[rows[small]] = NewtonStatus.CONVERGED
        self.active = rows[~small]

    def end(self, sweeps: int) -> Refined:
        """Current state of all rows."""
        position, rotation = se3_exp(self.xi)
        invalid = self.status == NewtonStatus.INVALID_INPUT
        position[invalid], rotation[invalid] = torch.nan, torch.nan
        errors, _ = self.platform.strut_errors(position, rotation, self.ends, self.lengths)
        return Refined(
            position, rotation, self.status, self.iterations, self.inverse_iterations, self.step,
            errors.abs().amax(-1), sweeps,
        )  # fmt: skip


# ---- inverses by matrix products ----------------------------------------------------------


@dataclass(frozen=True)
class Inverses:
    """Approximate inverses Z of matrices J.

    Attributes:
        Z: (N, n, n).
        error: (N,) `|I - JZ|` in the Frobenius norm; NaN for a matrix that holds NaN.
        iterations: (N,) int64.
    """

    Z: Tensor
    error: Tensor
    iterations: Tensor


def first_inverse(J: Tensor) -> Tensor:
    """Z_0 (..., n, n) of matrices J (..., n, n)."""
    size = torch.linalg.matrix_norm(J, 1) * torch.linalg.matrix_norm(J, torch.inf)
    return J.mT / size[..., None, None]


def next_inverse(Z: Tensor, JZ: Tensor) -> Tensor:
    """Z_(f+1) of Z_f and J Z_f, each (..., n, n): the paper's equation 20."""
    eye = torch.eye(JZ.shape[-1], dtype=JZ.dtype, device=JZ.device)
    return Z @ (13 * eye - JZ @ (15 * eye - JZ @ (7 * eye - JZ))) / 4


def approximate_inverse(J: Tensor, f_max: int = 20) -> Inverses:
    """Iterate each of the matrices J (N, n, n) until its error is below sqrt(eps) of the dtype.

    Each stops by itself, after at most `f_max` iterations: the result for a matrix does not
    depend on the others of its batch.
    """
    tolerance = torch.finfo(J.dtype).eps ** 0.5
    eye = torch.eye(J.shape[-1], dtype=J.dtype, device=J.device)
    Z, error = torch.empty_like(J), J.new_empty(len(J))
    iterations = torch.zeros(len(J), dtype=torch.int64, device=J.device)
    active = torch.arange(len(J), device=J.device)
    z = first_inverse(J)
    for f in range(f_max + 1):
        JZ = J @ z
        now = torch.linalg.matrix_norm(eye - JZ)
        more = (now > tolerance) & (f < f_max)  # False where the error is NaN
        done = ~more
        if done.any():
            rows = active[done]
            Z[rows], error[rows], iterations[rows] = z[done], now[done], f
            if not more.any():
                break
            J, z, JZ, active = J[more], z[more], JZ[more], active[more]
        z = next_inverse(z, JZ)
    return Inverses(Z, error, iterations)
