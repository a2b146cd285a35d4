import numpy as np
import pytest
import torch
from learn.networks import network, reference
from machines import random_platform, with_some_workspace

from gough import GoughError, Platform, leg_lengths
from gough.learn.loss import default_beta, pose_loss, training_loss
from gough.learn.models import MODELS, Scaling, build
from gough.learn.sampling import Stream

COUNTS = {
    "resmlp": 117_383, "disgnet": 129_228, "disgnet-linear": 132_780,
    "plain-mlp": 128_662, "wise-mlp": 120_076,
    "gcn": 130_000, "graphmlp": 350_000,
}  # fmt: skip


@pytest.mark.parametrize("kind", MODELS)
def test_parameter_counts_are_the_papers(kind):
    platform = reference()
    count = build(kind, platform, Scaling.of(platform)).parameter_count()
    assert count == pytest.approx(COUNTS[kind], rel=0.03)
    if kind != "graphmlp":
        assert round(count / 1e6, 2) <= 0.13


def test_the_best_network_is_no_larger_than_allowed():
    platform = reference()
    assert build("resmlp", platform, Scaling.of(platform)).parameter_count() <= 130_000


@pytest.mark.parametrize("kind", MODELS)
def test_networks_give_poses_and_start_near_home(kind):
    platform = random_platform(1)
    torch.manual_seed(0)
    model = build(kind, platform, Scaling.of(platform)).eval()
    legs = torch.tensor(leg_lengths(platform, platform.sample_poses(50, 3)))
    translation, R = model(legs)
    assert translation.shape == (50, 3)
    assert translation.dtype == R.dtype == torch.float64
    eye = torch.eye(3, dtype=torch.float64)
    torch.testing.assert_close(R @ R.mT, eye.expand_as(R), atol=1e-5, rtol=0)
    torch.testing.assert_close(torch.linalg.det(R), torch.ones(50).double(), atol=1e-5, rtol=0)
    angle = ((R.diagonal(dim1=1, dim2=2).sum(-1) - 1) / 2).clamp(-1, 1).acos()
    assert angle.max() < 1
    assert translation.abs().max() < 60


@pytest.mark.parametrize("kind", ["resmlp", "disgnet", "disgnet-linear", "gcn"])
@pytest.mark.parametrize("name", Platform.catalog())
def test_networks_take_every_kind_of_platform(kind, name):
    platform = with_some_workspace(Platform.load(name))
    model = network(kind, platform, width=8)
    batch = Stream(platform).batch(5, 0)
    loss = training_loss(model, batch.legs, batch, default_beta(platform))
    loss.backward()
    assert torch.isfinite(loss)
    assert all(torch.isfinite(p.grad).all() for p in model.parameters() if p.grad is not None)


def test_unknown_names_and_options_are_named():
    platform = reference()
    with pytest.raises(GoughError, match="resmlp, disgnet"):
        build("transformer", platform, Scaling.of(platform))
    with pytest.raises(GoughError, match="heads"):
        build("resmlp", platform, Scaling.of(platform), heads=3)


@pytest.mark.parametrize("scale", [1e-3, 1e3])
def test_the_unit_of_length_changes_nothing(scale):
    platform = reference()
    other = Platform(
        scale * platform.base, scale * platform.moving, home=scale * platform.home.position
    ).with_workspace(50 * scale, 30)
    legs = torch.tensor(leg_lengths(platform, platform.sample_poses(9, 3)))
    for kind in ("resmlp", "disgnet", "disgnet-linear"):
        a, b = network(kind, platform), network(kind, other)
        torch.testing.assert_close(a.raw(legs), b.raw(scale * legs), rtol=1e-9, atol=1e-9)
    assert default_beta(other) == pytest.approx(scale * default_beta(platform))


def test_the_loss_is_the_papers():
    batch = Stream(reference()).batch(3, 0)
    rotation = torch.eye(3, dtype=torch.float64).expand(3, 3, 3)
    translation = torch.zeros(3, 3, dtype=torch.float64)
    turned = np.linalg.norm(np.eye(3) - batch.rotation.numpy(), "fro", axis=(1, 2))
    expected = np.mean(np.linalg.norm(batch.translation.numpy(), axis=1) + 250 * turned)
    assert float(pose_loss(translation, rotation, batch, 250.0)) == pytest.approx(expected)
    assert float(pose_loss(batch.translation, batch.rotation, batch, 250.0)) == 0
