"""Poses from readings: round trips, statuses, and all that a user may hand in."""

import os
import subprocess
import sys
from dataclasses import replace

import machines
import numpy as np
import pytest
import support
from hypothesis import given
from hypothesis import strategies as st

import gough
from gough import Status
from gough.kinematics import equivalent_struts

CATALOG = gough.Platform.catalog()
BATCHES = [(), (1,), (3, 1, 2, 1), (0,)]


def _legs(platform, count=500, seed=0):
    pose = platform.sample_poses(count, seed)
    return pose, gough.leg_lengths(platform, pose)


# ---- round trips ----------------------------------------------------------------------


@pytest.mark.parametrize("name", CATALOG)
def test_round_trip_over_the_whole_workspace(name):
    """The acceptance test: pose -> legs -> pose, to 1e-10 of the size, or a status why not."""
    platform = gough.Platform.load(name)
    pose, legs = _legs(platform, 20_000, seed=7)
    solution = gough.solve(platform, legs)
    shift, turn = solution.pose.distance(pose)
    assert np.all(solution.usable)
    assert shift.max() <= 1e-10 * platform.size
    assert turn.max() <= 1e-10
    assert solution.residual.max() <= 1e-12 * platform.size
    stroke = platform.stroke
    if stroke is not None:
        out = np.any((legs < stroke[:, 0]) | (legs > stroke[:, 1]), axis=-1)
        np.testing.assert_array_equal(solution.status == Status.OUTSIDE_STROKE, out)


@pytest.mark.parametrize("seed", ["auto", "home", "polynomial", "polynomial-2", "polynomial-5"])
def test_every_seed_ends_at_the_true_pose(seed):
    platform = gough.Platform.load("reference")
    pose, legs = _legs(platform, 2_000)
    solution = gough.solve(platform, legs, seed=seed)
    assert np.all(solution.status == Status.CONVERGED)
    assert solution.pose.distance(pose)[0].max() < 1e-10 * platform.size


def test_motor_angles_to_head_pose_and_back():
    platform = gough.Platform.load("reachy_mini")
    _, angles = _legs(platform, 1_000)
    back = gough.leg_lengths(platform, gough.solve(platform, angles).pose)
    np.testing.assert_allclose(back, angles, atol=1e-12)


def test_simulink_case_backwards():
    """hexapod_kin_calc.slx through lsst-ts/ts_mthexapod, tests/test_simple_hexapod.py."""
    platform = gough.Platform.load("rubin_simulink")
    deltas = [0.15205, 0.07204, -0.04667, 0.13381, 0.02959, -0.07292]
    solution = gough.solve(platform, deltas)
    assert solution.status == Status.CONVERGED
    found = np.concatenate([solution.pose.position, solution.pose.euler])
    expected = [-0.0603, 0.1045, -0.0109, -0.0355, -0.0205, -0.0004]
    # the deltas are printed to 5 digits; the pose's 4 come back, as the source's own test asks
    np.testing.assert_array_equal(np.round(found, 4), expected)


# ---- shapes and order -----------------------------------------------------------------


@pytest.mark.parametrize("batch", BATCHES)
def test_batch_axes_are_kept(batch):
    platform = gough.Platform.load("matlab_stewart")
    count = int(np.prod(batch))
    pose, legs = _legs(platform, max(count, 1))
    legs = legs[:count].reshape(*batch, 6)
    solution = gough.solve(platform, legs, leg_noise=1e-4)
    assert solution.pose.position.shape == (*batch, 3)
    assert solution.pose.wxyz.shape == (*batch, 4)
    assert np.shape(solution.status) == batch
    assert solution.residual.shape == solution.iterations.shape == batch
    assert solution.covariance is not None
    assert solution.covariance.shape == (*batch, 6, 6)
    if count:
        np.testing.assert_allclose(
            solution.pose.position.reshape(-1, 3), pose.position[:count], atol=1e-10
        )


@pytest.mark.parametrize("name", ["reference", "reachy_mini", "rubin_camera"])
def test_a_row_does_not_depend_on_its_neighbours(name):
    platform = gough.Platform.load(name)
    _, legs = _legs(platform, 300)
    legs[40] = np.nan
    legs[50] *= 3
    together = gough.solve(platform, legs)
    for part in (1, 7, 64):
        apart = [gough.solve(platform, legs[i : i + part]) for i in range(0, 300, part)]
        position = np.concatenate([s.pose.position for s in apart])
        np.testing.assert_array_equal(position, together.pose.position)
        wxyz = np.concatenate([s.pose.wxyz for s in apart])
        np.testing.assert_array_equal(wxyz, together.pose.wxyz)
        np.testing.assert_array_equal(
            np.concatenate([s.iterations for s in apart]), together.iterations
        )


@pytest.mark.slow
@pytest.mark.process
def test_compiling_anew_changes_nothing_beyond_rounding(tmp_path):
    """A process that compiles and one that loads the compiled code agree.

    To the bit in the block solver; the row solver's functions may be fused differently when they
    are compiled beside it, which changes last digits (docs/solver.md).
    """
    code = (
        "import gough, sys, numpy as np\n"
        "p = gough.Platform.load('rubin_camera')\n"
        "for count in (500, 2000):\n"
        "    s = gough.solve(p, gough.leg_lengths(p, p.sample_poses(count)))\n"
        "    np.save(f'{sys.argv[1]}-{count}', np.concatenate([s.pose.position, s.pose.wxyz], 1))\n"
    )
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "numba")}
    for name in ("compiled", "loaded"):
        words = [sys.executable, "-c", code, str(tmp_path / name)]
        subprocess.run(words, env=environment, check=True)
    assert len(list(tmp_path.rglob("*.nbc"))) > 0
    few, many = (
        [np.load(tmp_path / f"{name}-{count}.npy") for name in ("compiled", "loaded")]
        for count in (500, 2000)
    )
    np.testing.assert_array_equal(*many)
    np.testing.assert_allclose(*few, rtol=0, atol=1e-14)


def test_threads_change_nothing():
    platform = gough.Platform.load("reference")
    _, legs = _legs(platform, 40_000)
    legs[::50] += 30
    one, two = (gough.solve(platform, legs, workers=n) for n in (1, 2))
    np.testing.assert_array_equal(one.pose.wxyz, two.pose.wxyz)
    np.testing.assert_array_equal(one.status, two.status)


def test_the_readings_are_not_written_to():
    platform = gough.Platform.load("reference")
    _, legs = _legs(platform, 10)
    legs.flags.writeable = False
    gough.solve(platform, legs)
    gough.solve(platform, np.asfortranarray(legs))


@pytest.mark.parametrize("dtype", [np.float32, np.float64, object, int])
def test_number_types(dtype):
    platform = gough.Platform.load("reference")
    legs = np.full((2, 6), 655).astype(dtype)
    assert np.all(gough.solve(platform, legs).status == Status.CONVERGED)


# ---- statuses -------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["reference", "rubin_camera", "reachy_mini"])
@pytest.mark.parametrize("leg", range(6))
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_readings_that_are_no_numbers(name, leg, value):
    platform = gough.Platform.load(name)
    _, legs = _legs(platform, 70)
    legs[3, leg] = value
    solution = gough.solve(platform, legs)
    assert solution.status[3] == Status.INVALID_INPUT
    assert np.all(np.isnan(solution.pose.position[3]))
    assert np.all(np.isnan(solution.pose.wxyz[3]))
    assert np.isnan(solution.residual[3])
    assert solution.iterations[3] == 0
    assert np.sum(solution.status == Status.INVALID_INPUT) == 1
    assert np.all(np.isfinite(np.delete(solution.pose.wxyz, 3, axis=0)))


@pytest.mark.parametrize("value", [0.0, -1.0, -655.5])
def test_lengths_that_are_none(value):
    platform = gough.Platform.load("reference")
    legs = np.tile(platform.home_legs, (3, 1))
    legs[1, 4] = value
    np.testing.assert_array_equal(gough.solve(platform, legs).status, [0, 6, 0])
    # for length changes a negative reading is as good as any
    camera = gough.Platform.load("rubin_camera")
    assert gough.solve(camera, np.full(6, -0.005)).status == Status.CONVERGED
    assert gough.solve(camera, np.full(6, -50.0)).status == Status.INVALID_INPUT


@support.at_most(40)
@given(
    st.lists(
        st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=6, max_size=6),
        min_size=1,
        max_size=5,
    ),
    st.sampled_from(["reference", "reachy_mini", "rubin_camera"]),
)
def test_nothing_converged_is_wrong_whatever_comes_in(rows, name):
    platform = gough.Platform.load(name)
    legs = np.array(rows)
    solution = gough.solve(platform, legs, restarts=2)
    solved = np.isin(solution.status, [*gough.Status][:4])
    assert np.all(np.isfinite(solution.pose.position[solved]))
    assert np.all(solution.residual[solved] <= 1e-12 * platform.size)
    base, lengths = equivalent_struts(platform, legs[solved])
    joints = gough.joint_positions(platform, solution.pose[solved])
    real = np.linalg.norm(joints - base, axis=-1)
    assert np.all(np.abs(real - lengths) <= 4e-12 * platform.size)
    np.testing.assert_array_equal(
        solution.status[~np.all(np.isfinite(legs), axis=-1)], Status.INVALID_INPUT
    )


def test_unreachable_says_by_how_much():
    """The residual is that of SciPy's least-squares pose; the row has no pose."""
    from scipy.optimize import least_squares

    platform = gough.Platform.load("matlab_stewart")
    legs = platform.home_legs + np.array([0, 0, 0, 0, 0, 2.5])
    solution = gough.solve(platform, legs)
    assert solution.status == Status.UNREACHABLE

    def errors(x):
        pose = gough.Pose.from_rotation_vector(x[:3], x[3:])
        return gough.leg_lengths(platform, pose) - legs

    assert np.isnan(solution.pose.position).all()
    rng = np.random.default_rng(0)
    starts = [np.r_[0, 0, 2, 0, 0, 0] + 0.4 * rng.normal(size=6) for _ in range(20)]
    best = min((least_squares(errors, x, xtol=1e-12) for x in starts), key=lambda fit: fit.cost)
    assert solution.residual == pytest.approx(np.abs(best.fun).max(), rel=1e-3)


@pytest.mark.parametrize("factor", [25.4, 1000.0, 15.25])
def test_legs_that_none_could_have_are_no_pose(factor):
    """Up to the height of 9999: on the straight way from home, and yet impossible."""
    platform = gough.Platform.load("reference")
    solution = gough.solve(platform, platform.home_legs * factor)
    assert solution.status == Status.UNREACHABLE
    assert np.isnan(solution.pose.position).all()
    assert solution.iterations < 100


@pytest.mark.parametrize("factor", [1e-3, 1e3, 25.4, 1 / 25.4])
def test_a_wrong_unit_is_noticed(factor):
    platform = gough.Platform.load("reference")
    _, legs = _legs(platform, 50)
    solution = gough.solve(platform, legs * factor)
    assert not np.any(solution.usable)
    assert set(solution.counts()) <= {Status.UNREACHABLE, Status.NOT_CONVERGED}


def test_another_mode_is_reported_and_kept_when_asked_for():
    """The mirror image below the base has the same legs, and is not the machine's pose."""
    platform = gough.Platform.load("reference")
    pose, legs = _legs(platform, 20)
    w, x, y, z = pose.wxyz.T
    mirror = gough.Pose(pose.position * [1, 1, -1], np.stack([w, -x, -y, z], axis=-1))
    np.testing.assert_allclose(gough.leg_lengths(platform, mirror), legs, rtol=1e-12)
    solution = gough.solve(platform, legs, seed=mirror)
    assert np.all(solution.status == Status.OTHER_MODE)
    assert solution.pose.distance(mirror)[0].max() < 1e-9
    assert np.all(gough.solve(platform, legs).status == Status.CONVERGED)


def test_near_a_singularity():
    """Fichter's: a platform turned by 90 deg about its normal is singular."""
    angles = np.radians([-20, 20, 100, 140, 220, 260])
    ring = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=-1)
    platform = gough.Platform(2 * ring, np.roll(ring, 1, axis=0), (0, 0, 2))
    turn = np.linspace(-150, 150, 2001)
    pose = gough.Pose.from_euler([0, 0, 2], np.radians(np.stack([0 * turn, 0 * turn, turn], -1)))
    distance = gough.singularity_distance(platform, pose)
    worst = pose[int(np.argmin(distance))]
    assert gough.singularity_distance(platform, worst) < 1e-3
    solution = gough.solve(platform, gough.leg_lengths(platform, worst), seed=worst)
    assert solution.status in (Status.NEAR_SINGULARITY, Status.OTHER_MODE)
    assert solution.residual <= 1e-12 * platform.size
    asked = gough.solve(platform, platform.home_legs, singular=0.999)
    assert asked.status == Status.NEAR_SINGULARITY
    assert gough.solve(platform, platform.home_legs, singular=0.0).status == Status.CONVERGED


def test_near_singularity_is_what_the_measure_says():
    platform = gough.Platform.load("reference").with_workspace(120, 33)
    _, legs = _legs(platform, 5_000)
    threshold = 0.05
    solution = gough.solve(platform, legs, singular=threshold)
    near = gough.singularity_distance(platform, solution.pose) < threshold
    judged = np.isin(solution.status, [Status.CONVERGED, Status.NEAR_SINGULARITY])
    assert np.sum(near & judged) > 10
    np.testing.assert_array_equal(
        (solution.status == Status.NEAR_SINGULARITY)[judged], near[judged]
    )


def test_wide_workspace_mostly_true():
    """Where seeds matter: +-100 mm, +-60 deg, poses on home's side of the singularities."""
    platform = gough.Platform.load("reference").with_workspace(100, 60)
    pose, legs = _legs(platform, 20_000)
    ours = gough.assembly_sign(platform, pose) > 0
    solution = gough.solve(platform, legs[ours])
    true = solution.pose.distance(pose[ours])[0] < 1e-6 * platform.size
    assert np.mean(true) > 0.999
    # those that are not are hardly ever called usable
    assert np.mean(solution.usable & ~true) < 1e-3


# ---- options --------------------------------------------------------------------------


def test_no_iterations_gives_the_guess_itself():
    platform = gough.Platform.load("reference")
    pose, legs = _legs(platform, 200)
    seed = gough.PolynomialSeed(platform, 5)
    guess = gough.solve(platform, legs, seed="polynomial-5", max_iterations=0)
    np.testing.assert_allclose(guess.pose.position, seed.guess(legs).position, rtol=1e-13)
    assert np.all(guess.status == Status.NOT_CONVERGED)
    assert np.all(guess.iterations == 0)
    misses = np.abs(gough.leg_lengths(platform, guess.pose) - legs).max(axis=-1)
    np.testing.assert_allclose(guess.residual, misses, rtol=1e-9)
    assert 0.05 < guess.pose.distance(pose)[0].mean() < 1
    exact = gough.solve(platform, legs, seed=pose, max_iterations=0)
    assert np.all(exact.status == Status.CONVERGED)


def test_few_iterations_are_few():
    platform = gough.Platform.load("reference")
    _, legs = _legs(platform, 200)
    solution = gough.solve(platform, legs, seed="home", max_iterations=2, restarts=0)
    assert np.any(solution.status == Status.NOT_CONVERGED)


def test_tolerance_is_kept():
    platform = gough.Platform.load("reference")
    _, legs = _legs(platform, 200)
    loose = gough.solve(platform, legs, seed="home", tolerance=1e-3)
    assert loose.residual.max() <= 1e-3 * platform.size
    assert np.all(gough.solve(platform, legs, tolerance=1e-15).residual < 1e-14 * platform.size)


def test_given_poses_start_each_row():
    platform = gough.Platform.load("reference")
    pose, legs = _legs(platform, 100)
    near = gough.Pose(pose.position + 0.01, pose.wxyz)
    solution = gough.solve(platform, legs, seed=near)
    assert solution.iterations.max() <= 3
    with pytest.raises(gough.GoughError, match=r"one pose or 100.*batch \(99,\)"):
        gough.solve(platform, legs, seed=near[:99])


class _Liar:
    """A seed whose guesses are nonsense."""

    name = "liar"

    def guess(self, legs):
        position = np.full((len(legs), 3), 1e6)
        position[::3] = np.nan
        return gough.Pose(position)


def test_a_useless_seed_does_not_mislead():
    platform = gough.Platform.load("reference")
    pose, legs = _legs(platform, 50)
    solution = gough.solve(platform, legs, seed=_Liar())
    solved = solution.status == Status.CONVERGED
    assert np.mean(solved) > 0.9
    assert solution.pose.distance(pose)[0][solved].max() < 1e-9


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"tolerance": -1}, "tolerance: expected 0 to 1, found -1"),
        ({"tolerance": float("nan")}, "tolerance: expected 0 to 1, found nan"),
        ({"max_iterations": -1}, "max_iterations: expected a whole number from 0 to"),
        ({"restarts": 1e9}, "restarts"),
        ({"seed": "magic"}, "unknown name 'magic'; expected auto, home"),
        ({"seed": "polynomial-9"}, "degree: expected 0 to 7, found 9"),
        ({"seed": 3}, "expected a name, a Pose or an object"),
        ({"leg_noise": -1}, "leg_noise"),
    ],
)
def test_wrong_options(options, text):
    platform = gough.Platform.load("reference")
    with pytest.raises(gough.GoughError, match=text):
        gough.solve(platform, platform.home_legs, **options)


@pytest.mark.parametrize(
    "legs", [np.zeros(5), np.zeros((6, 5)), 3.0, "abc", [[1, 2, 3, 4, 5, "x"]]]
)
def test_wrong_legs(legs):
    with pytest.raises(gough.GoughError, match="legs"):
        gough.solve(gough.Platform.load("reference"), legs)


def test_a_polynomial_needs_a_workspace():
    bare = machines.general_platform(0)
    with pytest.raises(gough.PlatformError, match="workspace"):
        gough.solve(bare, bare.home_legs, seed="polynomial")
    assert gough.solve(bare, bare.home_legs).status == Status.CONVERGED


def test_covariance_is_the_functions():
    platform = gough.Platform.load("rubin_camera")
    _, legs = _legs(platform, 10)
    legs[3] = np.nan
    solution = gough.solve(platform, legs, leg_noise=1e-6)
    expected = gough.pose_covariance(platform, solution.pose, 1e-6)
    np.testing.assert_array_equal(solution.covariance, expected)
    assert solution.covariance is not None
    np.testing.assert_array_equal(
        np.isnan(solution.covariance).any(axis=(1, 2)), np.arange(10) == 3
    )


def test_solutions_can_be_read():
    platform = gough.Platform.load("reference")
    _, legs = _legs(platform, 4)
    legs[2] = np.nan
    solution = gough.solve(platform, legs)
    assert repr(solution) == "Solution(batch (4,); converged: 3, invalid_input: 1)"
    assert solution.counts() == {Status.CONVERGED: 3, Status.INVALID_INPUT: 1}
    assert repr(solution[0]).startswith("Solution(converged, Pose(position=(")
    assert len(solution[:2].pose) == 2
    np.testing.assert_array_equal(solution.usable, [True, True, False, True])


# ---- certificates ---------------------------------------------------------------------


@pytest.mark.parametrize("name", CATALOG)
def test_proven_poses_are_the_true_ones(name):
    platform = gough.Platform.load(name)
    pose, legs = _legs(platform, 2_000)
    solution = gough.solve(platform, legs, certify=True)
    assert solution.radius is not None
    proven = solution.radius > 0
    assert np.mean(proven) > 0.999
    assert np.all(solution.usable)
    converged = gough.solve(platform, legs).status == Status.CONVERGED
    np.testing.assert_array_equal(solution.status == Status.CERTIFIED, converged & proven)
    assert solution.pose.distance(pose)[0][proven].max() < 1e-10 * platform.size


def test_what_has_no_pose_is_not_certified():
    platform = gough.Platform.load("reference")
    _, legs = _legs(platform, 6)
    legs[1], legs[3] = np.nan, legs[3] + np.array([0, 0, 0, 0, 0, 400.0])
    solution = gough.solve(platform, legs, certify=True)
    assert solution.radius is not None
    np.testing.assert_array_equal(solution.radius > 0, [True, False, True, False, True, True])
    np.testing.assert_array_equal(solution.status[[1, 3]], [6, 4])
    loose = gough.solve(platform, legs[0] + 5, tolerance=1e-2, certify=True)
    assert loose.residual > 0 or loose.status == Status.CERTIFIED
    assert gough.solve(platform, legs[0], certify=True).status == Status.CERTIFIED
    assert gough.solve(platform, legs[0]).radius is None


# ---- networks -------------------------------------------------------------------------


def test_the_papers_two_stages():
    platform = gough.Platform.load("reference")
    pose, legs = _legs(platform, 2_000)
    legs[5] = np.nan
    solution = gough.solve(platform, legs, seed="disgnet")
    good = np.arange(2_000) != 5
    assert np.all(solution.status[good] == Status.CONVERGED)
    assert solution.pose.distance(pose)[0][good].max() < 1e-9
    assert solution.status[5] == Status.INVALID_INPUT
    with pytest.raises(gough.GoughError, match="platform 'rubin_camera' as it is now"):
        gough.solve(gough.Platform.load("rubin_camera"), np.zeros(6), seed="disgnet")
    with pytest.raises(gough.GoughError, match="runs/none: no such run's folder"):
        gough.solve(platform, legs, seed="runs/none")


# ---- what else could it be ------------------------------------------------------------


def test_ambiguous_readings_are_called_so():
    """Dietmaier's forty poses, some of which only a stated workspace could tell from home."""
    stated = gough.Platform.load("dietmaier")
    free = replace(stated, workspace=None)
    count = int(gough.choose_mode(gough.assembly_modes(free, free.home_legs)).count)
    assert count > 1
    assert gough.solve(free, free.home_legs).status == Status.CONVERGED
    solution = gough.solve(free, [free.home_legs, np.full(6, np.nan)], ambiguous=True)
    np.testing.assert_array_equal(solution.status, [Status.AMBIGUOUS, Status.INVALID_INPUT])
    assert not np.any(solution.usable)
    assert gough.solve(stated, stated.home_legs, ambiguous=True).status == Status.CONVERGED
    reference = gough.Platform.load("reference")
    _, legs = _legs(reference, 50)
    solution = gough.solve(reference, legs, ambiguous=True, certify=True)
    assert np.all(solution.status == Status.CERTIFIED)


@pytest.mark.parametrize("axis", range(6))
@pytest.mark.parametrize("side", [-1, 1])
def test_the_workspace_is_the_one_stated(axis, side):
    """A lopsided box about a turned home: the compiled test agrees with the plain one."""
    turn = gough.Pose.from_euler(np.zeros(3), [0.1, -0.05, 0.4]).wxyz
    plain = gough.Platform.load("reference")
    box = gough.Workspace([[-20, 35], [-30, 15], [-10, 40]], [[-8, 14], [-12, 5], [-20, 9]])
    platform = gough.Platform(
        plain.base, plain.moving, gough.Pose([5, -8, 590], turn), workspace=box
    )
    limits = np.concatenate([box.translation, np.radians(box.rotation_deg)])
    center, half = limits.mean(axis=1), np.diff(limits, axis=1)[:, 0] / 2
    x = np.tile(center, (4, 1))
    x[:, axis] += side * half[axis] * np.array([0.5, 0.99, 1.01, 1.5])
    home = gough.Pose(np.zeros(3), turn)
    pose = gough.Pose(
        platform.home.position + x[:, :3],
        (home @ gough.Pose.from_euler(np.zeros(3), x[:, 3:])).wxyz,
    )
    np.testing.assert_array_equal(platform.in_workspace(pose), [True, True, False, False])
    solution = gough.solve(platform, gough.leg_lengths(platform, pose), seed=pose)
    np.testing.assert_array_equal(solution.status, [0, 0, 3, 3])
