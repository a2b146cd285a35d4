import numpy as np
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from roma import special_procrustes

from gough.learn.kinematics import euler_to_matrix, matrix_to_euler
from gough.seeds.network import nearest_rotations


def by_svd(m):
    u, _, vt = np.linalg.svd(m)
    sign = np.linalg.det(u @ vt)
    return u @ (np.array([1, 1, 1])[:, None] * np.diag([1, 1, sign])) @ vt


@settings(max_examples=50)
@given(st.integers(0, 10**9), st.floats(0, 3))
def test_both_forms_give_the_nearest_rotation(seed, noise):
    rng = np.random.default_rng(seed)
    near = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    m = near * np.linalg.det(near) + noise * rng.standard_normal((3, 3))
    s = np.linalg.svd(m, compute_uv=False)
    if s[1] + np.sign(np.linalg.det(m)) * s[2] < 1e-3:
        return  # two rotations are equally near
    expected = by_svd(m)
    np.testing.assert_allclose(special_procrustes(torch.tensor(m)), expected, atol=1e-10)
    np.testing.assert_allclose(nearest_rotations(m[None])[0], expected, atol=1e-10)


def test_mirrored_and_broken_matrices_still_give_rotations():
    m = np.stack(
        [np.diag([1.0, 1.0, -1.0]), np.zeros((3, 3)), np.full((3, 3), np.nan), 1e6 * np.eye(3)]
    )
    R = nearest_rotations(m)
    np.testing.assert_allclose(
        R @ np.swapaxes(R, -1, -2), np.broadcast_to(np.eye(3), R.shape), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(R), 1)


def test_its_gradient_is_right():
    torch.manual_seed(0)
    m = torch.eye(3, dtype=torch.float64) + 0.4 * torch.randn(6, 3, 3, dtype=torch.float64)
    assert torch.autograd.gradcheck(special_procrustes, m.requires_grad_())
    mirrored = torch.diag(torch.tensor([1.0, 2.0, -0.3], dtype=torch.float64))
    assert torch.autograd.gradcheck(special_procrustes, mirrored.requires_grad_())


def test_euler_angles_of_a_matrix():
    angles = torch.linspace(-1.5, 1.5, 30, dtype=torch.float64).reshape(10, 3)
    torch.testing.assert_close(matrix_to_euler(euler_to_matrix(angles)), angles)
