import numpy as np
import pytest
import torch
from learn.networks import reference
from machines import with_some_workspace

from gough import GoughError, Platform, Pose, assembly_sign, leg_lengths, quaternion
from gough.learn.kinematics import TorchPlatform, euler_to_matrix
from gough.learn.sampling import Stream


def as_pose(platform, batch) -> Pose:
    rotation = Pose.from_rotation(np.zeros(3), batch.rotation.numpy())
    return Pose(
        platform.home.position + batch.translation.numpy(),
        quaternion.product(platform.home.wxyz, rotation.wxyz),
    )


@pytest.mark.parametrize("name", Platform.catalog())
def test_readings_are_those_of_the_kinematics(name):
    platform = with_some_workspace(Platform.load(name))
    batch = Stream(platform).batch(50, 0)
    pose = as_pose(platform, batch)
    np.testing.assert_allclose(
        batch.legs, leg_lengths(platform, pose), rtol=1e-12, atol=1e-12 * platform.size
    )
    assert platform.in_workspace(pose).all()
    machine = TorchPlatform(platform)
    sign = machine.assembly_sign(*machine.from_home(batch.translation, batch.rotation))
    np.testing.assert_array_equal(sign, assembly_sign(platform, pose))


def test_a_batch_depends_on_its_key_alone():
    stream = Stream(reference())
    first = stream.batch(100, 7, 0, 3)
    stream.batch(10, 7, 0, 4)
    again = Stream(reference()).batch(100, 7, 0, 3)
    assert torch.equal(first.legs, again.legs)
    for other in ((7, 0, 4), (7, 1, 3), (8, 0, 3), (7, 3, 0), (3, 0, 7), (7, 0, 3, 0)):
        assert not torch.equal(first.legs, stream.batch(100, *other).legs)


def test_poses_fill_the_box_evenly():
    batch = Stream(reference()).batch(40_000, 1)
    for numbers, reach in ((batch.translation, 50.0), (euler_of(batch.rotation), np.radians(30))):
        assert numbers.abs().max() <= reach + 1e-12
        np.testing.assert_allclose(numbers.mean(0), 0, atol=0.02 * reach)
        np.testing.assert_allclose(numbers.std(0), reach / 3**0.5, rtol=0.02)


def euler_of(turn):
    return torch.tensor(Pose.from_rotation(np.zeros(3), turn.numpy()).euler)


def test_same_assembly_leaves_out_what_lies_beyond_a_singularity():
    wide = reference().with_workspace(100, 60)
    everything = Stream(wide).batch(2000, 0)
    kept = Stream(wide, same_assembly=True).batch(2000, 0)
    signs = assembly_sign(wide, as_pose(wide, everything))
    assert 0.1 < np.mean(signs < 0) < 0.4
    assert (assembly_sign(wide, as_pose(wide, kept)) > 0).all()
    assert len(kept) == 2000


def test_an_unreachable_workspace_is_an_error_not_an_endless_loop(monkeypatch):
    stream = Stream(reference(), same_assembly=True)
    monkeypatch.setattr(stream, "_good", lambda drawn: torch.zeros(len(drawn), dtype=torch.bool))
    with pytest.raises(GoughError, match="smaller workspace"):
        stream.batch(10, 0)


def test_a_platform_without_workspace_says_so():
    platform = Platform(reference().base, reference().moving, home=(0, 0, 600))
    with pytest.raises(GoughError, match=r"\[workspace\]"):
        Stream(platform)


def test_rotation_formulas_agree_with_pose():
    rng = np.random.default_rng(0)
    angles = rng.uniform(-1.5, 1.5, (50, 3))
    pose = Pose.from_euler(np.zeros(3), angles)
    np.testing.assert_allclose(euler_to_matrix(torch.tensor(angles)), pose.rotation, atol=1e-14)
