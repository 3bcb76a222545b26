"""Fiducials and code of a sheet, as a camera and a scanner find them."""

import json
import shutil
import subprocess

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from paxel_design.patterns import layout_recipe, make_pattern
from paxel_design.printing import write_pattern_pdf
from paxel_design.printing.fiducials import DICTIONARY, FIDUCIAL_MODULES, fiducials_of
from paxel_design.printing.sheet_code import code_modules, code_text, pattern_of_code
from paxel_runtime.errors import InputError

MM_PER_INCH = 25.4

needs_poppler = pytest.mark.skipif(shutil.which("pdftoppm") is None, reason="poppler-utils (pdftoppm) is not installed")


def render(path, dpi):
    """The first page as (height, width) gray codes."""
    png = path.with_suffix(".png")
    command = ["pdftoppm", "-r", str(dpi), "-gray", "-png", "-singlefile", str(path), str(png.with_suffix(""))]
    subprocess.run(command, capture_output=True, check=True)
    with Image.open(png) as image:
        return np.asarray(image.convert("L"))


@needs_poppler
@pytest.mark.parametrize("size_mm", [(60.0, 40.0), (200.0, 120.0)])
def test_opencv_finds_the_fiducials_where_they_should_be(tmp_path, size_mm):
    cv2 = pytest.importorskip("cv2")
    pattern = make_pattern("checkerboard", ("black", "white"), 0.75, 30, size_mm)
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf")
    dpi = 200
    gray = render(tmp_path / "pattern.pdf", dpi)
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, made.fiducials.dictionary))
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(gray)
    found = {int(i): corner[0] for i, corner in zip(ids.ravel(), corners, strict=True)}
    assert {marker.id for marker in made.fiducials.markers} == set(found) == {0, 1, 2, 3}
    for marker in made.fiducials.markers:
        px = found[marker.id] + 0.5  # OpenCV's integers are centres of pixels
        x_mm = px[:, 0] * MM_PER_INCH / dpi - made.page_mm[0] / 2
        y_mm = made.page_mm[1] / 2 - px[:, 1] * MM_PER_INCH / dpi
        # 0.1 mm is 0.8 px of this picture
        assert np.abs(np.stack((x_mm, y_mm), axis=1) - marker.corners_mm).max() < 0.1


def test_the_modules_are_those_of_opencv():
    cv2 = pytest.importorskip("cv2")
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, DICTIONARY))
    for i, rows in enumerate(FIDUCIAL_MODULES):
        dark = np.array([[module == "#" for module in row] for row in rows])
        assert np.array_equal(cv2.aruco.generateImageMarker(dictionary, i, 6) == 0, dark)


@given(st.tuples(st.floats(1, 5000), st.floats(1, 5000)))
def test_fiducials_are_symmetric_squares_beyond_the_corners(size_mm):
    corners = np.array([marker.corners_mm for marker in fiducials_of(size_mm)])
    assert np.allclose(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2), 18.0)
    assert np.all(np.abs(corners) >= np.array(size_mm) / 2 + 3.0)  # a module of paper between
    assert np.allclose(corners.mean(axis=(0, 1)), 0.0, atol=1e-9)


REQUESTS = {
    "checkerboard": (("checkerboard", ("black", "white"), 0.75, 30.0, (60.0, 40.0)), {}),
    "tiles": (("tiles", ("cyan", "magenta", "yellow", "red"), 0.5, -7.25, (50.0, 40.0)), {}),
    "blue noise": (
        ("blue-noise", ("black", "white", "red"), 1.0, 18.43494882292201, (40.0, 40.0), 7),
        {"shares": (0.25, 0.25, 0.5), "flatness": 1.5},
    ),
}


@needs_poppler
@pytest.mark.parametrize("request_name", REQUESTS)
def test_the_code_decodes_at_300_dpi_to_the_same_pattern(tmp_path, request_name):
    cv2 = pytest.importorskip("cv2")
    arguments, keywords = REQUESTS[request_name]
    pattern = make_pattern(*arguments, **keywords)
    recipe = layout_recipe(pattern, keywords.get("shares"), "swap", keywords.get("flatness", 2.0))
    write_pattern_pdf(pattern, tmp_path / "pattern.pdf", recipe=recipe)
    page = render(tmp_path / "pattern.pdf", 300)
    corner = page[page.shape[0] * 2 // 3 :, page.shape[1] // 2 :]  # as one photographs it; a pattern is a busy ground
    text, _, _ = cv2.QRCodeDetector().detectAndDecode(corner)
    again = pattern_of_code(text)
    assert np.array_equal(again.cells, pattern.cells)
    for field in ("layout", "colorants", "dot_size_mm", "angle_deg", "size_mm", "seed"):
        assert getattr(again, field) == getattr(pattern, field)


def test_the_code_is_square_with_finder_patterns():
    rows = code_modules(code_text(make_pattern(*REQUESTS["checkerboard"][0])))
    assert {len(row) for row in rows} == {len(rows)}
    assert rows[0][:8] == rows[0][:-9:-1] == rows[-1][:8] == "#######."  # ISO 18004: finder and separator


def test_a_code_that_is_not_ours_or_tells_of_other_cells_is_refused():
    pattern = make_pattern("tiles", ("cyan", "magenta", "red"), 0.5, 0.0, (20.0, 20.0))
    good = json.loads(code_text(pattern))
    broken = {
        "a JSON object": "PAXEL",
        "schema": json.dumps({**good, "schema": "other"}),
        "lacks the key 'seed'": json.dumps({k: v for k, v in good.items() if k != "seed"}),
        "must be one of": json.dumps({**good, "layout": "spirals"}),
        "wrong form": json.dumps({**good, "size_mm": 3}),
        "must give the cells": json.dumps({**good, "colorants": ["cyan", "magenta", "black", "red"]}),
    }
    for text, code in broken.items():
        with pytest.raises(InputError, match=text):
            pattern_of_code(code)
    with pytest.raises(InputError, match="may hold shares"):
        code_text(pattern, {"colour": 1})
