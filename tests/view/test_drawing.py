"""What is drawn is where the library says it is, to scale, in any unit."""

from __future__ import annotations

import numpy as np
import pytest
from machines import random_platform

import gough
from gough import Platform
from gough.units import scaled
from gough.view import meshes
from gough.view.scene import Scene
from gough.view.server import close_server, open_server

CATALOG = Platform.catalog()


@pytest.fixture(scope="module")
def server():
    server = open_server("localhost", 0, "test")
    yield server
    close_server(server)


def ends_of(position, wxyz, scales):
    """Where the two ends of unit cylinders come to lie."""
    along = gough.Pose(position, wxyz).rotation[..., 2]
    return position, position + scales[:, 2:] * along


@pytest.mark.parametrize("name", CATALOG)
def test_legs_join_the_joints(name):
    platform = Platform.load(name)
    pose = platform.sample_poses(3, seed=2)[1]
    legs = gough.leg_lengths(platform, pose)
    parts = meshes.limbs(platform, pose, legs)
    joints = gough.joint_positions(platform, pose)
    np.testing.assert_allclose(parts.thin_end, joints, atol=1e-12 * platform.size)
    np.testing.assert_allclose(parts.thick_start, platform.base, atol=0)
    long = np.linalg.norm(parts.thin_end - parts.thin_start, axis=-1)
    thick = np.linalg.norm(parts.thick_end - parts.thick_start, axis=-1)
    if platform.rotary is None:
        total = legs + (platform.home_lengths if platform.legs == "length_change" else 0)
        np.testing.assert_allclose(long, total, rtol=1e-12)
        assert np.all(thick < long)
    else:
        np.testing.assert_allclose(long, platform.rotary.rod_length, rtol=1e-9)
        np.testing.assert_allclose(thick, platform.rotary.arm_length, rtol=1e-9)


def test_cylinders_lie_between_their_ends():
    starts = np.array([[0, 0, 0], [1, 2, 3], [0, 0, 1], [0, 0, 0], [1, 1, 1], [5, 0, 0]], float)
    ends = np.array([[0, 0, 2], [3, -1, 2], [0, 0, -1], [1e-9, 0, -1], [1, 1, 1], [4, 0, 0]], float)
    placed = meshes.rods_between(starts, ends, 0.1)
    assert np.allclose(np.linalg.norm(placed[1], axis=-1), 1)
    np.testing.assert_allclose(ends_of(*placed)[1], ends, atol=1e-8)
    np.testing.assert_array_equal(placed[2][:, :2], 0.1)


def volume(mesh: meshes.Mesh) -> float:
    a, b, c = np.moveaxis(mesh.vertices[mesh.faces], 1, 0)
    return float(np.sum(a * np.cross(b, c)) / 6)


def test_meshes_are_closed_and_seen_from_outside():
    assert volume(meshes.cylinder(60)) == pytest.approx(np.pi, rel=0.01)
    assert volume(meshes.sphere(40, 60)) == pytest.approx(4 * np.pi / 3, rel=0.01)
    ring = np.array([[np.cos(t), np.sin(t), 0] for t in np.radians(range(0, 360, 60))])
    hexagon = 3 * np.sqrt(3) / 2
    for order in (range(6), (3, 0, 5, 1, 4, 2)):  # the legs' order does not matter
        mesh = meshes.plate(ring[list(order)], 0.1, margin=1.0)
        assert volume(mesh) == pytest.approx(0.1 * hexagon)
        assert mesh.vertices[:, 2].max() == pytest.approx(0)
    for mesh in (meshes.cylinder(), meshes.sphere(), meshes.plate(ring, 0.1)):
        corners = np.unique(np.round(mesh.vertices, 9), axis=0, return_inverse=True)[1]
        edges = np.concatenate([corners[mesh.faces][:, [i, (i + 1) % 3]] for i in range(3)])
        edges = edges[edges[:, 0] != edges[:, 1]]  # at the poles of a sphere
        there, back = {tuple(e) for e in edges.tolist()}, {tuple(e[::-1]) for e in edges.tolist()}
        assert there == back


@pytest.mark.parametrize("name", CATALOG)
def test_labels_do_not_overlap(name):
    platform = Platform.load(name)
    frame = meshes.Frame.of(platform)
    places = meshes.label_places(frame.drawn(platform.base))
    gaps = np.linalg.norm(places[:, None] - places[None], axis=-1) + np.eye(6)
    assert gaps.min() > 0.9 * meshes.LABEL_GAP
    reach = np.linalg.norm(places - frame.drawn(platform.base), axis=-1)
    assert reach.max() < 3 * meshes.LABEL_GAP


def test_labels_of_joints_at_one_point_are_moved_apart():
    places = meshes.label_places(np.zeros((6, 3)))
    gaps = np.linalg.norm(places[:, None] - places[None], axis=-1) + np.eye(6)
    assert gaps.min() > 0.5 * meshes.LABEL_GAP


def test_the_unit_of_length_changes_no_picture():
    platform = Platform.load("rubin_camera")
    pose = platform.sample_poses(1, seed=0)[0]
    pictures = []
    for factor in (1.0, 1e3, 1e-6):
        machine = scaled(platform, factor)
        there = gough.Pose(factor * pose.position, pose.wxyz)
        parts = meshes.limbs(machine, there, gough.leg_lengths(machine, there))
        pictures.append(np.array([meshes.Frame.of(machine).drawn(p) for p in parts]))
    np.testing.assert_allclose(pictures[1], pictures[0], atol=1e-9)
    np.testing.assert_allclose(pictures[2], pictures[0], atol=1e-9)
    assert np.abs(pictures[0]).max() < 2


@pytest.mark.parametrize(
    ("value", "round_one"), [(0.83, 0.5), (1.0, 1.0), (99, 50), (0.002, 0.002), (730, 500)]
)
def test_grids_have_round_cells(value, round_one):
    assert meshes.round_number(value) == pytest.approx(round_one)


# ---- with a server, without a browser --------------------------------------------------


@pytest.mark.parametrize("seed", range(6))
def test_the_handle_is_where_the_plate_is(server, seed):
    kind = ("telescopic", "length_change", "rotary")[seed % 3]
    platform = random_platform(seed, kind)
    scene = Scene(server, platform)
    assert scene.handle is not None
    pose = platform.sample_poses(3, seed=seed)[2]
    scene.draw(pose, gough.leg_lengths(platform, pose))
    back = scene.pose_of_handle(np.array(scene.handle.position), np.array(scene.handle.wxyz))
    shift, turn = back.distance(pose)
    assert shift <= 1e-9 * platform.size
    assert turn <= 1e-9
    hub = gough.joint_positions(platform, pose).mean(axis=0)
    np.testing.assert_allclose(scene.handle.position, scene.frame.drawn(hub), atol=1e-9)


def test_a_dragged_handle_is_left_where_it_is(server):
    platform = Platform.load("reference")
    scene = Scene(server, platform)
    assert scene.handle is not None
    before = np.array(scene.handle.position)
    pose = platform.sample_poses(1, seed=0)[0]
    scene.draw(pose, gough.leg_lengths(platform, pose), handle=False)
    np.testing.assert_array_equal(scene.handle.position, before)


def test_legs_out_of_stroke_say_so(server):
    platform = Platform.load("rubin_camera")
    scene = Scene(server, platform)
    pose = gough.Pose((0.0, 0.0, 0.03))
    scene.draw(pose, gough.leg_lengths(platform, pose))
    texts = [label.text for label in scene._labels]
    assert texts == [f"{i} outside stroke" for i in range(1, 7)]
    scene.draw(platform.home, platform.home_legs)
    assert [label.text for label in scene._labels] == list("123456")


def test_there_is_a_ghost_for_each_mode(server):
    platform = Platform.load("reference")
    scene = Scene(server, platform)
    modes = gough.assembly_modes(platform, platform.home_legs)
    scene.show_modes(modes.pose, modes.legs, modes.sign, None)
    plates, rods = scene._modes
    assert plates.batched_positions.shape == (len(modes), 3)
    assert rods.points.shape == (6 * len(modes), 2, 3)
    ends = scene.frame.drawn(gough.joint_positions(platform, modes.pose)).reshape(-1, 3)
    np.testing.assert_allclose(rods.points[:, 1], ends, atol=1e-6)
    scene.clear_modes()
    assert server.scene.get_handle_by_name("/modes/plates") is None
