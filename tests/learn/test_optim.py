import copy

import pytest
import torch
from torch import nn

from gough.learn.optim import SOAP


def stretched(optimiser_of, steps=300, lr=0.05):
    """Loss after fitting a badly conditioned linear map."""
    torch.manual_seed(0)
    x = torch.randn(256, 8).double() * torch.logspace(0, -2, 8).double()
    x = x @ torch.linalg.qr(torch.randn(8, 8).double())[0]
    y = x @ torch.linalg.pinv(x) @ torch.randn(256, 3).double()
    model = nn.Linear(8, 3).double()
    optimiser = optimiser_of(model.parameters(), lr)
    loss = torch.zeros(())
    for step in range(steps):
        for group in optimiser.param_groups:
            group["lr"] = lr * (1 - step / steps)
        optimiser.zero_grad()
        loss = (model(x) - y).square().mean()
        loss.backward()
        optimiser.step()
    return float(loss.detach())


def test_soap_beats_adam_where_the_axes_are_hidden():
    adam = stretched(lambda p, lr: torch.optim.Adam(p, lr))
    soap = stretched(lambda p, lr: SOAP(p, lr))
    assert soap < adam / 10


def test_vectors_and_scalars_get_adam():
    torch.manual_seed(0)
    start = torch.randn(5)
    a, b = nn.Parameter(start.clone()), nn.Parameter(start.clone())
    mine = SOAP([a], lr=0.01, betas=(0.9, 0.99), eps=1e-8)
    theirs = torch.optim.Adam([b], lr=0.01, betas=(0.9, 0.99), eps=1e-8)
    for _ in range(20):
        for p, optimiser in ((a, mine), (b, theirs)):
            p.grad = p.detach() ** 3 - 1
            optimiser.step()
    torch.testing.assert_close(a, b, rtol=1e-4, atol=1e-6)


def test_bases_stay_orthonormal():
    torch.manual_seed(0)
    p = nn.Parameter(torch.randn(6, 4).double())
    optimiser = SOAP([p], lr=0.01)
    for _ in range(35):
        p.grad = torch.randn(6, 4).double()
        optimiser.step()
    for side, size in (("left", 6), ("right", 4)):
        basis = optimiser.state[p][f"{side}_basis"]
        torch.testing.assert_close(basis.T @ basis, torch.eye(size).double())


@pytest.mark.parametrize("steps", [5, 10, 13])
def test_its_state_can_be_saved(steps):
    torch.manual_seed(0)
    grads = torch.randn(30, 6, 4).double()

    def go(p, optimiser, part):
        for g in part:
            p.grad = g.clone()
            optimiser.step()

    p = nn.Parameter(torch.zeros(6, 4).double())
    optimiser = SOAP([p], lr=0.01)
    go(p, optimiser, grads[:steps])
    q = nn.Parameter(p.detach().clone())
    other = SOAP([q], lr=0.01)
    other.load_state_dict(copy.deepcopy(optimiser.state_dict()))
    go(p, optimiser, grads[steps:])
    go(q, other, grads[steps:])
    assert torch.equal(p, q)


def test_squares_stay_with_their_directions_when_these_change_places():
    p = nn.Parameter(torch.zeros(2, 1).double())
    optimiser = SOAP([p], lr=0.01, refresh=1)
    p.grad = torch.tensor([[1.0], [0.0]]).double()
    optimiser.step()
    state = optimiser.state[p]
    first = state["left_basis"][:, 0].abs().tolist()
    state["left"].copy_(torch.diag(torch.tensor([1.0, 4.0])))
    state["left_basis"].copy_(torch.eye(2))
    state["square"].copy_(torch.tensor([[1.0], [4.0]]))
    p.grad = torch.zeros(2, 1).double()
    optimiser.step()
    assert first == [1.0, 0.0]
    assert state["left_basis"][:, 0].abs().tolist() == [0.0, 1.0]
    assert state["square"][0] > state["square"][1]
