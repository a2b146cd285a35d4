import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from learn.networks import gradients, network, reference
from machines import random_platform

from gough import leg_lengths


@settings(max_examples=10)
@given(st.integers(0, 10**6))
def test_structured_equals_dense_to_rounding_with_gradients(seed):
    platform = random_platform(seed)
    model = network("disgnet-linear", platform, seed, width=24)
    torch.manual_seed(seed)
    x, weight = torch.randn(7, 6).double(), torch.randn(7, 12).double()
    x.requires_grad_()
    out, grads, into = {}, {}, {}
    for form in ("dense", "structured"):
        model.form = form
        out[form] = model.network(x)
        grads[form] = gradients(model, (out[form] * weight).sum())
        into[form], x.grad = torch.as_tensor(x.grad).clone(), None
    scale = out["dense"].abs().max()
    assert (out["dense"] - out["structured"]).abs().max() <= 1e-12 * scale
    assert (into["dense"] - into["structured"]).abs().max() <= 1e-12 * into["dense"].abs().max()
    for name, grad in grads["dense"].items():
        assert (grad - grads["structured"][name]).abs().max() <= 1e-12 * max(
            1.0, grad.abs().max()
        ), name


def test_structured_equals_dense_at_the_published_size():
    model = network("disgnet-linear", reference(), 3)
    x = torch.randn(3, 6).double()
    structured = model.network(x)
    model.form = "dense"
    torch.testing.assert_close(model.network(x), structured, rtol=1e-12, atol=1e-12)


@settings(max_examples=10)
@given(st.permutations(range(12)))
def test_permuting_nodes_with_their_numbers_changes_nothing(order):
    model = network("disgnet-linear", reference(), width=16)
    order = torch.tensor(order)
    E = model.matrix(model.edges(torch.randn(4, 6).double()))
    straight = model.dense(E, torch.arange(12))
    permuted = model.dense(E[:, order][:, :, order], order)
    torch.testing.assert_close(permuted, straight, rtol=1e-12, atol=1e-12)
    if order.tolist() != list(range(12)):  # the numbers matter
        wrong = model.dense(E[:, order][:, :, order], torch.arange(12))
        assert (wrong - straight).abs().max() > 1e-6


def test_dense_takes_any_graph():
    model = network("disgnet-linear", reference(), width=16)
    E = torch.rand(2, 12, 12).double()
    E = E + E.mT
    assert model.dense(E, torch.arange(12)).shape == (2, 12)


def test_what_is_read_out_is_a_sum_of_functions_of_single_legs():
    """Why the head alone has to learn how legs act together; see the module's docstring."""
    model = network("disgnet-linear", reference(), width=16)
    seen = []
    model.readout.register_forward_pre_hook(lambda module, args: seen.append(args[0].detach()))

    def pooled(x):
        model.network(x[None])
        return seen[-1][0]

    x = torch.randn(6).double()
    moves = 0.7 * torch.eye(6).double()
    for i, j in ((0, 1), (1, 2), (0, 5), (2, 4)):
        mixed = pooled(x + moves[i] + moves[j]) - pooled(x + moves[i]) - pooled(x + moves[j])
        mixed += pooled(x)
        assert mixed.abs().max() < 1e-12
        assert (pooled(x + moves[i]) - pooled(x)).abs().max() > 1e-3


@pytest.mark.parametrize("form", ["dense", "structured"])
def test_matrix_is_that_of_the_graph(form):
    model = network("disgnet-linear", reference(), width=16, form=form)
    E = model.matrix(model.edges(torch.zeros(1, 6).double()))[0]
    assert torch.equal(E, E.mT)
    np.testing.assert_array_equal(E.numpy() > 0, model.graph.adjacency)


def test_tables_agree_with_the_exact_form():
    platform = reference()
    model = network("disgnet-linear", platform)
    legs = torch.tensor(leg_lengths(platform, platform.sample_poses(200, 5)))
    exact = model.raw(legs)
    model.train()
    assert (model.raw(legs) - exact).abs().max() < 1e-4 * exact.abs().max()
    model.table = 256
    assert (model.raw(legs) - exact).abs().max() < 1e-8 * exact.abs().max()
    model.table = 0
    torch.testing.assert_close(model.raw(legs), exact, rtol=1e-12, atol=1e-12)
