"""The PDF as a print shop's software sees it, compared with `Pattern.label`."""

import base64
import re
import shutil
import subprocess
import time
import zlib

import numpy as np
import pytest

from paxel_design.patterns import make_pattern
from paxel_design.printing import write_pattern_pdf
from paxel_runtime.errors import InputError

MM_PER_INCH = 25.4
BW = ("black", "white")

needs_ghostscript = pytest.mark.skipif(shutil.which("gs") is None, reason="Ghostscript (gs) is not installed")
needs_poppler = pytest.mark.skipif(shutil.which("pdftoppm") is None, reason="poppler-utils (pdftoppm) is not installed")


def _run(arguments):
    done = subprocess.run(arguments, capture_output=True, check=True)
    assert done.stderr == b""
    return done.stdout


def _last_plane(pgm, width, height):
    return np.frombuffer(pgm[-width * height :], np.uint8).reshape(height, width)


def render_ghostscript(path, dpi, left, bottom, width, height):
    """A crop of the page as gray codes; `left`, `bottom` in pixels from the page's lower left corner."""
    shift = f"<</Install {{{-left * 72 / dpi} {-bottom * 72 / dpi} translate}}>> setpagedevice"
    device = ["-sDEVICE=pgmraw", f"-r{dpi}", f"-g{width}x{height}", "-dFIXEDMEDIA", "-sOutputFile=%stdout"]
    pgm = _run(["gs", "-q", "-dNOPAUSE", "-dBATCH", "-dSAFER", *device, "-c", shift, "-f", str(path)])
    return _last_plane(pgm, width, height)


def render_poppler(path, dpi, left, top, width, height):
    """A crop of the page as gray codes; `left`, `top` in pixels from the page's upper left corner."""
    crop = ["-x", left, "-y", top, "-W", width, "-H", height]
    options = ["-r", dpi, *crop, "-aa", "no", "-aaVector", "no", "-gray"]
    return _last_plane(_run(["pdftoppm", *map(str, options), str(path)]), width, height)


def labels_of(pattern, page_mm, dpi, left, bottom, width, height):
    """`Pattern.label` at the centres of the pixels of a crop."""
    x_mm = (left + np.arange(width) + 0.5) * MM_PER_INCH / dpi - page_mm[0] / 2
    y_mm = (bottom + np.arange(height)[::-1] + 0.5) * MM_PER_INCH / dpi - page_mm[1] / 2
    return pattern.label(x_mm[None, :], y_mm[:, None])


def page_content(path):
    """The drawing operators of the page, unpacked."""
    stream = re.search(rb"/ASCII85Decode /FlateDecode \].*?stream\r?\n(.*?)endstream", path.read_bytes(), re.DOTALL)[1]
    return zlib.decompress(base64.a85decode(b"<~" + stream.strip(), adobe=True))


def far_from_edges(labels, reach_px):
    """Pixels whose label is also that of all pixels within `reach_px`."""
    same = np.ones(labels.shape, bool)
    for axis in (0, 1):
        for step in range(-reach_px, reach_px + 1):
            same &= np.roll(labels, step, axis) == labels
    same[:reach_px], same[-reach_px:], same[:, :reach_px], same[:, -reach_px:] = False, False, False, False
    return same


@needs_ghostscript
@pytest.mark.parametrize(
    ("colorants", "dot_size_mm", "angle_deg", "at_corner"),
    [(BW, 0.75, 30, True), (BW, 0.5, 0, True), (("white", "black"), 0.6, -71.3, False)],
)
def test_ghostscript_paints_the_label_of_every_pixel(tmp_path, colorants, dot_size_mm, angle_deg, at_corner):
    pattern = make_pattern("checkerboard", colorants, dot_size_mm, angle_deg, (60, 40))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf")
    dpi, side = 1440, 900
    x_mm, y_mm = (21.0, 11.0) if at_corner else (0.0, 0.0)
    left = int((made.page_mm[0] / 2 + x_mm) * dpi / MM_PER_INCH) - side // 2
    bottom = int((made.page_mm[1] / 2 + y_mm) * dpi / MM_PER_INCH) - side // 2
    black = render_ghostscript(tmp_path / "pattern.pdf", dpi, left, bottom, side, side) < 128
    wanted = labels_of(pattern, made.page_mm, dpi, left, bottom, side, side) == colorants.index("black")
    # only pixels whose centre lies within rounding (1/256 px) of an edge may differ
    assert np.mean(black != wanted) < 0.001
    assert abs(black.mean() - wanted.mean()) < 0.001


def test_blocks_of_a_wall_lie_on_the_lattice_of_cells_to_a_nanometre(tmp_path):
    pattern = make_pattern("checkerboard", BW, 2.0, 30, (3000, 2000))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf")
    page = page_content(tmp_path / "pattern.pdf")
    matrices = np.array([line.split()[:6] for line in page.splitlines() if line.split()[-1:] == [b"cm"]], float)
    centre, blocks_pt = matrices[1], matrices[2:]  # matrices[0] is reportlab's own, the identity
    # reportlab writes 7 digits of the page's centre: 0.2 um of 1.5 m
    assert centre[4:] * MM_PER_INCH / 72 == pytest.approx(np.array(made.page_mm) / 2, abs=5e-4)
    turn = np.exp(-1j * np.deg2rad(30)) * MM_PER_INCH / 72 / 2.0  # points on the page -> cells
    cells = turn * (blocks_pt[:, 0::2] + 1j * blocks_pt[:, 1::2])
    steps, upward, corner = cells.T
    for whole in (steps, upward / 1j, corner.real, corner.imag):
        assert np.abs(whole - np.rint(np.real(whole))).max() < 5e-7  # cells of 2 mm
    assert np.all(np.rint(corner.real) % 2 == 0)
    assert np.all(np.rint(corner.imag) % 2 == 0)


@needs_ghostscript
def test_compensation_takes_the_same_strip_off_every_dot(tmp_path):
    pattern = make_pattern("checkerboard", BW, 0.75, 30, (60, 40))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf", ink_spread_um=62.5)
    assert made.ink_spread_um == 62.5  # a twelfth of a dot
    side, dpi = 800, 1440
    left = int(made.page_mm[0] / 2 * dpi / MM_PER_INCH) - side // 2
    bottom = int(made.page_mm[1] / 2 * dpi / MM_PER_INCH) - side // 2
    black = render_ghostscript(tmp_path / "pattern.pdf", dpi, left, bottom, side, side) < 128
    wanted = labels_of(pattern, made.page_mm, dpi, left, bottom, side, side) == 0
    assert not np.any(black & ~wanted & far_from_edges(wanted, 1))
    kept = (1.0 - 2.0 * made.ink_spread_um / 750.0) ** 2
    # the crop holds 180 dots of black, those on its rim in part: 0.003 is a third of one dot in 180
    assert black.sum() / wanted.sum() == pytest.approx(kept, abs=0.003)


@needs_poppler
def test_poppler_paints_the_same_pattern(tmp_path):
    pattern = make_pattern("checkerboard", BW, 0.75, 30, (60, 40))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf")
    dpi, side = 1440, 900
    left = int(made.page_mm[0] / 2 * dpi / MM_PER_INCH) - side // 2
    page_px = made.page_mm[1] * dpi / MM_PER_INCH
    top = int(page_px / 2) - side // 2
    black = render_poppler(tmp_path / "pattern.pdf", dpi, left, top, side, side) < 128
    labels = labels_of(pattern, made.page_mm, dpi, left, page_px - top - side, side, side)
    assert abs(black.mean() - 0.5) < 0.003
    # poppler scales an image to whole pixels before it turns it: up to 2 px off
    away = far_from_edges(labels, 2)
    assert away.mean() > 0.5
    assert np.mean(black[away] == (labels[away] == 0)) > 0.99


@needs_ghostscript
def test_rulers_and_pattern_have_their_size_on_the_page(tmp_path):
    pattern = make_pattern("checkerboard", ("cyan", "black"), 1.0, 0, (120, 110))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf")
    dpi = 508  # 20 px a mm
    width, height = (round(side * 20) for side in made.page_mm)
    page = render_ghostscript(tmp_path / "pattern.pdf", dpi, 0, 0, width, height)[::-1]
    to_px = lambda x_mm, y_mm: (round(20 * (x_mm + made.page_mm[0] / 2)), round(20 * (y_mm + made.page_mm[1] / 2)))  # noqa: E731
    band_left = -(made.trim_mm[0] / 2 - 25)
    column, row = to_px(band_left, -55 - 12 + 6)  # above all ticks of the x ruler but the outer two
    dark = np.flatnonzero(page[row, column - 20 : column + 2100] < 128)
    assert dark.max() - dark.min() == pytest.approx(2000, abs=3)  # 100 mm, and a line of 0.1 mm = 2 px
    column, row = to_px(band_left - 9 + 6, -55)
    dark = np.flatnonzero(page[row - 20 : row + 2100, column] < 128)
    assert dark.max() - dark.min() == pytest.approx(2000, abs=3)
    row = to_px(0, 10.5)[1]
    inked = np.flatnonzero(page[row, to_px(-61, 0)[0] : to_px(61, 0)[0]] < 250)
    assert inked.max() - inked.min() + 1 == pytest.approx(2400, abs=1)  # 120 mm of pattern


def test_boxes_are_nested_and_true(tmp_path):
    pattern = make_pattern("checkerboard", BW, 0.75, 30, (600, 400))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf")
    content = (tmp_path / "pattern.pdf").read_bytes()
    boxes = {
        name: np.array([float(v) for v in re.search(rb"/" + name.encode() + rb" \[([^\]]*)\]", content)[1].split()])
        for name in ("MediaBox", "BleedBox", "TrimBox")
    }
    mm = {name: (box[2:] - box[:2]) * MM_PER_INCH / 72 for name, box in boxes.items()}
    # reportlab writes 4 decimals of a point at this size: 0.1 um
    assert mm["MediaBox"] == pytest.approx(made.page_mm, abs=1e-3)
    assert mm["TrimBox"] == pytest.approx(made.trim_mm, abs=1e-3)
    assert mm["BleedBox"] - mm["TrimBox"] == pytest.approx([6.0, 6.0], abs=1e-3)
    centres = [(box[2:] + box[:2]) / 2 for box in boxes.values()]
    assert np.ptp(centres, axis=0) == pytest.approx([0, 0], abs=1e-3)


def test_equal_arguments_give_equal_bytes_and_other_ones_do_not(tmp_path):
    pattern = make_pattern("checkerboard", BW, 0.75, 30, (60, 40))
    contents = []
    for i, caption in enumerate(("a", "a", "b")):
        write_pattern_pdf(pattern, tmp_path / f"{i}.pdf", caption=caption)
        contents.append((tmp_path / f"{i}.pdf").read_bytes())
    assert contents[0] == contents[1] != contents[2]


def test_only_device_cmyk_and_embedded_fonts(tmp_path):
    pattern = make_pattern("checkerboard", ("red", "cyan"), 0.75, 30, (60, 40))
    write_pattern_pdf(pattern, tmp_path / "pattern.pdf", ink_spread_um=10)
    content = (tmp_path / "pattern.pdf").read_bytes()
    # red = M + Y, cyan, and the bare paper that the shrunk dots leave
    assert b"/Indexed /DeviceCMYK 2 <00ffff00ff00000000000000>" in content
    assert b"DeviceRGB" not in content
    assert len(re.findall(rb"/Type /Font\b", content)) == content.count(b"/FontFile2") == 1


def test_the_default_sheet_is_small_and_quick(tmp_path):
    pattern = make_pattern("checkerboard", BW, 0.75, 30, (600, 400))
    start = time.process_time()
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf")
    assert time.process_time() - start < 2.0  # 0.1 s measured
    assert made.bytes == (tmp_path / "pattern.pdf").stat().st_size < 100_000  # 26 kB measured


def test_nothing_is_written_when_the_sheet_is_impossible(tmp_path):
    pattern = make_pattern("checkerboard", BW, 0.75, 30, (60, 40))
    with pytest.raises(InputError, match="at least 3 dots of the printer"):
        write_pattern_pdf(pattern, tmp_path / "pattern.pdf", dpi=72)
    assert list(tmp_path.iterdir()) == []
