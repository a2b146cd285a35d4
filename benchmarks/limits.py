"""Frames beside SciPy and pytransform3d; margins of poses beside coal and MuJoCo, and their speed.

python benchmarks/limits.py                 # a few minutes
python benchmarks/limits.py --poses 1000    # of each machine, against coal and MuJoCo

Poses are drawn evenly from a box of +-0.1 of the machine's size and +-20 deg about home; those that
motors cannot reach are left out. Limits: cones of 60 and 70 deg, a leg radius of a fifth of the
least gap at home, forces of +-5 times the largest at home.
"""

# coal and MuJoCo have no types; the model of tests is found at run time
# pyright: reportMissingImports=false, reportAttributeAccessIssue=false

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import gough
from gough import MachineLimits, Payload, Platform, Pose
from gough.limit_geometry import PAIRS, leg_bodies, shared_joints

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

SPEED_ROWS = 1_000_000
MUJOCO_POSES = 1_000  # MuJoCo compiles a model for each
REACH_POSES = 200


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=100_000)
    parser.add_argument("--only", default="frames,coal,mujoco,reach,speed")
    given = parser.parse_args()
    parts = {"frames": chains, "coal": clearance, "mujoco": joints_and_forces,
             "reach": first_limit, "speed": speed}  # fmt: skip
    for name in given.only.split(","):
        parts[name](given.poses)


def box(platform: Platform, count: int, seed: int = 5) -> Pose:
    """Poses about home, whatever workspace the machine states."""
    return platform.with_workspace(0.1 * platform.size, 20).sample_poses(count, seed)


def limited(platform: Platform) -> Platform:
    load = Payload(30.0, 0.1 * platform.size * np.array([0.1, 0.2, 1.0]))
    most = 5 * np.max(np.abs(gough.payload_forces(platform, platform.home, load)))
    gaps = gough.leg_gaps(platform, platform.home)[~shared_joints(platform)]
    return replace(platform, limits=MachineLimits(
        base_joint_cone=60, moving_joint_cone=70, leg_radius=0.2 * gaps.min(),
        leg_force=(-most, most), payload=load, leg_speed=1.0,
    ))  # fmt: skip


# ---- frames ---------------------------------------------------------------------------


def chains(count: int) -> None:
    """Poses of a tip on a tool in a room on a work piece, beside compositions by others."""
    from pytransform3d.batch_rotations import matrices_from_quaternions
    from scipy.spatial.transform import RigidTransform, Rotation

    rng = np.random.default_rng(0)
    names = ("base_in_world", "tool_in_platform", "tip_in_tool", "work_in_world", "room_in_work")
    poses = {name: Pose(rng.normal(size=3), rng.normal(size=4)) for name in names}
    machine = replace(Platform.load("reference"), pivot=(0.3, -0.2, 0.5)).with_frames(poses)
    pose = Pose(rng.normal(size=(count, 3)), rng.normal(size=(count, 4)))
    view = machine.frame("tip in room")
    found = view.of(pose).matrix

    def scipy(p: Pose) -> RigidTransform:
        return RigidTransform.from_components(
            p.position, Rotation.from_quat(p.wxyz, scalar_first=True)
        )

    def matrices(p: Pose) -> np.ndarray:
        out = np.tile(np.eye(4), (*p.batch, 1, 1))
        out[..., :3, :3] = matrices_from_quaternions(p.wxyz, normalize_quaternions=True)
        out[..., :3, 3] = p.position
        return out

    shift = Pose(machine.pivot_point)
    chain = [poses["room_in_work"], poses["work_in_world"]], [poses["base_in_world"], shift]
    rest = [poses["tool_in_platform"], poses["tip_in_tool"]]
    by_scipy = scipy(Pose.identity())
    by_matrices = np.eye(4)
    for p in chain[0]:
        by_scipy, by_matrices = by_scipy * scipy(p).inv(), by_matrices @ np.linalg.inv(matrices(p))
    for p in [*chain[1], pose]:
        by_scipy, by_matrices = by_scipy * scipy(p), by_matrices @ matrices(p)
    by_scipy, by_matrices = (
        by_scipy * scipy(shift).inv(),
        by_matrices @ np.linalg.inv(matrices(shift)),
    )
    for p in rest:
        by_scipy, by_matrices = by_scipy * scipy(p), by_matrices @ matrices(p)
    scale = np.abs(found).max(axis=(-2, -1))
    print(f"| {count:,} poses of a frame, composed by | largest difference / largest number |\n"
          "|---|---|")  # fmt: skip
    for name, other in (("SciPy", by_scipy.as_matrix()), ("pytransform3d", by_matrices)):
        apart = np.abs(other - found).max(axis=(-2, -1)) / scale
        print(f"| {name} | {apart.max():.1e} |")
    back = view.platform_pose(view.of(pose))
    length, angle = back.distance(pose)
    print(f"| there and back | {max((length / scale).max(), angle.max()):.1e} |\n", flush=True)


# ---- coal -----------------------------------------------------------------------------


def clearance(count: int) -> None:
    """Distance of two capsules around each two legs, or around their arms and rods."""
    print(f"| {count:,} poses of | pairs of legs compared | of those apart | largest difference of "
          "gaps / size |\n|---|---|---|---|")  # fmt: skip
    for name in Platform.catalog():
        platform = Platform.load(name)
        pose = box(platform, count)
        radius = 1e-3 * platform.size
        gaps = gough.leg_gaps(platform, pose) - 2 * radius
        start, rods, _ = leg_bodies(platform, pose)
        reached = np.flatnonzero(np.isfinite(gaps).all(axis=-1))
        worst, apart = 0.0, 0
        for row in reached:
            found = coal_gaps(platform, start[row], rods[row], radius)
            clear = found > 0
            apart += int(clear.sum())
            worst = max(worst, np.max(np.abs(found - gaps[row])[clear], initial=0.0))
        print(f"| {name} | {15 * len(reached):,} | {apart:,} | {worst / platform.size:.1e} |",
              flush=True)  # fmt: skip
    print()


def coal_gaps(platform: Platform, start: np.ndarray, rods: np.ndarray, radius: float) -> np.ndarray:
    """Distances (15,) of legs at one pose, by coal."""
    import coal

    request = coal.DistanceRequest()
    bodies = [[_capsule(start[i], rods[i], radius)] for i in range(6)]
    if platform.rotary is not None:
        for i, body in enumerate(bodies):
            body.append(_capsule(platform.base[i], start[i] - platform.base[i], radius))
    return np.array([
        min(coal.distance(*a, *b, request, coal.DistanceResult())
            for a in bodies[i] for b in bodies[j])
        for i, j in PAIRS
    ])  # fmt: skip


def _capsule(start: np.ndarray, way: np.ndarray, radius: float) -> tuple:
    import coal

    length = np.linalg.norm(way)
    z = way / length
    x = np.cross(z, [1.0, 0, 0] if abs(z[0]) < 0.7 else [0, 1.0, 0])
    x /= np.linalg.norm(x)
    turn = np.stack([x, np.cross(z, x), z], axis=-1)
    return coal.Capsule(radius, length), coal.Transform3s(turn, start + way / 2)


# ---- MuJoCo ---------------------------------------------------------------------------


def joints_and_forces(count: int) -> None:
    """Angles, forces and speeds beside those of a model whose legs are tendons."""
    import mujoco_model

    count = min(count, MUJOCO_POSES)
    print(f"| {count:,} poses of | joint angles, rad | leg forces: acceleration left / without | "
          "leg speeds, relative |\n|---|---|---|---|")  # fmt: skip
    for name in Platform.catalog():
        platform = limited(Platform.load(name))
        assert platform.limits is not None
        load = platform.limits.payload
        assert load is not None
        poses, rotary = box(platform, count), platform.rotary is not None
        worst = np.zeros(3)
        for i in range(count):
            pose = poses[i]
            motors = gough.leg_lengths(platform, pose) if rotary else None
            if motors is not None and not np.isfinite(motors).all():
                continue
            home = platform.home_legs if rotary else None
            angles = mujoco_model.joint_angles(platform, pose, motors, home)
            apart = np.abs(np.array(gough.joint_angles(platform, pose)) - angles).max()
            lever = pose.rotation @ (load.centre - platform.pivot_point)
            weight = load.mass * load.gravity
            wrench = np.concatenate([weight, np.cross(lever, weight)])
            forces = gough.payload_forces(platform, pose)
            rest, free = (
                np.abs(mujoco_model.accelerations(platform, pose, wrench, f, motors)).max()
                for f in (forces, 0 * forces)
            )
            worst = np.maximum(worst, [apart, rest / free, _speeds(platform, pose)])
        speeds = "-" if rotary else f"{worst[2]:.1e}"
        print(f"| {name} | {worst[0]:.1e} | {worst[1]:.1e} | {speeds} |", flush=True)
    print()


def _speeds(platform: Platform, pose: Pose) -> float:
    """Distance of MuJoCo's fastest leg from 1 where each axis moves at its `axis_speeds`."""
    import mujoco_model

    if platform.rotary is not None:
        return 0.0
    twists = np.diag(gough.axis_speeds(platform, pose, 1.0))
    fastest = [np.abs(mujoco_model.leg_velocities(platform, pose, t)).max() for t in twists]
    return float(np.max(np.abs(np.array(fastest) - 1)))


# ---- reach ----------------------------------------------------------------------------


def first_limit(count: int) -> None:
    """Every way of `reach` against poses in steps of a thousandth of the box."""
    count = min(count, REACH_POSES)
    print(f"| {count} poses of | ways | beyond the first limit | ended more than a step early | "
          "ms a pose |\n|---|---|---|---|---|")  # fmt: skip
    for name in Platform.catalog():
        platform = limited(Platform.load(name).with_workspace(0.1 * Platform.load(name).size, 20))
        pose = platform.sample_poses(count, seed=3)
        gough.reach(platform, pose[:2])
        start = time.perf_counter()
        found = gough.reach(platform, pose, workers=1)
        milliseconds = 1000 * (time.perf_counter() - start) / count
        inside = gough.limits(platform, pose).ok
        beyond = early = 0
        steps = np.array([0.2e-3 * platform.size] * 3 + [np.radians(40e-3)] * 3)
        for i in np.flatnonzero(inside):
            for axis in range(6):
                for way, sign in enumerate((-1.0, 1.0)):
                    far = steps[axis] * np.arange(1, 1001)
                    ok = gough.limits(
                        platform, _moved(pose[int(i)], axis, sign * far), workers=1
                    ).ok
                    first = far[int(np.argmin(ok))] if not ok.all() else np.inf
                    distance = found.distance[i, axis, way]
                    beyond += bool(distance > first)
                    early += bool(distance < min(first, far[-1]) - 1.001 * steps[axis])
        print(f"| {name} | {12 * int(inside.sum()):,} | {beyond} | {early} | {milliseconds:.2f} |",
              flush=True)  # fmt: skip
    print()


def _moved(pose: Pose, axis: int, way: np.ndarray) -> Pose:
    shift = np.zeros((len(way), 6))
    shift[:, axis] = way
    turn = Pose.from_rotation_vector(np.zeros(3), shift[:, 3:]) @ Pose(np.zeros(3), pose.wxyz)
    return Pose(pose.position + shift[:, :3], turn.wxyz)


# ---- speed ----------------------------------------------------------------------------


def speed(_: int) -> None:
    """Poses a second, all limits stated, on one and on two threads; the best of three."""
    print(f"| {SPEED_ROWS:,} poses of | 1 thread, M poses/s | 2 threads, M poses/s |\n"
          "|---|---|---|")  # fmt: skip
    for name in ("reference", "rubin_camera", "reachy_mini"):
        platform = limited(Platform.load(name))
        pose = platform.sample_poses(SPEED_ROWS, seed=1)
        gough.limits(platform, pose[:10])
        rates = []
        for workers in (1, 2):
            seconds = []
            for _ in range(3):
                start = time.perf_counter()
                gough.limits(platform, pose, workers=workers)
                seconds.append(time.perf_counter() - start)
            rates.append(SPEED_ROWS / min(seconds) / 1e6)
        print(f"| {name} | {rates[0]:.2f} | {rates[1]:.2f} |", flush=True)
    print()


if __name__ == "__main__":
    main()
