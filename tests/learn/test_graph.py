import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from learn.networks import reference
from machines import random_platform, with_some_workspace

from gough import Platform, leg_lengths
from gough.learn.data import HexapodGraph, edge_lengths


@pytest.mark.parametrize("name", Platform.catalog())
def test_every_platform_has_six_leg_edges_and_two_rings_of_six(name):
    graph = HexapodGraph.of(Platform.load(name))
    assert graph.legs.tolist() == [[i, i + 6] for i in range(6)]
    assert graph.rings.shape == (12, 2)
    assert graph.adjacency.sum() == 2 * 18
    # each hinge has its two neighbours and its leg
    assert (graph.adjacency.sum(0) == 3).all()
    assert not graph.adjacency[:6, :6].diagonal().any()


def test_matrix_holds_the_distances_of_the_edges_and_zeros_elsewhere():
    platform = reference()
    pose = platform.sample_poses(5, seed=1)
    graph = HexapodGraph.of(platform)
    E = graph.matrix(edge_lengths(platform, leg_lengths(platform, pose)))
    moved = pose.rotation @ platform.moving.T
    for n in range(5):
        points = np.vstack([platform.base, moved[n].T + pose.position[n]])
        distance = np.linalg.norm(points[:, None] - points[None], axis=-1)
        np.testing.assert_allclose(E[n], np.where(graph.adjacency, distance, 0), atol=1e-9)


def test_rings_leave_out_the_longer_links():
    graph = HexapodGraph.of(reference())
    lengths = np.unique(np.round(graph.constant[graph.constant > 0], 2))
    # chords of 40 and 80 deg on circles of 400 and 150 mm
    expected = [2 * r * np.sin(np.radians(a)) for r in (150, 400) for a in (20, 40)]
    np.testing.assert_allclose(lengths, expected, atol=0.02)


@settings(max_examples=20)
@given(st.integers(0, 10**6))
def test_rings_do_not_depend_on_the_order_of_the_legs(seed):
    rng = np.random.default_rng(seed)
    platform = random_platform(seed)
    order = rng.permutation(6)
    shuffled = Platform(platform.base[order], platform.moving[order], home=platform.home)
    a, b = HexapodGraph.of(platform).constant, HexapodGraph.of(shuffled).constant
    both = np.concatenate([order, order + 6])
    np.testing.assert_allclose(b, a[np.ix_(both, both)], atol=1e-9)


@pytest.mark.parametrize("name", Platform.catalog())
def test_edge_lengths_grow_with_the_readings(name):
    platform = with_some_workspace(Platform.load(name))
    legs = leg_lengths(platform, platform.sample_poses(20, seed=0))
    legs = legs[np.isfinite(legs).all(-1)]
    lengths = edge_lengths(platform, legs)
    assert (lengths > 0).all()
    assert (np.diff(edge_lengths(platform, np.stack([legs, legs + 1e-3])), axis=0) > 0).all()
    np.testing.assert_allclose(edge_lengths(platform, platform.home_legs), platform.home_lengths)
