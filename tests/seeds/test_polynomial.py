"""First guesses: what a polynomial is worth, and where it is kept."""

from dataclasses import replace

import numpy as np
import pytest

import gough
from gough import quaternion
from gough.seeds import polynomial


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("GOUGH_CACHE_DIR", str(tmp_path / "cache"))
    polynomial.fitted.cache_clear()
    yield tmp_path / "cache"
    polynomial.fitted.cache_clear()


@pytest.mark.parametrize("degree", range(5))
def test_monomials_are_all_there_once(degree):
    """Their values at a point with prime coordinates are all different and all products."""
    rng = np.random.default_rng(0)
    u = rng.uniform(0.5, 1.5, size=(1, 6))
    values = polynomial._terms(u, degree)[0]
    assert len(values) == polynomial.count(degree)
    assert len(np.unique(np.round(values, 12))) == len(values)
    # the sum over all monomials up to a degree is a coefficient of a generating function
    series = np.array([1.0])
    for x in u[0]:
        series = np.convolve(series, x ** np.arange(degree + 1))[: degree + 1]
    assert np.sum(values) == pytest.approx(series.sum(), rel=1e-12)


@pytest.mark.parametrize(("degree", "shift"), [(3, 1.51), (4, 0.747), (5, 0.433)])
def test_errors_over_the_reference_workspace(degree, shift):
    """Mean translation error [mm] as found independently before this library existed."""
    platform = gough.Platform.load("reference")
    pose = platform.sample_poses(10_000, seed=5)
    guess = gough.PolynomialSeed(platform, degree).guess(gough.leg_lengths(platform, pose))
    assert np.mean(guess.distance(pose)[0]) == pytest.approx(shift, rel=0.05)


@pytest.mark.parametrize(("degree", "rotation"), [(3, 0.341), (5, 0.1013)])
def test_rotation_errors_over_the_reference_workspace(degree, rotation):
    """Mean rotation error [deg] of the sine of the rotation, as another program found it."""
    platform = gough.Platform.load("reference")
    pose = platform.sample_poses(10_000, seed=5)
    guess = gough.PolynomialSeed(platform, degree).guess(gough.leg_lengths(platform, pose))
    assert np.degrees(np.mean(guess.distance(pose)[1])) == pytest.approx(rotation, rel=0.05)


@pytest.mark.parametrize("offset", [0.0, 1.0])
@pytest.mark.parametrize("degree", [0, 1, 3, 4])
def test_the_compiled_evaluation_is_the_plain_one(degree, offset):
    """For full blocks and the rest of one, in both forms of the rotation."""
    rng = np.random.default_rng(degree)
    size = len(polynomial.monomials(degree)[0])
    coefficients = rng.normal(size=(size, 6)) / (4 * size)
    scaling = np.stack([rng.normal(size=6), rng.uniform(0.5, 2, size=6)])
    reference = gough.Pose.from_rotation_vector(np.zeros(3), rng.normal(size=3)).wxyz
    legs = scaling[0] + rng.uniform(-1, 1, size=(150, 6)) / scaling[1]
    made = polynomial.Polynomial(coefficients, scaling, np.append(reference, offset), degree)
    terms = polynomial._terms((legs - scaling[0]) * scaling[1], degree)
    values = terms @ coefficients
    u = values[:, 3:]
    turn = np.column_stack([offset + np.sqrt(1 - np.sum(u**2, axis=1)), u])
    wxyz = quaternion.product(turn, np.broadcast_to(reference, turn.shape))
    found = made(legs)
    np.testing.assert_allclose(found[:, :3], values[:, :3], atol=1e-14)
    expected = wxyz / np.linalg.norm(wxyz, axis=1, keepdims=True)
    np.testing.assert_allclose(found[:, 3:], expected, atol=1e-14)


def test_rotations_beyond_a_right_angle_are_fitted_too():
    platform = gough.Platform.load("reference").with_workspace(20, 30)
    home = gough.Pose.from_euler([0, 0, 600], [0, 0, 0.1])
    wide = replace(
        platform,
        home=home,
        workspace=gough.Workspace([[-5, 5]] * 3, [[-5, 5], [-5, 5], [80, 100]]),
    )
    pose = wide.sample_poses(200)
    values, offset = polynomial._outputs(wide, pose)
    assert offset == 0.0
    turn = gough.Pose(np.zeros(3), home.wxyz).inverse()
    back = gough.Pose(np.zeros((200, 3)), pose.wxyz) @ turn
    np.testing.assert_allclose(np.abs(values[:, 3:]), np.abs(back.wxyz[:, 1:]), atol=1e-14)


def test_a_polynomial_is_reproduced_exactly():
    """A machine whose poses are polynomials of the readings does not exist; a fit of one does."""
    rng = np.random.default_rng(1)
    u = rng.uniform(-1, 1, size=(3_000, 6))
    truth = rng.normal(size=(len(polynomial.monomials(3)[0]), 6))
    terms = polynomial._terms(u, 3)
    found = polynomial._least_squares(u, terms @ truth, 3)
    np.testing.assert_allclose(found, truth, atol=1e-11)


def test_home_is_home_whatever_the_readings():
    platform = gough.Platform.load("dietmaier")
    seed = gough.PolynomialSeed(platform, 0)
    guess = seed.guess(np.array([[1.0] * 6, [np.nan] * 6, [1e9] * 6]))
    assert seed.name == "home"
    shift, turn = guess.distance(platform.home)
    assert shift.max() < 1e-14
    assert turn.max() < 1e-7


def test_readings_far_outside_are_drawn_in():
    platform = gough.Platform.load("reference")
    guess = gough.PolynomialSeed(platform, 5).guess(np.array([[1e6] * 6, [-1e6] * 6, [np.nan] * 6]))
    assert np.all(np.isfinite(guess.position))
    assert np.all(np.linalg.norm(guess.position - platform.home.position, axis=-1) < platform.size)


def test_only_poses_that_can_be_reached_are_fitted():
    wide = gough.Platform.load("reference").with_workspace(100, 60)
    assert np.mean(gough.assembly_sign(wide, wide.sample_poses(2_000)) > 0) < 0.85
    pose = wide.sample_poses(5_000, seed=9)
    pose = pose[gough.assembly_sign(wide, pose) > 0]
    guess = gough.PolynomialSeed(wide, 4).guess(gough.leg_lengths(wide, pose))
    assert np.median(guess.distance(pose)[0]) < 15


def test_a_fit_is_kept_and_found_again(empty_cache):
    platform = gough.Platform.load("matlab_stewart")
    first = gough.PolynomialSeed(platform, 2)
    (file,) = empty_cache.iterdir()
    assert platform.digest in file.name
    polynomial.fitted.cache_clear()
    before = file.stat().st_mtime_ns
    again = gough.PolynomialSeed(platform, 2)
    assert file.stat().st_mtime_ns == before
    np.testing.assert_array_equal(first.polynomial.coefficients, again.polynomial.coefficients)


@pytest.mark.parametrize("damage", ["truncate", "text", "shape", "nan", "empty"])
def test_a_damaged_fit_is_made_anew(empty_cache, damage):
    platform = gough.Platform.load("matlab_stewart")
    first = gough.PolynomialSeed(platform, 2).polynomial
    (file,) = empty_cache.iterdir()
    content = file.read_bytes()
    if damage == "truncate":
        file.write_bytes(content[: len(content) // 2])
    elif damage == "text":
        file.write_text("not a zip file")
    elif damage == "empty":
        file.write_bytes(b"")
    else:
        bad = first.coefficients[:3] if damage == "shape" else first.coefficients * np.nan
        np.savez(file, coefficients=bad, scaling=first.scaling, turn=first.turn)
    polynomial.fitted.cache_clear()
    again = gough.PolynomialSeed(platform, 2).polynomial
    np.testing.assert_array_equal(first.coefficients, again.coefficients)


def test_a_cache_that_cannot_be_written_is_no_trouble(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("here is no folder")
    monkeypatch.setenv("GOUGH_CACHE_DIR", str(blocked / "cache"))
    polynomial.fitted.cache_clear()
    platform = gough.Platform.load("matlab_stewart")
    assert gough.PolynomialSeed(platform, 2).polynomial.degree == 2
    assert polynomial.cache_folder() == blocked / "cache"
    polynomial.fitted.cache_clear()


def test_two_workspaces_are_two_fits():
    narrow = gough.Platform.load("reference")
    wide = narrow.with_workspace(80, 40)
    assert narrow.digest != wide.digest
    one, two = (gough.PolynomialSeed(p, 2).polynomial.scaling for p in (narrow, wide))
    assert not np.allclose(one, two)


def test_a_workspace_that_cannot_be_reached_is_refused():
    platform = gough.Platform.load("reachy_mini").with_workspace(1.0, 10)
    with pytest.raises(gough.GoughError, match=r"only \d+ of \d+ sampled poses can be reached"):
        gough.PolynomialSeed(platform, 5)
