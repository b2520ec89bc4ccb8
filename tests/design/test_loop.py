"""The loop's algebra on numbers worked by hand, and its cuts."""

import numpy as np
import pytest

from design.loop import Loop, SisoLoop


def _loop(delay=(0.0, 0.0), grid=(2, 3), seed=1):
    rng = np.random.default_rng(seed)
    n, m, p, o, q = 4, 2, 1, 3, 2
    shapes = {
        "A": (n, n), "B": (n, m), "E": (n, p), "G": (n, q), "K": (m, n), "N": (m, p), "M": (m, q),
        "C": (o, n), "F": (o, n), "D": (o, m), "H": (o, m),
    }  # fmt: skip
    arrays = {k: rng.standard_normal((*grid, *shape)) for k, shape in shapes.items()}
    return Loop(
        **arrays, offset=rng.standard_normal((*grid, o)), states=("a", "b", "c", "d"), inputs=("tab", "aileron"),
        references=("r_a",), outputs=("x", "y", "z"), disturbances=("T", "da_noise"), stages=(), delay=delay,
    )  # fmt: skip


def test_outputs_from_states_and_reference_obey_the_definition():
    """y = C x + F x' + D u + H u' with u = -K x + N r and x' = A x + B u + E r, at a random state and reference."""
    loop = _loop()
    x, r = np.random.default_rng(2).standard_normal((2, 3, 4)), np.full((2, 3, 1), 0.7)
    u = -np.einsum("...mn,...n->...m", loop.K, x) + np.einsum("...mp,...p->...m", loop.N, r)
    xdot = (loop.A @ x[..., None] + loop.B @ u[..., None] + loop.E @ r[..., None])[..., 0]
    udot = -loop.K @ xdot[..., None]
    y = (loop.C @ x[..., None] + loop.F @ xdot[..., None] + loop.D @ u[..., None] + loop.H @ udot)[..., 0]
    ours = (loop.closed_outputs @ x[..., None] + loop.reference_feedthrough @ r[..., None])[..., 0]
    np.testing.assert_allclose(ours, y, rtol=1e-12)
    ours = (loop.closed @ x[..., None] + loop.reference_input @ r[..., None])[..., 0]
    np.testing.assert_allclose(ours, xdot, rtol=1e-12)


def test_a_cut_opens_one_input_and_closes_the_others():
    loop = _loop()
    cut = loop.cut("tab")
    K_other = loop.K.copy()
    K_other[..., 0, :] = 0.0
    np.testing.assert_allclose(cut.A, loop.A - loop.B @ K_other, rtol=1e-12)
    np.testing.assert_allclose(cut.closed(), loop.closed, rtol=1e-12)
    np.testing.assert_allclose(cut.closed(0.0), cut.A, rtol=1e-12)


def test_stacked_cuts_are_the_cuts():
    loop = _loop(delay=(0.01, 0.01))
    stack = loop.cuts()
    for i, name in enumerate(loop.inputs):
        one = loop.cut(name)
        for field in ("A", "b", "c", "gain"):
            np.testing.assert_array_equal(getattr(stack, field)[i], getattr(one, field))
    assert stack.delay == 0.01
    with pytest.raises(ValueError, match="delays"):
        _loop(delay=(0.01, 0.02)).cuts()


def test_sign_of_a_siso_loop():
    positive = SisoLoop("f", np.array([[-1.0]]), np.array([1.0]), np.array([1.0]), np.array(0.5), -1)
    assert positive.closed().item() == -0.5
    assert positive.closed(2.0).item() == 1.0


def test_take_and_spread_are_inverse_over_a_mask():
    loop = _loop()
    mask = np.array([[True, False, True], [False, False, True]])
    back = loop.take(mask).spread(mask)
    np.testing.assert_array_equal(back.A[mask], loop.A[mask])
    assert np.isnan(back.A[~mask]).all()
    assert back.states == loop.states


def test_unknown_stage():
    with pytest.raises(KeyError):
        _loop().stage("K_q")
