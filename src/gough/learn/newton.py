"""The DisGNet paper's "GPU-friendly Newton-Raphson" (Algorithm 1): a batch of poses at once.

Poses are xi = log(T) in se(3), in the base's frame. Each sweep takes xi <- xi - Z F(xi) in all
rows, with F(xi) = IK(exp(xi)) - l and Z the inverse of dF/dxi by matrix products (`inverse`).
Beyond the paper each row has an end of its own: it leaves the batch when it has converged, when
its Jacobian has no inverse, or when it runs away. Derivations: docs/gpu_newton.md.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from gough.checks import Array, as_batch
from gough.errors import GoughError
from gough.learn import se3
from gough.learn.implicit import implicit_pose
from gough.learn.inverse import approximate_inverse
from gough.learn.kinematics import TorchPlatform, quaternion_to_matrix
from gough.platform import Platform
from gough.pose import Pose
from gough.status import NewtonStatus

REGULAR = 0.5  # largest |I - JZ| of an inverse that is followed: the step errs by less than half
FAR = 1e3  # distance from the base, in sizes of the machine, from which no row comes back


@dataclass(frozen=True, eq=False)
class Refined:
    """What became of each row, as tensors on the device of the computation.

    Attributes:
        position: (N, 3) [unit]; rows that did not converge hold their last pose, those with
            invalid input NaN.
        rotation: (N, 3, 3).
        outcome: (N,) uint8, to be compared with `NewtonStatus` members.
        iterations: (N,) int64, steps taken.
        inverse_iterations: (N,) int64, the most that an inverse took.
        step: (N,) `|xi_new - xi|_1` of the last step, [unit] and [rad] added up.
        residual: (N,) largest strut length error at the end [unit].
        sweeps: passes of the whole batch.
    """

    position: Tensor
    rotation: Tensor
    outcome: Tensor
    iterations: Tensor
    inverse_iterations: Tensor
    step: Tensor
    residual: Tensor
    sweeps: int


@dataclass(frozen=True, eq=False)
class BatchedSolution:
    """As `Refined`, but `pose` is a Pose (N,) and the rest are NumPy arrays."""

    pose: Pose
    outcome: NDArray[np.uint8]
    iterations: NDArray[np.int64]
    inverse_iterations: NDArray[np.int64]
    step: Array
    residual: Array
    sweeps: int

    @property
    def converged(self) -> NDArray[np.bool_]:
        """Rows (N,) that converged."""
        return self.outcome == NewtonStatus.CONVERGED

    @property
    def singular(self) -> NDArray[np.bool_]:
        """Rows (N,) that came to a Jacobian without inverse."""
        return self.outcome == NewtonStatus.SINGULAR

    def counts(self) -> dict[NewtonStatus, int]:
        """How many rows ended in each way that occurs."""
        numbers = np.bincount(self.outcome, minlength=len(NewtonStatus))
        return {o: int(numbers[o]) for o in NewtonStatus if numbers[o]}


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
    """Refine guesses, one pose or (N,), for readings (N, 6), all rows at once.

    Args:
        gamma: a row has converged when `|xi_new - xi|_1` is below it. As in the paper that adds up
            [unit] and [rad]: for a machine in mm it is mostly about mm.
        f_max: iterations of an inverse.
        z_max: steps of a row.
        scaled: invert the Jacobian with lengths told in the machine's size, where it is better
            conditioned; False is the paper's.

    Raises:
        GoughError: legs that are not (N, 6), another number of guesses, an option out of range.
    """
    readings = as_batch("legs", legs, (6,))
    if readings.ndim != 2 or guess.batch not in ((), (len(readings),)):
        raise GoughError(
            f"legs, guess: expected (N, 6) and N poses or one, got {readings.shape} and batch "
            f"{guess.batch}"
        )
    tensor = lambda x: torch.tensor(x, dtype=dtype, device=device)  # noqa: E731
    position = tensor(np.broadcast_to(guess.position, (len(readings), 3)))
    wxyz = tensor(np.broadcast_to(guess.wxyz, (len(readings), 4)))
    end = refine(
        TorchPlatform(platform, dtype).to(device), position, quaternion_to_matrix(wxyz),
        tensor(readings), gamma=gamma, f_max=f_max, z_max=z_max, scaled=scaled,
    )  # fmt: skip
    array = lambda x: x.cpu().numpy()  # noqa: E731
    return BatchedSolution(
        Pose.from_rotation(array(end.position.double()), array(end.rotation.double())),
        array(end.outcome), array(end.iterations), array(end.inverse_iterations),
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
    """As `batched_newton`, for tensors on any device: (N, 3), (N, 3, 3) and (N, 6).

    Where legs or the platform's joints (`TorchPlatform.with_joints`) require gradients, the poses
    of converged rows carry them; see `implicit_pose`.
    """
    if not gamma > 0 or f_max < 0 or z_max < 0:
        raise GoughError(
            f"gamma, f_max, z_max: expected above 0, 0 or more and 0 or more, found {gamma}, "
            f"{f_max}, {z_max}"
        )
    with torch.no_grad():
        end = _sweep(
            platform, _Rows(platform, position, rotation, legs), gamma, f_max, z_max, scaled
        )
    converged = end.outcome == NewtonStatus.CONVERGED
    position, rotation = implicit_pose(platform, end.position, end.rotation, legs, converged)
    return replace(end, position=position, rotation=rotation)


def _sweep(platform: TorchPlatform, rows: _Rows, gamma: float, f_max: int, z_max: int,
           scaled: bool) -> Refined:  # fmt: skip
    size = platform.platform.size
    reach = FAR * (size + float(np.linalg.norm(platform.platform.home.position)))
    units = rows.xi.new_tensor([1, 1, 1, size, size, size] if scaled else [1] * 6)
    sweeps = 0
    while len(rows.left) and sweeps < z_max:
        sweeps += 1
        errors, J = rows.equations()
        found = approximate_inverse(J / units, f_max)
        step = (found.Z @ errors[..., None])[..., 0] / units
        regular = found.error < REGULAR  # not so where it is NaN
        rows.move(step, found.iterations, regular, gamma, reach)
    return rows.end(sweeps)


class _Rows:
    """The batch on its way: `left` are the rows that still move."""

    def __init__(self, platform: TorchPlatform, position: Tensor, rotation: Tensor,
                 legs: Tensor) -> None:  # fmt: skip
        count, device = len(legs), legs.device
        whole = lambda: torch.zeros(count, dtype=torch.int64, device=device)  # noqa: E731
        self.platform = platform
        self.starts, self.lengths = platform.equivalent_struts(legs)
        valid = legs.isfinite().all(-1) & (self.lengths > 0).all(-1)
        valid &= position.isfinite().all(-1) & rotation.isfinite().flatten(1).all(-1)
        eye = torch.eye(3, dtype=legs.dtype, device=device)
        t = torch.where(valid[:, None], position, 0)
        self.xi = se3.log(t, torch.where(valid[:, None, None], rotation, eye))
        self.outcome = torch.full(
            (count,), NewtonStatus.NOT_CONVERGED, dtype=torch.uint8, device=device
        )
        self.outcome[~valid] = NewtonStatus.INVALID_INPUT
        self.iterations, self.inverse_iterations = whole(), whole()
        self.step = legs.new_full((count,), torch.nan)
        self.left = valid.nonzero()[:, 0]

    def equations(self) -> tuple[Tensor, Tensor]:
        """F (n, 6) [unit] and dF/dxi (n, 6, 6) of the rows that are left."""
        xi, rows = self.xi[self.left], self.left
        position, rotation = se3.exp(xi)
        errors, J = self.platform.strut_errors(
            position, rotation, self.starts[rows], self.lengths[rows]
        )
        return errors, J @ se3.exp_jacobian(xi)

    def move(self, step: Tensor, inverse_iterations: Tensor, regular: Tensor, gamma: float,
             reach: float) -> None:  # fmt: skip
        """Take steps (n, 6) where the Jacobian is regular; rows that have ended leave the batch."""
        rows = self.left
        most = torch.maximum(self.inverse_iterations[rows], inverse_iterations)
        self.inverse_iterations[rows] = most
        self.outcome[rows[~regular]] = NewtonStatus.SINGULAR
        rows, step = rows[regular], step[regular]
        xi = self.xi[rows] - step
        near = torch.linalg.vector_norm(xi[:, :3], dim=-1) < reach  # not so where it is NaN
        self.outcome[rows[~near]] = NewtonStatus.DIVERGED
        rows, step, xi = rows[near], step[near], xi[near]
        beyond = torch.linalg.vector_norm(xi[:, 3:], dim=-1) > torch.pi
        if beyond.any():
            xi[beyond] = se3.shortest(xi[beyond])
        self.xi[rows] = xi
        self.iterations[rows] += 1
        self.step[rows] = step.abs().sum(-1)
        small = self.step[rows] < gamma
        self.outcome[rows[small]] = NewtonStatus.CONVERGED
        self.left = rows[~small]

    def end(self, sweeps: int) -> Refined:
        """Where all rows are now."""
        position, rotation = se3.exp(self.xi)
        invalid = self.outcome == NewtonStatus.INVALID_INPUT
        position[invalid], rotation[invalid] = torch.nan, torch.nan
        errors, _ = self.platform.strut_errors(position, rotation, self.starts, self.lengths)
        return Refined(
            position, rotation, self.outcome, self.iterations, self.inverse_iterations, self.step,
            errors.abs().amax(-1), sweeps,
        )  # fmt: skip
