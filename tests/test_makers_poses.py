"""Poses as makers write them: against what their manuals publish, and against SciPy and MuJoCo."""

# MuJoCo has no types
# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pandas as pd
import pytest
import support
from hypothesis import given
from scipy.spatial.transform import Rotation
from shell import run

import gough
from gough import GoughError, Platform, Pose
from gough.columns import Angles
from gough.platform_file import from_toml

# how each writes R: SciPy's order (capitals: about axes that turn along) and the unit
MAKERS: dict[Angles, tuple[list[str], str, bool]] = {
    "uvw": (["X", "Y", "Z", "U", "V", "W"], "XYZ", True),
    "abc": (["X", "Y", "Z", "A", "B", "C"], "xyz", True),
    "rpy": (["x", "y", "z", "roll", "pitch", "yaw"], "xyz", False),
}


@pytest.mark.parametrize("name", MAKERS)
@given(support.seeds)
def test_columns_of_makers_are_what_they_say(name: Angles, seed: int) -> None:
    columns, order, degrees = MAKERS[name]
    pose = support.random_poses(np.random.default_rng(seed), (20,), 1.5)
    table = pose.to_frame("pandas", angles=name)
    assert list(table.columns) == columns
    turns = Rotation.from_euler(order, table[columns[3:]].to_numpy(), degrees=degrees)
    np.testing.assert_allclose(turns.as_matrix(), pose.rotation, atol=1e-14)
    shift, turn = Pose.from_frame(table).distance(pose)
    assert np.max(shift) == 0
    assert np.max(turn) <= 1e-14


def test_pi_turns_about_axes_and_a_pivot_that_move_with_the_platform() -> None:
    """User manuals MS222E and MS207E, "Rotation": axes and centre of rotation move with it,
    U, then V, then W. Their example is a figure without numbers; so each rotation is made here
    about the axis where the rotations before have taken it, through the pivot."""
    pivot, home = np.array([0.0, 10.0, -50.0]), Platform.load("reference").home
    machine = Platform.load("reference").with_frames({
        "tool_in_platform": pivot, "work_in_base": home.apply(pivot),
    })  # fmt: skip
    X, uvw = np.array([3.0, -4.0, 5.0]), [10.0, -20.0, 30.0]
    matrix = np.eye(4)  # of points of the platform at home to where they are
    matrix[:3, 3] = X
    axes = np.eye(3)
    for k, angle in enumerate(uvw):
        through, turn = home.apply(pivot) + X, Rotation.from_rotvec(np.radians(angle) * axes[:, k])
        step = np.eye(4)
        step[:3, :3] = turn.as_matrix()
        step[:3, 3] = through - turn.apply(through)
        matrix, axes = step @ matrix, turn.apply(axes.T).T
    joints = (matrix[:3, :3] @ home.apply(machine.moving).T).T + matrix[:3, 3]
    legs = np.linalg.norm(joints - machine.base, axis=-1)
    found = gough.solve(machine, legs, frame="tool in work").pose
    written = found.to_frame("pandas", angles="uvw").iloc[0]
    np.testing.assert_allclose(written[["X", "Y", "Z", "U", "V", "W"]], [*X, *uvw], atol=1e-9)


def test_linuxcnc_turns_as_its_posemath_does() -> None:
    """`pmRpyMatConvert` of src/libnml/posemath/_posemath.c, which genhexkins.c calls."""
    a, b, c = np.radians([10.0, -20.0, 30.0])
    (sg, sb, sa), (cg, cb, ca) = np.sin([a, b, c]), np.cos([a, b, c])
    expected = [
        [ca * cb, ca * sb * sg - sa * cg, ca * sb * cg + sa * sg],
        [sa * cb, sa * sb * sg + ca * cg, sa * sb * cg - ca * sg],
        [-sb, cb * sg, cb * cg],
    ]
    row = {"X": [0.0], "Y": [0.0], "Z": [1.0], "A": [10.0], "B": [-20.0], "C": [30.0]}
    np.testing.assert_allclose(Pose.from_frame(pd.DataFrame(row)).rotation[0], expected, atol=1e-15)


def test_ros_turns_as_mujoco_reads_a_urdf() -> None:
    """REP 103: "fixed axis roll, pitch, yaw about X, Y, Z axes respectively"; URDF's rpy."""
    rpy = [0.3, -0.4, 0.5]
    urdf = f"""<robot name="r"><link name="a"/><link name="b"><inertial><mass value="1"/>
        <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="j" type="continuous"><parent link="a"/><child link="b"/>
        <origin xyz="1 2 3" rpy="{rpy[0]} {rpy[1]} {rpy[2]}"/></joint></robot>"""
    body = mujoco.MjModel.from_xml_string(urdf).body("b")
    row = dict(zip(MAKERS["rpy"][0], [[1.0], [2.0], [3.0], *[[v] for v in rpy]], strict=True))
    shift, turn = Pose.from_frame(pd.DataFrame(row))[0].distance(Pose(body.pos, body.quat))
    assert shift == 0
    assert turn <= 1e-15


def test_simscape_publishes_a_rotation_sequence_about_follower_axes() -> None:
    """mathworks.com/help/sm/ref/simscape.multibody.rotation.matrix.html: Follower, ZYX."""
    published = [
        [0.4981, -0.8665, -0.0321],
        [0.8627, 0.4915, 0.1188],
        [-0.0872, -0.0868, 0.9924],
    ]
    pose = '{position = [0, 0, 120], euler_deg = [60, 5, -5], order = "ZYX"}'
    text = f"{Platform.load('reference').to_toml()}[frames]\ntool_in_platform = {pose}\n"
    frames = from_toml(text).frames
    assert frames is not None
    np.testing.assert_allclose(frames.moving["tool"].rotation, published, atol=5e-5)


def test_the_commands_write_and_read_them(tmp_path: Path) -> None:
    file = tmp_path / "poses.csv"
    said, code = run(f"gough solve 650 655 660 652 648 657 -p reference --angles abc -o {file}")
    assert code == 0, said
    assert file.read_text().startswith("X,Y,Z,A,B,C,status")
    said, code = run(f"gough inverse {file} -p reference")
    assert code == 0, said
    assert "650.00000  655.00000  660.00000" in said


def test_other_angles_are_refused_with_those_there_are() -> None:
    with pytest.raises(GoughError, match="one of 'deg', 'rad', 'uvw', 'abc', 'rpy', found 'zyx'"):
        Pose.identity((1,)).to_frame(angles="zyx")  # pyright: ignore[reportArgumentType]
