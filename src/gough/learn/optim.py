"""The optimiser SOAP, and the schedule: how far a run is and which learning rate it has there.

SOAP is Adam in the eigenbasis of Shampoo's preconditioner (Vyas et al., SOAP: Improving and
Stabilizing Shampoo using Adam (2024), algorithm 3). The bases are refreshed by one step of
orthogonal iteration, which is cheap for matrices of this size; vectors (biases, gains) get plain
Adam.

Libraries were compared on `resmlp` of the reference platform (batch 500, one thread, one run each):
after 600 steps E-trans was 0.147 mm with this one and 0.137 mm with pytorch-optimizer 4.1; after
20 s of processor time 0.063 mm (927 steps) and 0.078 mm (830 steps); heavyball 3.2 first compiles
kernels, which takes longer than a short run. As good within the noise, but slower: this one stays,
and its state is plain tensors, which a checkpoint without pickle can hold.
"""

from __future__ import annotations

import time
from typing import Protocol

import torch
from torch import Tensor, nn
from torch.optim import Optimizer

from gough.learn.config import OptimiserConfig, RunConfig, seconds

RESERVE = 0.03  # share of a budget kept for the last checkpoint and the export,
MOST_RESERVED = 10.0  # but at most this [s]
LONGEST_WARMUP = 0.05  # share of a run after which the rate has risen, however few its steps
SIDES = ("left", "right")


def make_optimiser(config: OptimiserConfig, model: nn.Module) -> Optimizer:
    """Create the optimiser that a configuration names."""
    parameters, lr, decay = model.parameters(), config.lr, config.weight_decay
    if config.kind == "soap":
        return SOAP(parameters, lr=lr, weight_decay=decay, refresh=config.refresh)
    kind = {"adam": torch.optim.Adam, "adamw": torch.optim.AdamW}[config.kind]
    return kind(parameters, lr=lr, weight_decay=decay)


class SOAP(Optimizer):
    """SOAP for parameters with at most two axes.

    Args:
        params: parameters to optimise.
        lr: step size.
        betas: decay of the gradient's mean and of its square in the eigenbasis.
        shampoo_beta: decay of the two factors G G^T and G^T G.
        eps: added to the root of the squares.
        weight_decay: decoupled, times lr.
        refresh: steps between refreshes of the eigenbases.
        largest: axes longer than this keep the identity as their basis.
    """

    def __init__(self, params, lr=2e-3, betas=(0.95, 0.99), shampoo_beta=0.99, eps=1e-10,
                 weight_decay=0.0, refresh=10, largest=1024) -> None:  # fmt: skip
        options = {"lr": lr, "betas": betas, "shampoo_beta": shampoo_beta, "eps": eps}
        options |= {"weight_decay": weight_decay, "refresh": refresh, "largest": largest}
        super().__init__(params, options)

    @torch.no_grad()
    def step(self, closure=None):  # pyright: ignore[reportIncompatibleMethodOverride]
        loss = None
        if closure is not None:
            with torch.enable_grad():
                loss = closure()
        for group in self.param_groups:
            for p in group["params"]:
                if p.grad is not None:
                    _update(p, p.grad, self.state[p], group)
        return loss


def _update(p: Tensor, grad: Tensor, state: dict, group: dict) -> None:
    if not state:
        _start(grad, state, group)
    state["step"] += 1
    beta1, beta2 = group["betas"]
    rotated = _into_basis(grad, state)
    state["mean"].lerp_(grad, 1 - beta1)
    state["square"].lerp_(rotated.square(), 1 - beta2)
    unbias = (1 - beta2 ** state["step"]) ** 0.5 / (1 - beta1 ** state["step"])
    move = _into_basis(state["mean"], state) / (state["square"].sqrt() + group["eps"])
    p.mul_(1 - group["lr"] * group["weight_decay"])
    p.add_(_out_of_basis(move, state), alpha=-group["lr"] * unbias)
    _accumulate(grad, state, group["shampoo_beta"])
    if state["step"] % group["refresh"] == 0:
        _refresh(state)


def _start(grad: Tensor, state: dict, group: dict) -> None:
    state["step"] = 0
    state["mean"], state["square"] = torch.zeros_like(grad), torch.zeros_like(grad)
    if grad.ndim != 2:
        return
    for side, size in zip(SIDES, grad.shape, strict=True):
        if 1 < size <= group["largest"]:
            state[side] = torch.zeros(size, size, dtype=grad.dtype, device=grad.device)
    _accumulate(grad, state, 0.0)
    for side in SIDES:
        if side in state:
            state[f"{side}_basis"] = torch.linalg.eigh(state[side])[1].flip(1).contiguous()


def _accumulate(grad: Tensor, state: dict, beta: float) -> None:
    """Update the factors G G^T and G^T G."""
    if "left" in state:
        state["left"].lerp_(grad @ grad.T, 1 - beta)
    if "right" in state:
        state["right"].lerp_(grad.T @ grad, 1 - beta)


def _refresh(state: dict) -> None:
    """Improve the bases by one step of orthogonal iteration, largest eigenvalues first."""
    for axis, side in enumerate(SIDES):
        if side not in state:
            continue
        factor, basis = state[side], state[f"{side}_basis"]
        strength = (basis * (factor @ basis)).sum(0)  # Rayleigh quotients
        order = torch.argsort(strength, descending=True)
        state["square"].copy_(state["square"].index_select(axis, order))
        state[f"{side}_basis"] = torch.linalg.qr(factor @ basis[:, order])[0].contiguous()


def _into_basis(g: Tensor, state: dict) -> Tensor:
    if "left_basis" in state:
        g = state["left_basis"].T @ g
    return g @ state["right_basis"] if "right_basis" in state else g


def _out_of_basis(g: Tensor, state: dict) -> Tensor:
    if "left_basis" in state:
        g = state["left_basis"] @ g
    return g @ state["right_basis"].T if "right_basis" in state else g


# ---- schedule -----------------------------------------------------------------------------


def learning_rate(config: OptimiserConfig, step: int, progress: float) -> float:
    """Learning rate of step number `step`, counted from 0, at `progress` (0 to 1) of the run."""
    rate = config.lr
    if config.warmup:
        rate *= min(1.0, max((step + 1) / config.warmup, progress / LONGEST_WARMUP))
    if config.schedule == "falling" and progress > config.hold:
        rate *= max(0.0, (1 - progress) / (1 - config.hold)) ** config.power
    return rate


class RunLength(Protocol):
    """Settings that state the length of a run."""

    @property
    def run(self) -> RunConfig:
        """Budget and clock."""
        ...

    def total_steps(self) -> int | None:
        """Steps of the run, None under a budget."""
        ...


class Clock:
    """Progress by steps, or by time under a budget.

    Time is counted step by step, and no step counts for more than 20 typical ones (at least a
    second): a machine that slept, or a process that was stopped, loses no training time.

    Attributes:
        elapsed: time trained so far, over all resumptions, by the configuration's clock [s].
    """

    def __init__(self, config: RunLength) -> None:
        self.total = config.total_steps()
        self.budget = None
        if self.total is None:
            whole = seconds(config.run.budget or "10m")
            self.budget = whole - min(RESERVE * whole, MOST_RESERVED)
        self.elapsed = 0.0
        self._now = time.process_time if config.run.clock == "processor" else time.monotonic
        self._typical = 0.0
        self._last = self._now()

    def progress(self, step: int) -> float:
        """Share of the run that is done after `step` steps, 1 at its end."""
        if self.total is not None:
            return min(1.0, step / self.total)
        assert self.budget is not None
        return min(1.0, self.elapsed / self.budget)

    def remaining(self, step: int) -> float:
        """Estimated time left [s]."""
        done = self.progress(step)
        return self.elapsed * (1 - done) / done if done > 0 else float("nan")

    def tick(self) -> None:
        """Count the time since the last call."""
        now = self._now()
        passed = now - self._last
        self._last = now
        self.elapsed += min(passed, max(1.0, 20 * self._typical)) if self._typical else passed
        self._typical += 0.05 * (min(passed, 20 * self._typical or passed) - self._typical)
