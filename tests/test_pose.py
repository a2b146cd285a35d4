"""Poses form the group SE(3): its axioms, its exponential, and agreement with SciPy."""

from __future__ import annotations

import numpy as np
import pytest
import support
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import RigidTransform, Rotation
from support import BATCHES, Floats, assert_same_pose

from gough import GoughError, Platform, Pose

ONE = Pose((1.0, 2.0, 3.0), (0.5, 0.5, -0.5, 0.5))


# ---- group ----------------------------------------------------------------------------


@given(support.pose_triples())
def test_product_is_associative(triple: tuple[Pose, Pose, Pose]) -> None:
    a, b, c = triple
    assert_same_pose((a @ b) @ c, a @ (b @ c))


@given(support.poses)
def test_identity_changes_nothing(pose: Pose) -> None:
    one = Pose.identity(pose.batch)
    assert one.batch == pose.batch
    assert_same_pose(one @ pose, pose)
    assert_same_pose(pose @ one, pose)


@given(support.poses)
def test_inverse_undoes(pose: Pose) -> None:
    one = Pose.identity(pose.batch)
    assert_same_pose(pose @ pose.inverse(), one)
    assert_same_pose(pose.inverse() @ pose, one)


@given(support.pose_triples())
def test_product_is_the_matrix_product_and_maps_points_in_turn(
    triple: tuple[Pose, Pose, Pose],
) -> None:
    a, b, c = triple
    product = a @ b
    assert product.batch == a.batch
    np.testing.assert_allclose(product.matrix, a.matrix @ b.matrix, atol=1e-14, rtol=1e-14)
    np.testing.assert_allclose(
        product.apply(c.position), a.apply(b.apply(c.position)), atol=1e-13, rtol=0
    )


@given(support.poses)
def test_rotations_are_rotations_and_quaternions_of_unit_length(pose: Pose) -> None:
    R = pose.rotation
    np.testing.assert_allclose(R @ np.swapaxes(R, -1, -2), np.broadcast_to(np.eye(3), R.shape),
                               atol=4e-15)  # fmt: skip
    np.testing.assert_allclose(np.linalg.det(R), 1.0, atol=1e-14)
    np.testing.assert_allclose(np.linalg.norm(pose.wxyz, axis=-1), 1.0, rtol=1e-15)


@pytest.mark.parametrize("length", [1e-50, 0.5, 1 - 1e-10, 1 + 1e-10, 1e50])
def test_quaternions_of_any_length_are_brought_to_one(length: float) -> None:
    pose = Pose(np.zeros(3), length * ONE.wxyz)
    np.testing.assert_allclose(pose.wxyz, ONE.wxyz, rtol=4e-16)


@given(support.poses)
def test_making_a_pose_from_its_own_parts_changes_no_bit(pose: Pose) -> None:
    again = Pose(pose.position, pose.wxyz)
    assert np.array_equal(again.wxyz, pose.wxyz)
    assert np.array_equal(again.position, pose.position)


@given(support.poses)
def test_a_quaternion_and_its_negative_are_one_rotation(pose: Pose) -> None:
    other = Pose(pose.position, -pose.wxyz)
    assert_same_pose(other, pose, 4e-15)
    shift, turn = pose.distance(other)
    assert np.all(shift == 0)
    assert np.all(turn < 4e-15)
    np.testing.assert_allclose(np.cos(other.rotation_vector), np.cos(pose.rotation_vector),
                               atol=1e-14)  # fmt: skip


# ---- exp, log -------------------------------------------------------------------------


@given(support.poses)
def test_exp_undoes_log(pose: Pose) -> None:
    assert_same_pose(Pose.exp(pose.log()), pose)


@given(support.seeds, support.batches, support.angles)
def test_log_undoes_exp_up_to_half_a_turn(seed: int, batch: tuple[int, ...], angle: float) -> None:
    twist = support.random_twists(np.random.default_rng(seed), batch, min(angle, 3.1415))
    back = Pose.exp(twist).log()
    np.testing.assert_allclose(back, twist, rtol=0, atol=1e-12)
    small = np.abs(twist[..., 3:]).max(initial=0.0)
    np.testing.assert_allclose(back[..., 3:], twist[..., 3:], rtol=0, atol=1e-14 * small + 1e-300)


@given(support.seeds, support.angles | st.floats(np.pi, 20.0))
def test_exp_is_the_matrix_exponential(seed: int, angle: float) -> None:
    twist = support.random_twists(np.random.default_rng(seed), (3,), angle)
    for row, matrix in zip(twist, Pose.exp(twist).matrix, strict=True):
        np.testing.assert_allclose(matrix, expm(_hat(row)), rtol=0, atol=1e-12)


@given(support.seeds, st.floats(-9, -0.2).map(lambda digits: 10**digits))
def test_exp_and_log_keep_their_digits_where_formulas_switch_to_series(
    seed: int, angle: float
) -> None:
    """exp(x) = exp(x/2) exp(x/2): the two sides fall on different sides of the switch."""
    twist = support.random_twists(np.random.default_rng(seed), (), angle)
    half = Pose.exp(twist / 2)
    assert_same_pose(Pose.exp(twist), half @ half, 8e-15)
    np.testing.assert_allclose((half @ half).log(), twist, rtol=0, atol=1e-14)


@pytest.mark.parametrize("axis", np.eye(3).tolist())
def test_log_at_exactly_half_a_turn(axis: list[float]) -> None:
    pose = Pose((1.0, -2.0, 3.0), (0.0, *axis))
    np.testing.assert_allclose(np.linalg.norm(pose.rotation_vector), np.pi, rtol=1e-15)
    assert_same_pose(Pose.exp(pose.log()), pose)


def _hat(twist: Floats) -> Floats:
    """The 4x4 matrix whose exponential is the motion of a twist (6,)."""
    x, y, z = twist[3:]
    matrix = np.zeros((4, 4))
    matrix[:3, :3] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    matrix[:3, 3] = twist[:3]
    return matrix


# ---- against SciPy --------------------------------------------------------------------


def _scipy(pose: Pose) -> Rotation:
    return Rotation.from_quat(pose.wxyz.reshape(-1, 4), scalar_first=True)


@given(support.poses)
def test_matrices_and_rotation_vectors_agree_with_scipy(pose: Pose) -> None:
    theirs = _scipy(pose)
    shape = pose.batch
    np.testing.assert_allclose(
        pose.rotation, theirs.as_matrix().reshape(*shape, 3, 3), atol=4e-15, rtol=0
    )
    ours = pose.rotation_vector.reshape(-1, 3)
    assert np.all(np.linalg.norm(ours, axis=-1) <= np.pi + 1e-15)
    gap = Rotation.from_rotvec(ours) * theirs.inv()
    assert np.all(gap.magnitude() < 1e-14)


@given(support.poses)
def test_quaternions_from_matrices_agree_with_scipy(pose: Pose) -> None:
    back = Pose.from_rotation(pose.position, pose.rotation)
    assert np.all(back.wxyz[..., 0] >= 0)
    gap = _scipy(back) * _scipy(pose).inv()
    assert np.all(gap.magnitude() < 1e-14)
    assert_same_pose(Pose.from_matrix(pose.matrix), pose, 1e-14)


@given(support.seeds, support.batches)
def test_euler_angles_are_rx_ry_rz(seed: int, batch: tuple[int, ...]) -> None:
    rng = np.random.default_rng(seed)
    angles = rng.uniform([-np.pi, -1.57, -np.pi], [np.pi, 1.57, np.pi], (*batch, 3))
    pose = Pose.from_euler(np.zeros(3), angles)
    theirs = Rotation.from_euler("XYZ", angles.reshape(-1, 3))  # capitals: Rx @ Ry @ Rz
    expected = theirs.as_matrix().reshape(*batch, 3, 3)
    np.testing.assert_allclose(pose.rotation, expected, rtol=0, atol=4e-15)
    np.testing.assert_allclose(pose.euler, angles, rtol=0, atol=1e-11)


@given(support.seeds, st.sampled_from([-1.0, 1.0]), st.sampled_from([0.0, 1e-12, 1e-8, 1e-4]))
def test_euler_angles_describe_the_rotation_at_gimbal_lock_too(
    seed: int, side: float, off: float
) -> None:
    a, c = np.random.default_rng(seed).uniform(-np.pi, np.pi, 2)
    pose = Pose.from_euler(np.zeros(3), (a, side * (np.pi / 2 - off), c))
    angles = pose.euler
    assert np.all(np.abs(angles) <= [np.pi, np.pi / 2, np.pi])
    assert_same_pose(Pose.from_euler(np.zeros(3), angles), pose, 4e-15)


@pytest.mark.parametrize("angle", [1e-300, 1e-12, 1e-6, 1e-3])
def test_small_euler_angles_keep_their_digits(angle: float) -> None:
    a, _, c = Pose.from_euler(np.zeros(3), (angle, 0.0, -angle)).euler
    np.testing.assert_allclose((a, c), (angle, -angle), rtol=1e-15)


# ---- distance -------------------------------------------------------------------------


@given(support.pose_triples())
def test_distance_is_a_metric_that_no_change_of_base_frame_alters(
    triple: tuple[Pose, Pose, Pose],
) -> None:
    a, b, c = triple
    (ab, turn_ab), (bc, turn_bc), (ac, turn_ac) = a.distance(b), b.distance(c), a.distance(c)
    assert np.all(a.distance(a)[0] == 0)
    assert np.all(a.distance(a)[1] < 4e-15)
    np.testing.assert_allclose(b.distance(a), (ab, turn_ab), rtol=1e-12, atol=4e-15)
    assert np.all(ac <= ab + bc + 1e-12)
    assert np.all(turn_ac <= turn_ab + turn_bc + 1e-12)
    np.testing.assert_allclose((c @ a).distance(c @ b), (ab, turn_ab), rtol=1e-9, atol=1e-13)


@given(support.poses, st.sampled_from([0.0, 1e-200, 1e-12, 1e-6, 1.0, np.pi - 1e-6, np.pi]))
def test_distance_measures_tiny_and_large_turns_alike(pose: Pose, angle: float) -> None:
    turn = Pose.from_rotation_vector((0.0, 3.0, 4.0), (angle, 0.0, 0.0))
    shift, found = pose.distance(pose @ turn)
    np.testing.assert_allclose(shift, 5.0, rtol=1e-14)
    np.testing.assert_allclose(found, angle, rtol=1e-13, atol=5e-16)


# ---- batch axes -----------------------------------------------------------------------


@pytest.mark.parametrize("batch", BATCHES)
def test_every_view_has_the_batch_axes(batch: tuple[int, ...]) -> None:
    pose = support.random_poses(np.random.default_rng(0), batch, 0.5)
    shapes = {
        "position": (3,), "wxyz": (4,), "rotation": (3, 3), "matrix": (4, 4), "euler": (3,),
        "rotation_vector": (3,),
    }  # fmt: skip
    for name, trailing in shapes.items():
        assert getattr(pose, name).shape == (*batch, *trailing), name
    assert pose.log().shape == (*batch, 6)
    assert [d.shape for d in pose.distance(pose)] == [batch, batch]
    for made in (Pose.exp(pose.log()), pose.inverse(), pose @ pose, Pose.from_matrix(pose.matrix)):
        assert made.batch == batch


def test_position_and_quaternion_broadcast() -> None:
    pose = Pose(np.zeros((4, 1, 3)), np.ones((5, 4)))
    assert pose.batch == (4, 5)
    assert len(pose) == 4
    assert pose[1].batch == (5,)
    assert pose[1, 2].batch == ()
    assert pose[..., None].batch == (4, 5, 1)
    assert pose[np.array([True, False, True, False])].batch == (2, 5)


def test_rows_are_the_poses_they_were() -> None:
    pose = support.random_poses(np.random.default_rng(0), (4, 2), 1.0)
    assert_same_pose(pose[2, 1], Pose(pose.position[2, 1], pose.wxyz[2, 1]), 0)
    assert_same_pose(pose[::-1][0], pose[3], 0)


def test_a_row_of_nan_leaves_its_neighbours_alone() -> None:
    position = np.array([[0.0, 0, 1], [np.nan] * 3, [0.0, 0, 2]])
    pose = Pose(position, np.array([[1.0, 0, 0, 0], [np.nan] * 4, [0.0, 1, 0, 0]]))
    for view in (pose.matrix[:, :3], pose.log(), pose.euler, (pose @ pose).position,
                 pose.distance(pose)[1][:, None]):  # fmt: skip
        finite = np.all(np.isfinite(view), axis=tuple(range(1, view.ndim)))
        assert finite.tolist() == [True, False, True]


# ---- what is refused ------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Pose((1.0, 2.0)), r"position: expected \(..., 3\), got \(2,\)"),
        (lambda: Pose(5.0), r"position: expected \(..., 3\), got \(\)"),
        (lambda: Pose(("a", 1, 2)), r"position\[0\]: expected a number, found 'a'"),
        (lambda: Pose([[0, 0, 0], [1, 2]]), r"position: rows of unequal length; .* \[3, 2\]"),
        (lambda: Pose((0, 0, 1j)), r"position\[2\]: expected a number, found 1j"),
        (lambda: Pose([0, 0, None]),  # pyright: ignore
         r"position\[2\]: expected a number, found None"),
        (lambda: Pose((0, 0, 0), (0, 0, 0, 0)), "wxyz: a quaternion of zeros is no rotation"),
        (lambda: Pose((0, 0, 0), (1, 0, 0)), r"wxyz: expected \(..., 4\), got \(3,\)"),
        (lambda: Pose.exp(np.zeros(5)), r"twist: expected \(..., 6\), got \(5,\)"),
        (lambda: Pose.from_matrix(np.eye(3)), r"matrix: expected \(..., 4, 4\), got \(3, 3\)"),
        (lambda: Pose.from_euler((0, 0, 0), (0, 0)), r"angles: expected \(..., 3\), got \(2,\)"),
        (lambda: ONE.apply((1, 2)), r"points: expected \(..., 3\), got \(2,\)"),
    ],
)  # fmt: skip
def test_wrong_input_is_named(make, message: str) -> None:
    with pytest.raises(GoughError, match=f"^{message}$"):
        make()


def test_a_single_pose_has_no_rows() -> None:
    with pytest.raises(TypeError, match="no length"):
        len(ONE)
    with pytest.raises(IndexError, match="no rows"):
        ONE[0]


def test_poses_are_frozen() -> None:
    with pytest.raises(AttributeError):
        ONE.position = np.zeros(3)  # pyright: ignore[reportAttributeAccessIssue]
    with pytest.raises(ValueError, match="read-only"):
        ONE.position[0] = 5.0


def test_repr_shows_one_pose_and_sums_up_many() -> None:
    assert repr(ONE) == "Pose(position=(1, 2, 3), wxyz=(0.5, 0.5, -0.5, 0.5))"
    assert repr(Pose.identity((7,))) == "Pose(batch (7,))"


# ---- to and from others ---------------------------------------------------------------

RPY = st.tuples(*[st.floats(-np.pi, np.pi)] * 3) | st.tuples(
    st.floats(-np.pi, np.pi),
    st.sampled_from([np.pi / 2, -np.pi / 2, np.pi / 2 - 1e-9, 1e-9 - np.pi / 2]),
    st.floats(-np.pi, np.pi),
)  # gimbal lock and next to it


@given(RPY)
def test_roll_pitch_yaw_are_turns_about_fixed_axes_as_in_scipy(rpy: tuple) -> None:
    pose = Pose.from_rpy((1.0, 2.0, 3.0), rpy)
    theirs = Rotation.from_euler("xyz", rpy)
    np.testing.assert_allclose(pose.rotation, theirs.as_matrix(), rtol=0, atol=1e-15)
    roll, pitch, yaw = pose.rpy
    again = Rotation.from_euler("xyz", (roll, pitch, yaw))
    np.testing.assert_allclose(again.as_matrix(), theirs.as_matrix(), rtol=0, atol=2e-15)
    assert abs(pitch) <= np.pi / 2 + 1e-15


@given(support.batches, support.seeds)
def test_roll_pitch_yaw_of_batches(batch: tuple, seed: int) -> None:
    rng = np.random.default_rng(seed)
    angles = rng.uniform(-1.5, 1.5, (*batch, 3))
    pose = Pose.from_rpy(rng.standard_normal((*batch, 3)), angles)
    assert pose.batch == batch
    np.testing.assert_allclose(pose.rpy, angles, rtol=0, atol=1e-14)
    # the z-y-x order, from the axes one by one
    x, y, z = (Pose.from_euler(np.zeros(3), angles * np.eye(3)[i]).rotation for i in range(3))
    np.testing.assert_allclose(pose.rotation, z @ y @ x, rtol=0, atol=1e-15)


@given(support.poses)
def test_scipy_rotations_come_back_as_they_were(pose: Pose) -> None:
    flat = Pose(pose.position.reshape(-1, 3), pose.wxyz.reshape(-1, 4))
    theirs = flat.as_scipy()
    np.testing.assert_allclose(theirs.as_matrix(), flat.rotation, rtol=0, atol=4e-15)
    support.assert_same_pose(Pose.from_scipy(flat.position, theirs), flat, 4e-15)
    rigid = RigidTransform.from_matrix(flat.matrix)
    support.assert_same_pose(Pose.from_matrix(rigid.as_matrix()), flat, 1e-14)


def test_one_scipy_rotation_serves_many_positions() -> None:
    turn = Rotation.from_euler("XYZ", (10, 20, 30), degrees=True)
    poses = Pose.from_scipy(np.zeros((4, 3)), turn)
    assert poses.batch == (4,)
    np.testing.assert_allclose(np.degrees(poses.euler), [(10, 20, 30)] * 4, atol=1e-12)
    assert Pose.from_scipy(np.zeros(3), turn).as_scipy().approx_equal(turn, 1e-15)


def test_rows_of_nan_are_no_scipy_rotation() -> None:
    pose = Pose.trusted(np.full((2, 3), np.nan), np.full((2, 4), np.nan))
    with pytest.raises(GoughError, match=r"rows of NaN.*solution\.pose\[solution\.usable\]"):
        pose.as_scipy()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (np.diag([1.0, 1.0, -1.0, 1.0]), "right-handed"),
        (np.diag([0.0, 0.0, 0.0, 1.0]), "expected matrices with R R"),
        (np.diag([2.0, 2.0, 2.0, 1.0]), "scale factor"),
        (np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [5, 6, 7, 1]]), "transposed"),
    ],
)
def test_matrices_that_are_no_poses_are_refused(change: Floats, message: str) -> None:
    rows = np.stack([np.eye(4), change])
    with pytest.raises(GoughError, match=message):
        Pose.from_matrix(rows)


def test_masked_entries_are_read_as_nan() -> None:
    position = np.ma.masked_equal([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], 5.0)
    pose = Pose(position)
    assert np.isnan(pose.position[1, 1])
    assert np.isfinite(pose.position[0]).all()


def test_batch_axes_that_do_not_fit_are_refused() -> None:
    two, three = Pose.identity((2,)), Pose.identity((3,))
    for action in (
        lambda: two.distance(three),
        lambda: two @ three,
        lambda: Pose(np.zeros((2, 3)), three.wxyz),
    ):
        with pytest.raises(GoughError, match="batch axes"):
            action()


@pytest.mark.parametrize(("count", "seed"), [(-1, 0), (1.5, 0), (2, -1)])
def test_counts_of_sampled_poses_are_checked(count: int, seed: int) -> None:
    with pytest.raises(GoughError, match="expected a whole number of 0 or more"):
        Platform.load("reference").sample_poses(count, seed)
