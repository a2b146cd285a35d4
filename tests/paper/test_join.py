"""The benchmark for other people's methods."""

import numpy as np
import pytest

import gough
from gough.paper import benchmark as join
from gough.paper.benchmark import Benchmark, benchmark, score


@pytest.fixture(scope="module")
def small():
    machine = gough.Platform.load("reference")
    truth = machine.sample_poses(300, seed=9)
    return Benchmark("paper", machine, truth, gough.leg_lengths(machine, truth))


def test_the_truth_scores_perfectly(small):
    found = score(lambda legs: small.truth, small, "truth")
    assert found.metrics.trans_mean == 0
    assert found.newton.share == 1
    assert found.answered == 300
    assert str(found).startswith("truth, 300 poses, 300 answered")


@pytest.mark.parametrize("form", ["pose", "matrices", "pair"])
def test_all_forms_of_an_answer_mean_the_same(small, form):
    pose = gough.solve(small.platform, small.legs, max_iterations=0).pose
    answer = {
        "pose": pose, "matrices": pose.matrix, "pair": (pose.position, -2 * pose.wxyz),
    }[form]  # fmt: skip
    wanted = score(lambda legs: pose, small).metrics
    assert score(lambda legs: answer, small).metrics.trans_mean == wanted.trans_mean
    np.testing.assert_allclose(
        score(lambda legs: answer, small).metrics.rot_mean, wanted.rot_mean, rtol=1e-9
    )


def test_no_answer_counts_as_home(small):
    def every_second(legs):
        position, wxyz = np.array(small.truth.position), np.array(small.truth.wxyz)
        position[::2] = np.nan
        return position, wxyz

    found = score(every_second, small)
    away, _ = small.truth[::2].distance(small.platform.home)
    assert found.answered == 150
    assert found.name == "every_second"
    np.testing.assert_allclose(found.metrics.trans_mean, away.sum() / 300)


def test_a_method_cannot_change_the_test_set(small):
    before = small.checksum

    def vandal(legs):
        legs[:] = 0
        return small.truth

    score(vandal, small)
    assert small.checksum == before


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (np.zeros((300, 7)), r"expected a Pose, matrices \(300, 4, 4\).*got \(300, 7\)"),
        ((np.zeros((300, 3)), np.zeros((300, 3, 3))), r"quaternions \(300, 4\), got"),
        (np.zeros((299, 4, 4)), r"got \(299, 4, 4\)"),
    ],
)
def test_wrong_shapes_are_told(small, answer, words):
    with pytest.raises(gough.GoughError, match=words):
        score(lambda legs: answer, small)


def test_the_checksum_sees_a_changed_row_but_not_the_last_bit(small):
    legs = np.array(small.legs)
    nudged = Benchmark("paper", small.platform, small.truth, np.nextafter(legs, np.inf))
    assert nudged.checksum == small.checksum
    legs[17, 3] += 0.01
    assert Benchmark("paper", small.platform, small.truth, legs).checksum != small.checksum


def test_a_machine_that_makes_other_poses_is_refused(monkeypatch):
    monkeypatch.setitem(join.CHECKSUMS, "paper", "0" * 64)
    with pytest.raises(gough.GoughError, match="has checksum 107c138fada4 here"):
        benchmark("paper")


def test_an_unknown_set_is_told():
    with pytest.raises(gough.GoughError, match="expected one of paper, wide, got 'narrow'"):
        benchmark("narrow")


@pytest.mark.slow
def test_the_wide_set_is_what_its_checksum_says():
    found = benchmark("wide")
    assert found.legs.shape == (100_000, 6)
    assert np.all(gough.assembly_sign(found.platform, found.truth[:1000]) > 0)
