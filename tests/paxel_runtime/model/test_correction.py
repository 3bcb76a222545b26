"""The correction's closed formulas: against plain numpy, derivatives against differences, and shapes that fail."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.errors import InputError
from paxel_runtime.model.correction import TERM_KINDS, Correction, Term

N = 4
FORMULAS = {
    "linear": lambda a, b: a,
    "product": lambda a, b: a * b,
    "absolute": lambda a, b: np.abs(a - b),
    "square": lambda a, b: (a - b) ** 2,
    "signed-square": lambda a, b: (a - b) * np.abs(a - b),
}


def make_correction(seed: int, surfaces: int = 2, centres: int = 3) -> Correction:
    rng = np.random.default_rng(seed)
    terms = tuple(Term(kind, *rng.integers(0, N, 2).tolist()) for kind in TERM_KINDS for _ in range(2))
    return Correction(
        n=N,
        terms=terms,
        coefficients=rng.standard_normal((surfaces, 3, len(terms))),
        centres=rng.random((centres, N)),
        weights=rng.standard_normal((surfaces, 3, centres)),
    )


def slow_XYZ(c: Correction, x: np.ndarray) -> np.ndarray:
    """One point, written out."""
    total = np.zeros((c.surfaces, 3))
    for t, term in enumerate(c.terms):
        total += c.coefficients[:, :, t] * FORMULAS[term.kind](x[term.a], x[term.b])
    for k, centre in enumerate(c.centres):
        g = np.linalg.norm(x) + np.linalg.norm(centre) - np.linalg.norm(x - centre)
        total += c.weights[:, :, k] * g
    return total


@given(st.integers(0, 99), st.integers(1, 2), st.integers(0, 3))
def test_it_is_the_sum_of_its_terms(seed: int, surfaces: int, centres: int) -> None:
    c = make_correction(seed, surfaces, centres)
    x = np.random.default_rng(seed).random((2, 5, N))
    expected = np.array([[slow_XYZ(c, one) for one in row] for row in x])
    assert c.XYZ(x) == pytest.approx(expected, abs=1e-12)


@given(st.integers(0, 99))
def test_derivatives_are_those_of_differences(seed: int) -> None:
    c = make_correction(seed)
    x = np.random.default_rng(seed).random(N)
    XYZ, J = c.XYZ_and_jacobian(x)
    assert J.shape == (2, 3, N)
    assert pytest.approx(c.XYZ(x)) == XYZ
    h = 1e-7  # smaller than any distance from a kink in these examples; error of central differences about h
    numeric = np.stack([(c.XYZ(x + h * e) - c.XYZ(x - h * e)) / (2 * h) for e in np.eye(N)], axis=-1)
    assert pytest.approx(numeric, abs=1e-5) == J


def test_black_is_never_corrected() -> None:
    assert np.all(make_correction(0).XYZ(np.zeros(N)) == 0)


def test_kinks_have_finite_derivatives() -> None:
    c = make_correction(1)
    for x in (np.zeros(N), np.full(N, 0.5), c.centres[0]):
        assert np.all(np.isfinite(c.XYZ_and_jacobian(x)[1]))


def test_what_does_not_fit_is_named() -> None:
    c = make_correction(0)
    empty = np.empty((0, N))
    with pytest.raises(InputError, match="must be one of linear, product"):
        Correction(N, (Term("cubic", 0, 1),), np.zeros((1, 3, 1)), empty, np.empty((1, 3, 0)))
    with pytest.raises(InputError, match="inputs 0 to 3, got 0 and 4"):
        Correction(N, (Term("product", 0, 4),), np.zeros((1, 3, 1)), empty, np.empty((1, 3, 0)))
    with pytest.raises(InputError, match=r"coefficients must be \(surfaces, 3, 1\), got \(1, 3, 2\)"):
        Correction(N, (Term("product", 0, 1),), np.zeros((1, 3, 2)), empty, np.empty((1, 3, 0)))
    with pytest.raises(InputError, match="centres"):
        Correction(N, (), np.zeros((1, 3, 0)), np.zeros((2, 3)), np.zeros((1, 3, 2)))
    with pytest.raises(InputError, match=r"needs \(..., 4\), got \(7, 3\)"):
        c.XYZ(np.zeros((7, 3)))
