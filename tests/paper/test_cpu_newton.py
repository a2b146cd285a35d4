"""The one-by-one Newton method: its Jacobian, its ends, and that it agrees with the solver."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gough
from gough.paper.methods import Equations, cpu_newton, scipy_root

MACHINES = ("reference", "rubin_camera", "reachy_mini", "dietmaier")


@pytest.mark.parametrize("name", MACHINES)
@given(seed=st.integers(0, 10_000))
def test_jacobian_is_the_slope_of_the_errors(name, seed):
    machine = gough.Platform.load(name)
    pose = machine.sample_poses(1, seed=seed)
    legs, xi = gough.leg_lengths(machine, pose)[0], pose.log()[0]
    equations = Equations(machine, legs)
    errors, J = equations(xi)
    steps = 1e-6 * np.concatenate([np.full(3, machine.size), np.ones(3)])
    slope = [
        (equations(xi + h * e)[0] - equations(xi - h * e)[0]) / (2 * h)
        for h, e in zip(steps, np.eye(6), strict=True)
    ]
    assert np.abs(errors).max() < 1e-12 * machine.size
    assert np.abs(J - np.transpose(slope)).max() < 1e-8 * np.abs(J).max()


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize(
    ("refine", "gamma", "within"),
    # finer, MINPACK sees no progress any more where lengths and angles differ much in size
    [(cpu_newton, 1e-8, 1e-9), (scipy_root, 1e-6, 1e-6)],
)
def test_agrees_with_the_solver(name, refine, gamma, within):
    machine = gough.Platform.load(name)
    truth = machine.sample_poses(20, seed=3)
    legs = gough.leg_lengths(machine, truth)
    guess = gough.PolynomialSeed(machine, 3).guess(legs)
    end = refine(machine, guess, legs, gamma=gamma * machine.size)
    solved = gough.solve(machine, legs).pose
    away, angle = end.pose.distance(solved)
    assert end.converged.all()
    assert not end.singular.any()
    assert away.max() < within * machine.size
    assert angle.max() < within


def test_finer_gamma_takes_no_fewer_iterations_and_squares_the_step():
    machine = gough.Platform.load("reference")
    truth = machine.sample_poses(50, seed=1)
    legs = gough.leg_lengths(machine, truth)
    ends = [
        cpu_newton(machine, machine.sample_poses(50, seed=2), legs, gamma=g)
        for g in (1e-1, 1e-4, 1e-10)
    ]
    counts = [end.iterations for end in ends]
    assert np.all(counts[0] <= counts[1])
    assert np.all(counts[1] <= counts[2])
    both = ends[0].converged & ends[2].converged
    assert np.all((counts[2] - counts[0])[both] <= 4)  # quadratic: nine decades in four steps


def test_a_singular_start_is_named_and_the_others_go_on():
    machine = gough.Platform.load("reference")
    truth = machine.sample_poses(3, seed=1)
    legs = gough.leg_lengths(machine, truth)
    position = np.array(truth.position)
    turns = np.array(truth.rotation_vector)
    # a plate in the base's plane, not turned, is singular: all struts lie in one plane
    position[1], turns[1] = [0, 0, -machine.moving[0, 2]], 0
    guess = gough.Pose.from_rotation_vector(position, turns)
    end = cpu_newton(machine, guess, legs, gamma=1e-6)
    assert end.singular.tolist() == [False, True, False]
    assert end.converged.tolist() == [True, False, True]


def test_iterations_are_bounded():
    machine = gough.Platform.load("reference")
    legs = gough.leg_lengths(machine, machine.home)[None]
    guess = machine.sample_poses(1, seed=4)
    end = cpu_newton(machine, guess, legs, gamma=1e-12, z_max=2)
    assert end.iterations.tolist() == [2]
    assert not end.converged.any()
