"""SOAP: Adam in the eigenbasis of Shampoo's preconditioner, for small networks.

Source: Vyas et al., SOAP: Improving and Stabilizing Shampoo using Adam (2024), algorithm 3.
The bases are refreshed by one step of orthogonal iteration, which is cheap for matrices
of this size; vectors (biases, gains) get plain Adam.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.optim import Optimizer


class SOAP(Optimizer):
    """SOAP for parameters with at most two axes.

    Args:
        lr: step size.
        betas: decay of the gradient's mean and of its square in the eigenbasis.
        shampoo_beta: decay of the two factors G G^T and G^T G.
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
    rotated = _rotate(grad, state)
    state["mean"].lerp_(grad, 1 - beta1)
    state["square"].lerp_(rotated.square(), 1 - beta2)
    unbias = (1 - beta2 ** state["step"]) ** 0.5 / (1 - beta1 ** state["step"])
    move = _rotate(state["mean"], state) / (state["square"].sqrt() + group["eps"])
    p.mul_(1 - group["lr"] * group["weight_decay"])
    p.add_(_rotate_back(move, state), alpha=-group["lr"] * unbias)
    _learn_basis(grad, state, group)


def _start(grad: Tensor, state: dict, group: dict) -> None:
    state["step"] = 0
    state["mean"], state["square"] = torch.zeros_like(grad), torch.zeros_like(grad)
    if grad.ndim != 2:
        return
    for side, size in (("left", grad.shape[0]), ("right", grad.shape[1])):
        if 1 < size <= group["largest"]:
            state[side] = torch.zeros(size, size, dtype=grad.dtype, device=grad.device)
    _accumulate(grad, state, 0.0)
    for side in ("left", "right"):
        if side in state:
            state[f"{side}_basis"] = torch.linalg.eigh(state[side])[1].flip(1).contiguous()


def _accumulate(grad: Tensor, state: dict, beta: float) -> None:
    if "left" in state:
        state["left"].lerp_(grad @ grad.T, 1 - beta)
    if "right" in state:
        state["right"].lerp_(grad.T @ grad, 1 - beta)


def _learn_basis(grad: Tensor, state: dict, group: dict) -> None:
    _accumulate(grad, state, group["shampoo_beta"])
    if state["step"] % group["refresh"]:
        return
    for side, axis in (("left", 0), ("right", 1)):
        if side not in state:
            continue
        factor, basis = state[side], state[f"{side}_basis"]
        strength = (basis * (factor @ basis)).sum(0)  # Rayleigh quotients
        order = torch.argsort(strength, descending=True)
        state["square"].copy_(state["square"].index_select(axis, order))
        state[f"{side}_basis"] = torch.linalg.qr(factor @ basis[:, order])[0].contiguous()


def _rotate(g: Tensor, state: dict) -> Tensor:
    """Into the eigenbasis."""
    if "left_basis" in state:
        g = state["left_basis"].T @ g
    return g @ state["right_basis"] if "right_basis" in state else g


def _rotate_back(g: Tensor, state: dict) -> Tensor:
    if "left_basis" in state:
        g = state["left_basis"] @ g
    return g @ state["right_basis"].T if "right_basis" in state else g
