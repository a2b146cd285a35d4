"""Margins to limits, and what is left of each axis: against coal, MuJoCo and plain NumPy."""

from __future__ import annotations

from dataclasses import replace

import coal  # pyright: ignore[reportMissingImports] - a compiled module without types
import machines
import mujoco_model
import numpy as np
import pytest
import support
from hypothesis import given
from hypothesis import strategies as st

import gough
from gough import MachineLimits, Payload, Platform, Pose, Workspace, kinematics
from gough.kernel.constants import solving_order
from gough.limit_geometry import PAIRS, least_gaps, leg_bodies, segment_distance
from gough.units import scaled

MACHINES = Platform.catalog()
kinds = st.sampled_from(["telescopic", "length_change", "rotary"])
limited_platforms = st.builds(
    lambda seed, legs, sensors, same: machines.limited(
        machines.random_platform(seed, legs, sensors), None if same else seed
    ),
    support.seeds, kinds, st.booleans(), st.booleans(),
)  # fmt: skip


def wide(platform: Platform, count: int, seed: int) -> Pose:
    """Poses well beyond what most machines can do."""
    rng = np.random.default_rng(seed)
    shift = rng.uniform(-0.3, 0.3, (count, 3)) * platform.size
    turn = Pose.from_rotation_vector(shift, rng.uniform(-0.6, 0.6, (count, 3)))
    rotated = turn @ Pose(np.zeros(3), platform.home.wxyz)
    return Pose(platform.home.position + shift, rotated.wxyz)


def plain_margins(platform: Platform, pose: Pose) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Margins of every part and what they are divided by, written with NumPy alone."""
    limits, home = platform.limits, platform.home
    assert limits is not None
    assert limits.leg_force is not None
    assert limits.base_joint_cone is not None
    assert limits.moving_joint_cone is not None
    assert platform.stroke is not None
    assert platform.workspace is not None
    ends = lambda value, pair: np.minimum(value - pair[:, 0], pair[:, 1] - value)  # noqa: E731
    half = lambda pair: (pair[:, 1] - pair[:, 0]) / 2  # noqa: E731
    base, moving = gough.joint_angles(platform, pose)
    cones = np.radians(limits.base_joint_cone), np.radians(limits.moving_joint_cone)
    least = least_gaps(limits)
    box = np.concatenate(
        [platform.workspace.translation, np.radians(platform.workspace.rotation_deg)]
    )
    turn = Pose(np.zeros(3), home.wxyz).inverse() @ Pose(np.zeros(3), pose.wxyz)
    away = np.concatenate([pose.position - home.position, turn.euler], axis=-1)
    with np.errstate(invalid="ignore"):
        det, at_home = (
            np.linalg.det(kinematics.normalised_jacobian(platform, p)) for p in (pose, home)
        )
    return {
        "stroke": (ends(gough.leg_lengths(platform, pose), platform.stroke), half(platform.stroke)),
        "base joint": (cones[0] - base, cones[0]),
        "platform joint": (cones[1] - moving, cones[1]),
        "clearance": (gough.leg_gaps(platform, pose) - least,
                      gough.leg_gaps(platform, home) - least),
        "leg force": (ends(gough.payload_forces(platform, pose), limits.leg_force),
                      half(limits.leg_force)),
        "workspace": (ends(away, box), half(box)),
        "singularity": ((det * np.sign(at_home))[..., None], np.abs(at_home)[None]),
    }  # fmt: skip


@support.at_most(40)
@given(limited_platforms, support.seeds)
def test_compiled_margins_are_the_plain_ones(platform: Platform, seed: int) -> None:
    pose = wide(platform, 30, seed)
    found = gough.limits(platform, pose)
    units = {"stroke": np.max(np.abs(1 / platform.gain)) * support.reading_scale(platform),
             "clearance": platform.size, "workspace": max(1.0, platform.size)}  # fmt: skip
    for name, (margin, scale) in plain_margins(platform, pose).items():
        column, shares = found.names.index(name), margin / scale
        known = np.isfinite(margin).all(axis=-1)
        if name != "workspace":
            assert np.array_equal(known, np.isfinite(found.share[:, column]))
        worst = np.min(shares, axis=-1)[known]
        near = 1e-8 * np.maximum(1, np.abs(worst))
        assert np.all(np.abs(found.share[known, column] - worst) <= near), name
        part = np.take_along_axis(
            margin[known], np.argmin(shares[known], axis=-1)[:, None], axis=-1
        )[:, 0]  # fmt: skip
        clear = np.sort(shares[known], axis=-1)
        clear = (np.ptp(clear[:, :2], axis=-1) if clear.shape[1] > 1 else 1) > 1e-6
        unit = units.get(name, 1.0) * np.maximum(1, np.abs(worst))
        assert np.all((np.abs(found.of(name)[known] - part) <= 1e-8 * unit) | ~clear), name


@support.at_most(40)
@given(limited_platforms, support.seeds)
def test_what_is_broken_has_a_margin_below_zero(platform: Platform, seed: int) -> None:
    pose = wide(platform, 30, seed)
    found = gough.limits(platform, pose)
    assert np.array_equal(found.ok, found.tightest >= -1e-8)
    legs = np.zeros((30, 6), bool)
    for name, (margin, _) in plain_margins(platform, pose).items():
        beyond = margin < 0
        if name == "clearance":
            for k, pair in enumerate(PAIRS):
                legs[:, pair] |= beyond[:, k, None]
        elif margin.shape[-1] == 6 and name != "workspace":
            legs |= beyond
    reached = np.isfinite(gough.leg_lengths(platform, pose)).all(axis=-1)
    np.testing.assert_array_equal(found.legs[reached], legs[reached])


def capsule(start: np.ndarray, way: np.ndarray, radius: float) -> tuple:
    """A capsule of coal's, along `way`, and where it is."""
    length = np.linalg.norm(way)
    z = way / length
    x = np.cross(z, [1.0, 0, 0] if abs(z[0]) < 0.7 else [0, 1.0, 0])
    x /= np.linalg.norm(x)
    place = coal.Transform3s(np.stack([x, np.cross(z, x), z], axis=-1), start + way / 2)
    return coal.Capsule(radius, length), place


def coal_gaps(platform: Platform, pose: Pose, radius: float) -> np.ndarray:
    """Distances (15,) of the surfaces of legs of this radius, by coal."""
    start, rods, _ = leg_bodies(platform, pose)
    bodies = [[capsule(start[i], rods[i], radius)] for i in range(6)]
    if platform.rotary is not None:
        for i in range(6):
            arm = start[i] - platform.base[i]
            bodies[i].append(capsule(platform.base[i], arm, radius))
    return np.array([
        min(coal.distance(*a, *b, coal.DistanceRequest(), coal.DistanceResult())
            for a in bodies[i] for b in bodies[j])
        for i, j in PAIRS
    ])  # fmt: skip


@pytest.mark.parametrize("name", MACHINES)
def test_gaps_are_those_of_coal(name: str) -> None:
    platform = Platform.load(name)
    radius = 0.01 * platform.size
    poses = wide(platform, 60, 1)
    gaps = gough.leg_gaps(platform, poses) - 2 * radius
    for i in np.flatnonzero(np.isfinite(gaps).all(axis=-1)):
        apart = gaps[i] > 0
        found = coal_gaps(platform, poses[int(i)], radius)
        np.testing.assert_allclose(gaps[i, apart], found[apart], rtol=0, atol=1e-9 * platform.size)


def test_gaps_of_parallel_and_crossing_legs() -> None:
    start, way = np.zeros(3), np.array([1.0, 0, 0])
    for turn, shift, expected in (
        ([1.0, 0, 0], [0.0, 2, 0], 2.0),  # parallel, side by side
        ([1.0, 0, 0], [3.0, 0, 0], 2.0),  # on one line
        ([-1.0, 0, 0], [6.0, 0, 3], 5.0),  # parallel, ends apart
        ([0.0, 1, 0], [0.5, -0.5, 0], 0.0),  # crossing
        ([1.0, 1e-9, 0], [0.0, 0, 1], 1.0),
    ):
        found = segment_distance(start, way, start + np.array(shift), np.array(turn))
        assert found == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("name", MACHINES)
def test_joint_angles_are_those_of_mujoco(name: str) -> None:
    platform = Platform.load(name)
    poses = support.sample(platform, (10,))
    rotary = platform.rotary is not None
    for i in range(10):
        motors = gough.leg_lengths(platform, poses[i]) if rotary else None
        home = platform.home_legs if rotary else None
        expected = mujoco_model.joint_angles(platform, poses[i], motors, home)
        for found, angle in zip(gough.joint_angles(platform, poses[i]), expected, strict=True):
            np.testing.assert_allclose(found, angle, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("name", MACHINES)
def test_payload_forces_hold_the_payload_in_mujoco(name: str) -> None:
    """With these forces, a body of this weight at this place does not accelerate."""
    platform = Platform.load(name)
    load = Payload(2.0, platform.size * np.array([0.1, -0.2, 0.3]), gravity=(1, 2, -9))
    poses = support.sample(platform, (3,))
    for i in range(3):
        place = poses[i].apply(load.centre - platform.pivot_point) - poses[i].position
        weight = load.mass * load.gravity
        wrench = np.concatenate([weight, np.cross(place, weight)])
        motors = gough.leg_lengths(platform, poses[i]) if platform.rotary else None
        forces = gough.payload_forces(platform, poses[i], load)
        rest = mujoco_model.accelerations(platform, poses[i], wrench, forces, motors)
        moved = mujoco_model.accelerations(platform, poses[i], wrench, 0 * forces, motors)
        assert np.abs(rest).max() < 1e-9 * np.abs(moved).max()


@pytest.mark.parametrize("pivot", [0.0, 1e-15, 1e-9])
def test_forces_keep_their_digits_where_a_pivot_vanishes(pivot: float) -> None:
    """The leg that is eliminated first has no component along x."""
    platform = machines.limited(Platform.load("reference"))
    leg = int(solving_order(platform)[0])
    x = kinematics.strut_vectors(platform, platform.home)[leg, 0]
    pose = Pose(platform.home.position + np.array([pivot * platform.size - x, 0, 0]))
    limits = platform.limits
    assert limits is not None
    assert limits.leg_force is not None
    forces = gough.payload_forces(platform, pose)
    nearest = np.min([forces - limits.leg_force[:, 0], limits.leg_force[:, 1] - forces])
    np.testing.assert_allclose(gough.limits(platform, pose).of("leg force"), nearest, rtol=1e-10)


# ---- reach ----------------------------------------------------------------------------


def moved(pose: Pose, axis: int, way: np.ndarray) -> Pose:
    twist = np.zeros((len(way), 6))
    twist[:, axis] = way
    return support.moved(pose, twist)


@support.at_most(10)
@given(limited_platforms, support.seeds)
def test_reach_ends_at_the_first_limit_on_the_way(platform: Platform, seed: int) -> None:
    pose = platform.sample_poses(3, seed)
    found = gough.reach(platform, pose)
    assert platform.workspace is not None
    box = [*np.ptp(platform.workspace.translation, axis=1),
           *np.radians(np.ptp(platform.workspace.rotation_deg, axis=1))]  # fmt: skip
    starts = gough.limits(platform, pose)
    for i in range(3):
        for axis in range(6):
            for way, sign in enumerate((-1, 1)):
                distance, limit = found.distance[i, axis, way], found.limit[i, axis, way]
                if not starts.ok[i]:
                    assert distance == 0
                    assert limit == starts.limit[i]
                    continue
                last = distance - 1e-9 * box[axis]  # two ways of moving a pose round differently
                steps = np.append(np.arange(0, last, 1e-3 * box[axis]), max(last, 0.0))
                on_the_way = gough.limits(platform, moved(pose[i], axis, sign * steps))
                assert on_the_way.ok.all()
                if limit:
                    beyond = np.array([distance + 1e-6 * box[axis]])
                    after = gough.limits(platform, moved(pose[i], axis, sign * beyond))
                    assert not after.ok[0]


def test_reach_names_what_ends_it() -> None:
    platform = replace(
        Platform.load("reference"), workspace=Workspace.about_home(50, 30),
        limits=MachineLimits(base_joint_cone=3),
    )  # fmt: skip
    found = gough.reach(platform, platform.home)
    assert found.limit[2].tolist() == ["z: workspace", "z: workspace"]
    np.testing.assert_allclose(found.distance[2], 50, rtol=1e-7)
    assert found.limit[0, 1].endswith("base joint")
    assert "x -" in repr(found)
    nothing = gough.reach(platform, Pose(np.full(3, np.nan)))
    assert np.isnan(nothing.distance).all()
    assert set(nothing.limit.ravel()) == {""}


def test_reach_without_a_workspace_ends_at_a_singularity() -> None:
    platform = replace(Platform.load("reference"), workspace=None)
    found = gough.reach(platform, platform.home)
    assert found.limit[2, 0] == "singularity"  # the platform in the base's plane
    assert found.distance[2, 0] == pytest.approx(600, rel=1e-9)
    assert found.limit[2, 1] == ""


# ---- the result -----------------------------------------------------------------------


@pytest.mark.parametrize("batch", support.BATCHES)
@pytest.mark.parametrize("name", ["reachy_mini", "rubin_camera"])
def test_batch_axes_stay(name: str, batch: tuple[int, ...]) -> None:
    platform = machines.limited(Platform.load(name))
    pose = support.sample(platform, batch)
    found, left = gough.limits(platform, pose), gough.reach(platform, pose)
    assert found.margin.shape == (*batch, len(found.names))
    assert found.legs.shape == left.distance.shape[:-1] == (*batch, 6)
    assert np.shape(found.limit) == found.ok.shape == batch
    assert np.shape(left.limit) == (*batch, 6, 2)
    if batch:
        assert np.array_equal(found[0].limit, found.limit[0])


def test_a_pose_of_nan_has_no_margin() -> None:
    platform = machines.limited(Platform.load("reference"))
    found = gough.limits(platform, Pose(np.array([[0, 0, 600.0], [np.nan] * 3])))
    assert found.ok.tolist() == [True, False]
    assert np.isnan(found.margin[1]).all()
    assert found.limit[1] == ""


def test_unreachable_poses_break_the_arm() -> None:
    platform = machines.limited(Platform.load("reachy_mini"))
    found = gough.limits(platform, Pose((0.0, 0.0, 0.3)))
    assert found.limit.endswith(": arm") or "workspace" in found.limit
    assert found.of("arm") < 0
    assert np.isnan(found.of("stroke" if "stroke" in found.names else "clearance"))
    assert not found.ok


def test_names_are_those_the_machine_has() -> None:
    bare = replace(Platform.load("reference"), workspace=None)
    found = gough.limits(bare, bare.home)
    assert found.names == ("singularity",)
    assert repr(found) == "Limits(singularity, 1 left)"
    with pytest.raises(gough.GoughError, match="no limit 'stroke'; this machine has singularity"):
        found.of("stroke")
    assert gough.limits(support.PRISM, support.PRISM.home).names == ()


@support.at_most(20)
@given(limited_platforms, support.seeds)
def test_units_change_no_share(platform: Platform, seed: int) -> None:
    pose = platform.sample_poses(20, seed)
    found = gough.limits(platform, pose)
    other = scaled(platform, 1000.0)
    again = gough.limits(other, Pose(1000 * pose.position, pose.wxyz))
    np.testing.assert_allclose(again.share, found.share, rtol=1e-7, atol=1e-7)


def test_legs_that_share_a_joint_are_not_compared() -> None:
    genhex = Platform.load("linuxcnc_genhex")
    found = gough.limits(replace(genhex, limits=MachineLimits(leg_radius=0.05)), genhex.home)
    assert found.of("clearance") > 0


@pytest.mark.parametrize("batch", support.BATCHES)
def test_solutions_carry_their_limits(batch: tuple[int, ...]) -> None:
    platform = machines.limited(Platform.load("rubin_camera"))
    pose = support.sample(platform, batch)
    found = gough.solve(platform, gough.leg_lengths(platform, pose), limits=True)
    assert found.limits is not None
    assert np.shape(found.limits.ok) == batch
    np.testing.assert_allclose(found.limits.share, gough.limits(platform, pose).share, atol=1e-6)
    if batch:
        assert found[0].limits is not None
        table = found.to_frame("pyarrow")
        assert table.column_names[-2:] == ["margin", "limit"]
        assert table["limit"].to_pylist() == np.ravel(found.limits.limit).tolist()
    assert gough.solve(platform, platform.home_legs).limits is None
