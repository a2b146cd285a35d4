"""A solver made once: what it holds, and that its ways of solving agree."""

import dataclasses

import numpy as np
import pytest

import gough
from gough import Status
from gough.fk.solve import FEW
from gough.seeds import network

CATALOG = gough.Platform.catalog()


@pytest.mark.parametrize("name", CATALOG)
def test_small_batches_agree_with_large_ones(name):
    """The row solver and the block solver: the same statuses, the same poses to rounding."""
    platform = gough.Platform.load(name)
    legs = gough.leg_lengths(platform, platform.sample_poses(2 * FEW, seed=4))
    legs[5], legs[6, 2] = legs[5] * 1.5, np.nan
    solver = gough.Solver(platform)
    large = solver(legs)
    for first in (0, FEW):
        small = solver(legs[first : first + FEW])
        part = large[first : first + FEW]
        np.testing.assert_array_equal(small.status, part.status)
        good = small.usable
        translation, rotation = small.pose.distance(part.pose)
        assert translation[good].max() < 1e-11 * platform.size
        assert rotation[good].max() < 1e-10
        close = np.abs(small.iterations - part.iterations) <= 1
        assert np.mean(close) > 0.99


def test_a_catalog_name_or_a_path_will_do_for_a_platform(tmp_path):
    platform = gough.Platform.load("reference")
    path = tmp_path / "mine.toml"
    platform.save(path)
    for given in ("reference", path, str(path)):
        assert gough.solve(given, platform.home_legs).usable
        assert gough.Solver(given).platform == platform  # pyright: ignore[reportArgumentType]
    assert gough.Tracker("reference").platform == platform
    assert len(gough.assembly_modes("reference", platform.home_legs)) == 16
    for call in (gough.solve, gough.assembly_modes, lambda p, _: gough.Tracker(p)):
        with pytest.raises(gough.PlatformError, match="did you mean 'reference'"):
            call("refrence", platform.home_legs)
        with pytest.raises(gough.PlatformError, match="platform: expected a Platform"):
            call(None, platform.home_legs)  # pyright: ignore[reportArgumentType]


def test_open_rows_are_solved_alike_in_small_and_large_batches():
    platform = gough.Platform.load("reference").with_workspace(100, 60)
    legs = gough.leg_lengths(platform, platform.sample_poses(3 * FEW, seed=5))
    solver = gough.Solver(platform, "home")
    large = solver(legs)
    hard = np.flatnonzero(large.status != Status.CONVERGED)[:FEW]
    assert len(hard) > 20
    small = solver(legs[hard])
    assert np.mean(small.status == large.status[hard]) > 0.99


def test_a_network_is_opened_once(monkeypatch):
    opened = []
    session = network.session

    def counted(*arguments):
        opened.append(1)
        return session(*arguments)

    monkeypatch.setattr(network, "session", counted)
    platform = gough.Platform.load("reference").with_workspace(50, 30)
    solver = gough.Solver(gough.Platform.load("reference"), "resmlp")
    opened_at_first = len(opened)
    for _ in range(3):
        solver(platform.home_legs)
    assert solver.seed.name == "resmlp"
    assert len(opened) == opened_at_first <= 1


def test_it_cannot_be_changed_but_replaced():
    solver = gough.Solver(gough.Platform.load("reference"))
    with pytest.raises(dataclasses.FrozenInstanceError):
        solver.tolerance = 1.0  # pyright: ignore[reportAttributeAccessIssue]
    loose = dataclasses.replace(solver, tolerance=1e-3, seed="home")
    assert (loose.tolerance, loose.seed.name, solver.seed.name) == (1e-3, "home", "polynomial-3")


def test_whole_numbers_are_as_good_as_others():
    """They must not have anything compiled anew, which takes many seconds."""
    from gough.kernel.rows import solve_rows

    platform = gough.Platform.load("reference")
    gough.Solver(platform)(platform.home_legs)
    before = len(solve_rows.signatures)  # pyright: ignore[reportFunctionMemberAccess]
    solver = gough.Solver(platform, tolerance=1, singular=0, max_iterations=3.0)  # pyright: ignore
    assert solver(platform.home_legs).status == Status.CONVERGED
    gough.Solver(platform, tolerance=0)(platform.home_legs)
    gough.Tracker(platform, tolerance=1, singular=0, start=platform.home).update(platform.home_legs)
    gough.solve(platform, np.asfortranarray(np.tile(platform.home_legs, (3, 1))))
    assert len(solve_rows.signatures) == before  # pyright: ignore[reportFunctionMemberAccess]


def test_a_polynomial_of_another_machine_guesses_for_that_machine():
    """Its poses stand, even where origin and size of the solver's own coordinates differ."""
    reference = gough.Platform.load("reference")
    seed = gough.PolynomialSeed(reference)
    moved = dataclasses.replace(
        reference, base=reference.base + 1.0, moving=reference.moving * 1.01
    )
    legs = gough.leg_lengths(reference, reference.sample_poses(5))
    guess = gough.solve(moved, legs, seed=seed, max_iterations=0).pose
    assert guess.distance(seed.guess(legs))[0].max() < 1e-10


@pytest.mark.parametrize(
    ("name", "value", "wanted"),
    [
        ("workers", "2", "a whole number from 1 to 10,000, found '2'"),
        ("workers", 0, "a whole number from 1 to 10,000, found 0"),
        ("workers", -1, "a whole number from 1 to 10,000, found -1"),
        ("workers", 1.5, "a whole number from 1 to 10,000, found 1.5"),
        ("max_iterations", None, "a whole number from 0 to 10,000, found None"),
        ("max_iterations", 2.5, "a whole number from 0 to 10,000, found 2.5"),
        ("restarts", True, "a whole number from 0 to 10,000, found True"),
        ("restarts", float("inf"), "a whole number from 0 to 10,000, found inf"),
        ("tolerance", -1.0, "0 to 1, found -1.0"),
        ("tolerance", "tight", "0 to 1, found 'tight'"),
        ("singular", float("nan"), "0 to 1, found nan"),
    ],
)
def test_settings_out_of_range_are_refused(name, value, wanted):
    with pytest.raises(gough.GoughError, match=f"^{name}: expected {wanted}$"):
        gough.Solver(gough.Platform.load("reference"), **{name: value})  # pyright: ignore[reportArgumentType]


def test_a_very_long_name_is_only_unknown():
    with pytest.raises(gough.GoughError, match="seed: unknown name 'nnn") as error:
        gough.Solver(gough.Platform.load("reference"), "n" * 5_000)
    assert len(str(error.value)) < 400
