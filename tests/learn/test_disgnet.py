"""DisGNet: its three forms, its norm, and what one 2-FWL step can express."""

from itertools import combinations
from typing import Any

import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from learn.networks import gradients, network, reference
from machines import random_platform

from gough import leg_lengths
from gough.learn.models import Scaling, build
from gough.learn.models.two_legs import Product


def small(platform, seed=0, **options):
    return network("disgnet", platform, seed, width=12, initial=1, bumps=8, **options)


@settings(max_examples=5)
@given(st.integers(0, 10**6))
def test_structured_equals_dense_to_rounding_with_gradients(seed):
    model = small(random_platform(seed), seed)
    torch.manual_seed(seed)
    x, weight = torch.randn(4, 6).double(), torch.randn(4, 12).double()
    out, grads = {}, {}
    for form in ("dense", "structured"):
        model.form = form
        out[form] = model.network(x)
        grads[form] = gradients(model, (out[form] * weight).sum())
    scale = out["dense"].abs().max()
    assert (out["dense"] - out["structured"]).abs().max() <= 1e-11 * scale
    for name, grad in grads["dense"].items():
        other = grads["structured"][name]
        assert (grad - other).abs().max() <= 1e-10 * max(1.0, grad.abs().max()), name


def test_structured_equals_dense_at_the_papers_size():
    model = network("disgnet", reference(), 3)
    assert model.parameter_count() <= 140_000
    x = torch.randn(2, 6).double()
    structured = model.network(x)
    model.form = "dense"
    torch.testing.assert_close(model.network(x), structured, rtol=1e-11, atol=1e-11)


@settings(max_examples=5)
@given(st.permutations(range(12)))
def test_permuting_nodes_with_their_numbers_changes_nothing(order):
    model = small(reference())
    order = torch.tensor(order)
    E = model.matrix(model.edges(torch.randn(2, 6).double()))
    straight = model.dense(E, torch.arange(12))
    permuted = model.dense(E[:, order][:, :, order], order)
    torch.testing.assert_close(permuted, straight, rtol=1e-11, atol=1e-11)


def test_dense_takes_any_graph():
    model = small(reference())
    E = torch.rand(2, 12, 12).double()
    assert model.dense(E + E.mT, torch.arange(12)).shape == (2, 12)


@torch.no_grad()
def test_tables_and_the_file_converge_to_the_exact_form_through_any_nodes():
    platform = reference()
    torch.manual_seed(0)  # as training starts; random weights of any size are less smooth
    model: Any = build("disgnet", platform, Scaling.of(platform))
    model.cast(torch.float64)
    legs = torch.tensor(leg_lengths(platform, platform.sample_poses(50, 5)))
    exact = model.eval().raw(legs)
    off = []
    for model.table in (6, 9, 12):
        raw = [model.finish(model.tabulated(model.normalised(legs), s)) for s in (0.1, 0.5, 0.9)]
        off.append(max(float((r - exact).abs().max() / exact.abs().max()) for r in raw))
    assert off[0] > 10 * off[1] > 100 * off[2]
    assert off[2] < 1e-4
    file = model.for_export().raw(legs)
    assert (file - exact).abs().max() < 1e-4 * exact.abs().max()
    model.train()
    model.table = 0
    torch.testing.assert_close(model.raw(legs), exact, rtol=1e-12, atol=1e-12)


@torch.no_grad()
def test_the_norm_gives_mean_0_and_deviation_1_over_all_pairs_and_the_range():
    model = small(reference())
    angle = torch.rand(4000, 6).double() * torch.pi  # the cosine has the weight 1 / sqrt(1 - y^2)
    edges = model.edges(model.range_middle + model.range_half * angle.cos())
    m = Product(model, edges, *model.norm_of(edges)).all()
    torch.testing.assert_close(m.mean((0, 1)), torch.zeros(12).double(), rtol=0, atol=0.03)
    torch.testing.assert_close(m.var((0, 1)), torch.ones(12).double(), rtol=0.06, atol=0)


def pooled_of(model):
    """Input of the readout as a function of one reading (6,)."""
    seen = []
    model.readout.register_forward_pre_hook(lambda module, args: seen.append(args[0].detach()))

    def pooled(x):
        model.network(x[None])
        return seen[-1][0]

    return pooled


@torch.no_grad()
def mixed_difference(function, x, moves):
    """Sum over all subsets of the moves, with alternating sign."""
    total = torch.zeros(())
    for count in range(len(moves) + 1):
        for chosen in combinations(moves, count):
            total = total + (-1) ** count * function(x + sum(chosen, torch.zeros_like(x)))
    return total


def test_the_readout_is_a_sum_of_functions_of_two_legs_and_no_less():
    pooled = pooled_of(small(reference()))
    x, moves = torch.randn(6).double(), 0.7 * torch.eye(6).double()
    for i, j, k in ((0, 1, 2), (0, 3, 5), (1, 2, 4)):
        assert mixed_difference(pooled, x, [moves[i], moves[j], moves[k]]).abs().max() < 1e-12
        assert mixed_difference(pooled, x, [moves[i], moves[j]]).abs().max() > 1e-8


def test_its_constants_are_kept_with_its_weights():
    model, other = small(reference(), 1), small(reference(), 2)
    other.load_state_dict(model.state_dict())
    x = torch.randn(3, 6).double()
    assert torch.equal(model.network(x), other.network(x))
