"""Iterations of the DisGNet paper's inverse, and the effect of its stopping rule.

    python tools/inverse_study.py                                   the tables of docs/gpu_newton.md
    python tools/inverse_study.py docs/images/inverse_iterations.svg      its figure

Needs PyTorch, the figure matplotlib; a minute on one core.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from math import log
from unittest.mock import patch

import numpy as np
import torch
from torch import Tensor

from gough import Platform, Pose, leg_lengths
from gough.learn.kinematics import TorchPlatform, se3_exp, se3_exp_jacobian
from gough.learn.newton import (
    REGULAR,
    approximate_inverse,
    batched_newton,
    first_inverse,
    next_inverse,
)

F_MAX = 20
ENOUGH = torch.finfo(torch.float64).eps ** 0.5
COUNT = 10_000
WIDE = (100.0, 60.0)  # [mm], [deg]
GAMMAS = (1e-2, 1e-3, 1e-4)
BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#555555"  # Okabe and Ito


# ---- Jacobians ------------------------------------------------------------------------


class Problem:
    """F and dF/dxi for the readings of poses, in the paper's coordinates."""

    def __init__(self, platform: Platform, truth: Pose) -> None:
        self.facts = TorchPlatform(platform)
        legs = torch.tensor(leg_lengths(platform, truth))
        self.struts = self.facts.equivalent_struts(legs)

    def __call__(self, xi: Tensor) -> tuple[Tensor, Tensor]:
        errors, J = self.facts.strut_errors(*se3_exp(xi), *self.struts)
        return errors, J @ se3_exp_jacobian(xi)


def jacobians(platform: Platform, count: int = COUNT, scaled: bool = False) -> Tensor:
    """dF/dxi (count, 6, 6) at poses of the workspace."""
    poses = with_workspace(platform).sample_poses(count, seed=1)
    J = Problem(platform, poses)(torch.tensor(poses.log()))[1]
    return J / torch.tensor([1.0] * 3 + [platform.size] * 3) if scaled else J


def with_workspace(platform: Platform) -> Platform:
    """Itself, or with a small workspace where it states none."""
    return platform if platform.workspace else platform.with_workspace(0.02 * platform.size, 5)


def random_jacobians(count: int, seed: int = 0) -> Tensor:
    """Matrices (count, 6, 6) with condition numbers from 1 to 1e7 and evenly drawn directions."""
    rng = np.random.default_rng(seed)
    u, v = (np.linalg.qr(rng.standard_normal((count, 6, 6)))[0] for _ in range(2))
    lowest = -rng.uniform(0, 7, count)
    s = 10 ** np.sort(rng.uniform(0, 1, (count, 6)) * lowest[:, None], axis=1)
    s[:, 0], s[:, -1] = 10**lowest, 1.0
    return torch.tensor(u * s[:, None] @ v)


def condition(J: Tensor) -> Tensor:
    """Largest over smallest singular value, (N,)."""
    s = torch.linalg.svdvals(J)
    return s[:, 0] / s[:, -1]


def predicted(weakest: float) -> int:
    """Iterations until e is below sqrt(eps), e <- (3 e^3 + e^4) / 4 from e = 1 - weakest.

    In terms of 1 - e, so that no digit of a small one is lost.
    """
    count, rest = 0, weakest
    while 1 - rest > ENOUGH:
        rest = rest * (13 - rest * (15 - rest * (7 - rest))) / 4
        count += 1
    return count


# ---- tables ---------------------------------------------------------------------------


def table(name: str, platform: Platform) -> None:
    """One machine: condition, iterations, what fails, in the paper's units and scaled."""
    for scaled in (False, True):
        J = jacobians(platform, scaled=scaled)
        kappa, found = condition(J), approximate_inverse(J, 60)
        at_most = approximate_inverse(J, F_MAX)
        first = torch.eye(6) - J @ first_inverse(J)
        frobenius = torch.linalg.matrix_norm(first).amin()
        spectral = torch.linalg.matrix_norm(first, 2).amax()
        more = (found.iterations > F_MAX).double().mean()
        lost = (at_most.error >= REGULAR).double().mean()
        print(
            f"{name:24} {'scaled' if scaled else 'plain':7} {float(kappa.median()):9.0f} "
            f"{float(kappa.amax()):9.2g} {int(found.iterations.median()):5} "
            f"{int(found.iterations.amax()):5} {float(more):8.2%} {float(lost):8.2%} "
            f"{float(frobenius):8.3f} {float(1 - spectral):9.1e}"
        )


# ---- the paper's rule -----------------------------------------------------------------


def last_allowed(J: Tensor) -> Tensor:
    """Algorithm 1 to the letter: the last Z whose |JZ - JZ_0|_F averages below 1."""
    Z = kept = first_inverse(J)
    start = J @ Z
    for _ in range(F_MAX):
        Z = next_inverse(Z, J @ Z)
        if torch.linalg.matrix_norm(J @ Z - start).mean() < 1:
            kept = Z
    return kept


def first_allowed(J: Tensor) -> Tensor:
    """The other reading: the first such Z, where the inner loop then ends."""
    Z = first_inverse(J)
    start = J @ Z
    for _ in range(F_MAX):
        Z = next_inverse(Z, J @ Z)
        if torch.linalg.matrix_norm(J @ Z - start).mean() < 1:
            break
    return Z


def fully(J: Tensor) -> Tensor:
    """All f_max iterations."""
    return approximate_inverse(J, F_MAX).Z


def sweeps(name: str, inverse: Callable[[Tensor], Tensor], count: int = 1000) -> None:
    """Sweeps until |step|_1 < gamma in all rows, and how far the poses then are from true ones."""
    platform = Platform.load("reference")
    truth = platform.sample_poses(count, seed=1)
    rng = np.random.default_rng(0)  # guesses about as good as the paper's network gives them
    turn = Pose.from_rotation_vector(np.zeros(3), np.radians(0.3) * rng.standard_normal((count, 3)))
    guess = Pose(truth.position + 0.5 * rng.standard_normal((count, 3)), (truth @ turn).wxyz)
    problem, xi = Problem(platform, truth), torch.tensor(guess.log())
    reached = dict.fromkeys(GAMMAS, "over 100")
    away = dict.fromkeys(GAMMAS, np.nan)
    for z in range(1, 101):
        errors, J = problem(xi)
        step = (inverse(J) @ errors[..., None])[..., 0]
        xi = xi - step
        for gamma in GAMMAS:
            if reached[gamma] == "over 100" and float(step.abs().sum(-1).amax()) < gamma:
                reached[gamma] = str(z)
                away[gamma] = float(np.median(Pose.exp(xi.numpy()).distance(truth)[0]))
    found = "".join(f"{reached[g]:>10} {away[g]:9.1e}" for g in GAMMAS)
    print(f"{name:24} {found}")


def wild_guesses(count: int = 10_000) -> tuple[float, float]:
    """Shares of rows that converge from guesses turned by up to half a turn about any axis.

    First as it is; then with rotation vectors left as long as the steps make them.
    """
    platform, rng = Platform.load("reference"), np.random.default_rng(0)
    truth = platform.with_workspace(*WIDE).sample_poses(count, seed=3)
    axis = rng.standard_normal((count, 3))
    turn = rng.uniform(0, np.pi, (count, 1)) * axis / np.linalg.norm(axis, axis=1, keepdims=True)
    shift = 100 * rng.standard_normal((count, 3))
    guess = Pose.from_rotation_vector(truth.position + shift, turn)
    legs = leg_lengths(platform, truth)
    kept = batched_newton(platform, guess, legs, f_max=60).converged.mean()
    with patch("gough.learn.newton.se3_shortest", lambda xi: xi):
        return float(kept), float(batched_newton(platform, guess, legs, f_max=60).converged.mean())


# ---- figure ---------------------------------------------------------------------------


def draw(path: str) -> None:
    """Iterations against condition number: random matrices, a machine's, the formula."""
    import matplotlib
    from matplotlib.figure import Figure

    reference = Platform.load("reference")
    wide = reference.with_workspace(*WIDE)
    figure = Figure(figsize=(7.2, 4.4), layout="constrained")
    axes = figure.subplots()
    groups = (
        ("random matrices", random_jacobians(4000), GREY, "."),
        ("reference, ±100 mm, ±60°, mm", jacobians(wide, 1500), ORANGE, "^"),
        ("reference, ±50 mm, ±30°, mm", jacobians(reference, 400), BLUE, "o"),
        ("the same, scaled", jacobians(reference, 400, scaled=True), GREEN, "s"),
    )
    for label, J, colour, marker in groups:
        count = approximate_inverse(J, 60).iterations
        axes.plot(condition(J), count, marker, color=colour, markersize=3, alpha=0.5,
                  linestyle="none", label=label, rasterized=True)  # fmt: skip
    kappa = np.logspace(0, 7, 400)
    for share, style in ((1.0, "-"), (6.0, "--")):
        steps = [predicted(1 / (share * k * k)) for k in kappa]
        axes.plot(kappa, steps, style, color="black", linewidth=1,
                  label=f"formula, |J|₁|J|∞ = {'6 ' if share > 1 else ''}σ²")  # fmt: skip
    axes.axhline(F_MAX, color=GREY, linewidth=1, linestyle=":")
    axes.text(1.3, F_MAX + 0.4, "the paper's f_max = 20", color=GREY, fontsize=9)
    axes.set(
        xscale="log", xlim=(1, 1e7), ylim=(0, 36), xlabel="condition number of dF/dξ",
        ylabel="iterations until |I − JZ| < 1.5e-8",
    )  # fmt: skip
    axes.grid(linewidth=0.3)
    axes.legend(fontsize=8, loc="lower right", markerscale=2)
    with matplotlib.rc_context({"svg.hashsalt": "gough"}):
        figure.savefig(path, dpi=200, metadata={"Date": None} if path.endswith("svg") else None)


def main() -> None:
    """The tables, or the figure where a path is given."""
    torch.set_num_threads(1)
    torch.set_default_dtype(torch.float64)
    if len(sys.argv) > 1:
        draw(sys.argv[1])
        return
    print("iterations of e <- (3 e^3 + e^4) / 4 from e = 1 - d, less log(1/d) / log(13/4):")
    print(*(f"  {predicted(d) - log(1 / d) / log(13 / 4):.1f}" for d in (1e-3, 1e-6, 1e-9, 1e-12)))
    print(f"{'machine':24} {'units':7} {'cond med':>9} {'max':>9} {'iter':>5} {'max':>5} "
          f"{'over 20':>8} {'lost':>8} {'least F':>8} {'1 - |E0|2':>9}")  # fmt: skip
    for name in Platform.catalog():
        table(name, Platform.load(name))
    table("reference +-100, +-60", Platform.load("reference").with_workspace(*WIDE))
    print("\nsweeps until all of 1000 rows step below gamma; median distance from the truth [mm]")
    print(f"{'inverse':24} " + "".join(f"{g:>10} {'away':>9}" for g in GAMMAS))
    sweeps("to rounding", fully)
    sweeps("last with average < 1", last_allowed)
    sweeps("first with average < 1", first_allowed)
    kept, long = wild_guesses()
    print(f"\nfrom wild guesses {kept:.1%} converge, {long:.1%} if |w| may grow beyond pi")


if __name__ == "__main__":
    main()
