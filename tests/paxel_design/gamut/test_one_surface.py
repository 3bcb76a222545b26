"""The gamut of one channel on three or more inks: closed forms that owe nothing to half-spaces or meshes."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from numpy.polynomial.legendre import leggauss
from scipy.spatial import ConvexHull

from paxel_design.gamut import JointGamut, sub_gamut, subgamut_and_mesh
from paxel_runtime.model.effects import Full
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse

UV_INKS = np.array([[0.56, 0.24, 0.23], [0.31, 0.54, 0.14], [0.07, 0.19, 0.92]])
"""Columns: XYZ of red, green and blue fluorescent ink, a third of the area each; about what the bench's print gives."""


def model_of(A: np.ndarray, black: float = 0.0) -> PredictionModel:
    line = np.linspace(0, 1, 3)
    white = A.sum(axis=1) + black
    return PredictionModel(
        channels=("uv",),
        clusters=tuple(f"ink-{i}" for i in range(A.shape[1])),
        pattern=SurfaceModel(A / white[1], np.full(3, black) / white[1]),
        white=None,
        white_point=white / white[1],
        response=ProjectorResponse((line,), (line,)),
    )


def corners_of(model: PredictionModel, inputs: int) -> np.ndarray:
    """XYZ of every input at 0 or 1."""
    x = np.stack(np.meshgrid(*[[0.0, 1.0]] * inputs, indexing="ij"), axis=-1).reshape(-1, inputs)
    return np.asarray(model.predict_XYZ(x)[0])


def Lab_volume_by_quadrature(model: PredictionModel, nodes: int = 24) -> float:
    """Gauss-Legendre over the cube of inputs, of the volume that each piece of it has in CIELAB."""
    t, w = leggauss(nodes)
    x = np.stack(np.meshgrid(*[(t + 1) / 2] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    weight = np.prod(np.stack(np.meshgrid(*[w / 2] * 3, indexing="ij"), axis=-1).reshape(-1, 3), axis=1)
    ratio = np.asarray(model.predict_XYZ(x)[0]) / model.white_point
    slope = np.where(ratio > (6 / 29) ** 3, ratio ** (-2 / 3) / 3, (29 / 6) ** 2 / 3)
    # L* = 116 f(Y) - 16, a* = 500 (f(X) - f(Y)), b* = 200 (f(Y) - f(Z)): the determinant is the product of slopes
    jacobian = 116 * 500 * 200 * np.prod(slope / model.white_point, axis=1)
    return float(weight @ jacobian * abs(np.linalg.det(model.pattern.A)))


@pytest.mark.parametrize("black", [0.0, 0.004])
def test_volume_of_the_parallelepiped(black: float) -> None:
    model = model_of(UV_INKS, black)
    volume = ConvexHull(corners_of(model, 3)).volume
    assert volume == pytest.approx(abs(np.linalg.det(model.pattern.A)), rel=1e-9)
    mesh = subgamut_and_mesh(JointGamut(model), Full(), "pattern")[1]
    assert ConvexHull(np.asarray(XYZ_of_corners(model))).volume == pytest.approx(volume, rel=1e-9)
    assert (mesh.components, mesh.genus) == (1, 0)


def XYZ_of_corners(model: PredictionModel) -> np.ndarray:
    """Corners of the half-spaces: every three of their planes that meet inside all others."""
    gamut = sub_gamut(model, Full(), "pattern")
    normals, offsets = gamut.normals, gamut.offsets
    found = []
    for rows in combinations(range(len(normals)), 3):
        if abs(np.linalg.det(normals[list(rows)])) > 1e-9:
            point = np.linalg.solve(normals[list(rows)], offsets[list(rows)])
            if np.all(normals @ point <= offsets + 1e-12):
                found.append(point)
    return np.unique(np.round(found, 12), axis=0)


def test_the_half_spaces_have_the_corners_of_the_cube() -> None:
    model = model_of(UV_INKS, 0.002)
    ours = XYZ_of_corners(model)
    theirs = corners_of(model, 3)
    assert len(ours) == 8
    apart = np.linalg.norm(ours[:, None] - theirs[None], axis=-1)
    assert apart.min(axis=0).max() < 1e-10  # rounding
    assert np.abs(np.linalg.det(model.pattern.A)) == pytest.approx(ConvexHull(ours).volume, rel=1e-9)


def test_volume_in_CIELAB_by_quadrature_over_the_inputs() -> None:
    """The mesh's volume to 0.1 %; a black level keeps the integrand away from the bend of CIELAB near black."""
    model = model_of(UV_INKS, 0.01)
    expected = Lab_volume_by_quadrature(model)
    assert Lab_volume_by_quadrature(model, 20) == pytest.approx(expected, rel=1e-4)  # the quadrature has converged
    mesh = subgamut_and_mesh(JointGamut(model), Full(), "pattern")[1]
    assert mesh.volume == pytest.approx(expected, rel=1e-3)


def test_more_inks_than_three_add_a_piece_for_every_three_of_them() -> None:
    """Volume of a zonotope: the sum of |det| over all triples of its generators (Shephard)."""
    A = np.column_stack([UV_INKS, [0.30, 0.45, 0.05]])
    model = model_of(A)
    expected = sum(abs(np.linalg.det(model.pattern.A[:, list(rows)])) for rows in combinations(range(4), 3))
    assert ConvexHull(corners_of(model, 4)).volume == pytest.approx(expected, rel=1e-9)
    assert ConvexHull(XYZ_of_corners(model)).volume == pytest.approx(expected, rel=1e-9)
