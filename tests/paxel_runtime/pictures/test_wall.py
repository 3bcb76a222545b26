"""Pictures straight on the wall: under a keystone a disc is round there, wherever it stands."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from paxel_runtime.errors import InputError
from paxel_runtime.pictures import Frame, place_picture, read_picture, wall_homography
from paxel_runtime.registration.plane import homography_places

W, H = 160, 90
KEYSTONE = np.array([[2.0, 0.06, 30.0], [0.02, 2.1, 20.0], [6e-4, 3e-4, 1.0]])
"""From the projector's raster to the camera's: the right side is a tenth smaller."""


def _table() -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    rows, columns = np.indices((H, W))
    table = homography_places(KEYSTONE, np.stack([columns, rows], axis=-1)).astype(np.float32)
    valid = np.ones((H, W), bool)
    valid[:5] = False
    return table, valid


def _disc(path: Path, centre: tuple[int, int], radius: int) -> Path:
    rows, columns = np.indices((360, 640))
    disc = (columns - centre[0]) ** 2 + (rows - centre[1]) ** 2 < radius**2
    Image.fromarray((255 * disc).astype(np.uint8)).save(path)
    return path


def _axes_on_wall(L: NDArray[np.float32], homography: NDArray[np.float64]) -> NDArray[np.float64]:
    """Standard deviations along the principal axes of the light, where it falls on the wall."""
    rows, columns = np.indices(L.shape)
    places = homography_places(homography, np.stack([columns, rows], axis=-1)).reshape(-1, 2)
    # a pixel counts as the area it lights
    step = homography_places(homography, np.stack([columns + 1e-3, rows], axis=-1)).reshape(-1, 2) - places
    fall = homography_places(homography, np.stack([columns, rows + 1e-3], axis=-1)).reshape(-1, 2) - places
    weight = (L.ravel() > 50) * np.abs(step[:, 0] * fall[:, 1] - step[:, 1] * fall[:, 0])
    middle = np.average(places, axis=0, weights=weight)
    return np.sqrt(np.linalg.eigvalsh(np.cov((places - middle).T, aweights=weight)))


@pytest.mark.parametrize("placement", ["fill", "fit"])
@pytest.mark.parametrize("centre", [(200, 150), (450, 220)])
def test_a_disc_is_round_on_the_wall(tmp_path: Path, placement: str, centre: tuple[int, int]) -> None:
    picture = read_picture(_disc(tmp_path / "disc.png", centre, 90))
    on_wall = Frame(W, H, placement, to_wall=wall_homography(*_table()))
    small, large = _axes_on_wall(place_picture(picture, on_wall)[..., 0], KEYSTONE)
    assert large / small < 1.01  # a pixel of the raster at the rim of 45
    small, large = _axes_on_wall(place_picture(picture, Frame(W, H, placement))[..., 0], KEYSTONE)
    assert large / small > 1.03, "without it the disc is an ellipse"


def test_the_raster_of_a_straight_projector_is_left_alone(tmp_path: Path) -> None:
    rows, columns = np.indices((H, W))
    table = np.stack([3.0 * columns + 7, 3.0 * rows - 2], axis=-1).astype(np.float32)
    homography = wall_homography(table, np.ones((H, W), bool))
    np.testing.assert_allclose(homography, np.eye(3), atol=1e-5)  # float32 of the table
    picture = read_picture(_disc(tmp_path / "disc.png", (320, 180), 90))
    np.testing.assert_array_equal(
        place_picture(picture, Frame(W, H, to_wall=homography)), place_picture(picture, Frame(W, H))
    )


def test_millimetres_of_the_print_say_what_is_upright() -> None:
    """A camera that is rolled by 20 degrees: without millimetres upright is the raster's, with them the print's."""
    turn = np.deg2rad(20)
    roll = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    rows, columns = np.indices((H, W))
    table = homography_places(roll, np.stack([columns, rows], axis=-1)).astype(np.float32)
    valid = np.ones((H, W), bool)
    np.testing.assert_allclose(wall_homography(table, valid), np.eye(3), atol=1e-4)
    to_mm = np.diag([0.2, -0.2, 1.0])  # a print that is upright in the camera's picture: turned against the raster
    homography = wall_homography(table, valid, to_mm)
    right = homography_places(homography, np.array([[10.0, 0.0], [0.0, 0.0]]))
    assert np.rad2deg(np.arctan2(*(right[0] - right[1])[::-1])) == pytest.approx(20, abs=1e-3)
    assert np.hypot(*(right[0] - right[1])) == pytest.approx(10, abs=1e-3)


def test_pictures_are_aligned_where_asked(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    Image.fromarray(np.full((90, 90), 255, np.uint8)).save(path)
    for align, first in ((0.0, 0), (0.5, 35), (1.0, 70)):
        L = place_picture(read_picture(path), Frame(W, H, "fit", (align, 0.5)))[..., 0]
        assert np.flatnonzero(L[40] > 50)[0] == first


def test_a_registration_without_pixels() -> None:
    table, _ = _table()
    with pytest.raises(InputError, match="at least four pixels"):
        wall_homography(table, np.zeros((H, W), bool))
