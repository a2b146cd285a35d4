"""The inverse by matrix products: the paper's theorem, what is true of it and what is not."""

from __future__ import annotations

import inverse_study
import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from support import seeds

from gough import Platform
from gough.learn.newton import approximate_inverse, first_inverse, next_inverse

EYE = torch.eye(6, dtype=torch.float64)
conditions = st.floats(0.0, 6.0).map(lambda x: 10**x)


def with_condition(seed: int, condition: float, smallest: float | None = None) -> torch.Tensor:
    """A matrix (6, 6) of any size with the given condition number and random directions."""
    rng = np.random.default_rng(seed)
    u, v = (np.linalg.qr(rng.standard_normal((6, 6)))[0] for _ in range(2))
    s = condition ** -np.sort(rng.uniform(0, 1, 6))
    s[0], s[-1] = 1.0, 1 / condition if smallest is None else smallest
    return torch.tensor(10 ** rng.uniform(-3, 3) * (u * s) @ v)


def error(J: torch.Tensor, Z: torch.Tensor) -> torch.Tensor:
    return EYE - J @ Z


@given(seeds, conditions)
def test_the_first_error_is_below_one_in_the_spectral_norm(seed: int, condition: float) -> None:
    """J Z_0 is symmetric with eigenvalues in (0, 1]: the smallest is s_6^2 / (|J|_1 |J|_inf)."""
    J = with_condition(seed, condition)
    product = J @ first_inverse(J)
    torch.testing.assert_close(product, product.mT, rtol=0, atol=1e-15)
    eigenvalues = torch.linalg.eigvalsh(product)
    assert eigenvalues[-1] <= 1 + 1e-14
    # |J|_1 |J|_inf is between s_1^2 and 6 s_1^2
    lowest, highest = 1 / (6 * condition**2), 1 / condition**2
    assert lowest * (1 - 1e-6) - 1e-15 <= eigenvalues[0] <= highest * (1 + 1e-6) + 1e-15


@given(seeds, conditions)
def test_the_first_error_of_a_singular_matrix_is_one_and_stays(seed: int, condition: float) -> None:
    J = with_condition(seed, condition, smallest=0.0)
    Z = first_inverse(J)
    assert torch.linalg.matrix_norm(error(J, Z), 2) == pytest.approx(1, abs=1e-14)
    found = approximate_inverse(J[None], 20)
    assert found.iterations.item() == 20
    assert found.error.item() >= 1 - 1e-6


def test_the_papers_claim_about_the_frobenius_norm_is_false() -> None:
    """It holds where J is nearly orthogonal, and for no pose of any machine of the catalog."""
    assert torch.linalg.matrix_norm(error(EYE, first_inverse(EYE))) < 1
    for name in Platform.catalog():
        J = inverse_study.jacobians(Platform.load(name), 200)
        assert (torch.linalg.matrix_norm(error(J, first_inverse(J))) > 1).all()


@given(seeds, st.floats(0.0, 2.0).map(lambda x: 10**x), st.integers(0, 6))
def test_each_iteration_cubes_the_error(seed: int, condition: float, done: int) -> None:
    """E becomes (3 E^3 + E^4) / 4: |E| at most |E|^3 (3 + |E|) / 4 in submultiplicative norms."""
    J = with_condition(seed, condition)
    Z = first_inverse(J)
    for _ in range(done):
        Z = next_inverse(Z, J @ Z)
    before, after = error(J, Z), error(J, next_inverse(Z, J @ Z))
    rounding = 1e-14 * condition
    expected = (3 * before @ before @ before + before @ before @ before @ before) / 4
    torch.testing.assert_close(after, expected, rtol=0, atol=rounding)
    for norm in (2, "fro", 1, torch.inf):
        n = torch.linalg.matrix_norm(before, norm)
        assert torch.linalg.matrix_norm(after, norm) <= n**3 * (3 + n) / 4 + 3 * rounding


@given(seeds, conditions)
def test_iterations_are_as_many_as_the_smallest_singular_value_says(
    seed: int, condition: float
) -> None:
    J = with_condition(seed, condition)
    found = approximate_inverse(J[None], 60)
    s = torch.linalg.svdvals(J)
    size = torch.linalg.matrix_norm(J, 1) * torch.linalg.matrix_norm(J, torch.inf)
    weakest = float(s[-1] ** 2 / size)
    assert abs(found.iterations.item() - inverse_study.predicted(weakest)) <= 1
    # 2 log(condition) / log(13/4) and up to log(6) / log(13/4) + 3.6 more
    assert found.iterations.item() <= (2 * np.log(condition) + np.log(6)) / np.log(13 / 4) + 5
    torch.testing.assert_close(
        found.Z[0] * s[-1], torch.linalg.inv(J) * s[-1], rtol=0, atol=2e-8 + 1e-14 * condition
    )


def test_a_matrix_stops_by_itself_whatever_its_company_is() -> None:
    J = torch.stack([with_condition(k, 10.0**k) for k in range(7)])
    J[3] = torch.nan
    J[4, :, 2] = 0.0
    together = approximate_inverse(J, 20)
    for k in range(7):
        alone = approximate_inverse(J[k : k + 1], 20)
        assert torch.equal(alone.Z[0].nan_to_num(), together.Z[k].nan_to_num())
        assert alone.iterations[0] == together.iterations[k]
    assert together.error.isnan().tolist() == [k == 3 for k in range(7)]
    assert together.iterations[4] == 20
    assert together.error[4] >= 1 - 1e-9
    assert (together.iterations[:3].diff() > 0).all()


def test_the_limit_on_iterations_is_kept_and_none_are_allowed() -> None:
    J = with_condition(0, 1e3)[None]
    for f_max in (0, 1, 5):
        found = approximate_inverse(J, f_max)
        assert found.iterations.item() == f_max
    torch.testing.assert_close(approximate_inverse(J, 0).Z, first_inverse(J))
    assert len(approximate_inverse(J[:0]).Z) == 0


def test_single_precision_stops_at_what_it_can_reach() -> None:
    J = with_condition(1, 100.0).float()[None]
    found = approximate_inverse(J, 30)
    assert found.Z.dtype == torch.float32
    assert found.iterations.item() < 15
    assert found.error.item() < torch.finfo(torch.float32).eps ** 0.5


def test_stopping_as_algorithm_1_says_keeps_the_inverse_from_converging() -> None:
    """|JZ - JZ_0|_F goes to |I - JZ_0|_F, which is above 1: the rule forbids a good inverse."""
    J = inverse_study.jacobians(Platform.load("reference"), 100)
    for rule in (inverse_study.last_allowed, inverse_study.first_allowed):
        assert torch.linalg.matrix_norm(EYE - J @ rule(J), 2).min() > 0.99
    assert torch.linalg.matrix_norm(EYE - J @ inverse_study.fully(J), 2).max() < 1e-7
