"""The PDF as a print shop's software sees it, compared with `Pattern.label`."""

import shutil
import subprocess
import time
from dataclasses import replace

import numpy as np
import pikepdf
import pytest
from PIL import Image

from paxel_design.patterns import make_pattern
from paxel_design.printing import write_pattern_pdf
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import colorant_library

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


def crop_at(made, dpi, side, *at_mm):
    """Left and bottom, in pixels, of a square crop about a point of the pattern."""
    return [
        int((page + 2 * v) / 2 * dpi / MM_PER_INCH) - side // 2 for page, v in zip(made.page_mm, at_mm, strict=True)
    ]


def keep_near(path, kept, at_mm, reach_mm):
    """Copy a PDF without the blocks away from a point of the pattern: Ghostscript takes 0.5 us for each sub-pixel."""
    with pikepdf.open(path) as pdf:
        page = pdf.pages[0]
        instructions = list(pikepdf.parse_content_stream(page))
        near = []
        for i, instruction in enumerate(instructions):
            if str(instruction.operator) == "Do":
                a, b, c, d, e, f = (float(v) * MM_PER_INCH / 72 for v in instructions[i - 1].operands)
                corners = np.array([[e, f], [e + a, f + b], [e + c, f + d], [e + a + c, f + b + d]]) - at_mm
                if np.any(corners.min(axis=0) > reach_mm) or np.any(corners.max(axis=0) < -reach_mm):
                    continue
            near.append(instruction)
        page.Contents = pdf.make_stream(pikepdf.unparse_content_stream(near))
        pdf.save(kept)


def hann_mean(ink):
    """Mean under a Hann window: what the dots cut by the rim of a crop would add to a plain mean drops out."""
    window = np.hanning(len(ink) + 2)[1:-1]
    return float(window @ ink @ window / window.sum() ** 2)


def ink_left(labels_at, ink, x_mm, y_mm, spread_mm, angle_deg):
    """Where a colorant's cells lie, less a strip at each edge to another: it must fill a whole square of 2 strips."""
    a = np.deg2rad(angle_deg)
    left = np.ones(np.broadcast_shapes(np.shape(x_mm), np.shape(y_mm)), bool)
    for u, v in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        dx, dy = spread_mm * (np.cos(a) * u - np.sin(a) * v), spread_mm * (np.sin(a) * u + np.cos(a) * v)
        left &= labels_at(x_mm + dx, y_mm + dy) == ink
    return left


def far_from_edges(labels, reach_px):
    """Pixels whose label is also that of all pixels within `reach_px`."""
    same = np.ones(labels.shape, bool)
    for axis in (0, 1):
        for step in range(-reach_px, reach_px + 1):
            same &= np.roll(labels, step, axis) == labels
    same[:reach_px], same[-reach_px:], same[:, :reach_px], same[:, -reach_px:] = False, False, False, False
    return same


@pytest.fixture(scope="module")
def large_sheet(tmp_path_factory):
    """The paper's sheet: 60 x 40 cm."""
    path = tmp_path_factory.mktemp("sheet") / "pattern.pdf"
    pattern = make_pattern("checkerboard", BW, 0.5, 30, (600, 400))
    return path, pattern, write_pattern_pdf(pattern, path)


@needs_ghostscript
@pytest.mark.parametrize("at_mm", [(0.0, 0.0), (294.5, 194.5), (-294.5, 60.0)])
def test_ghostscript_paints_the_label_of_every_pixel(tmp_path, large_sheet, at_mm):
    whole, pattern, made = large_sheet
    dpi, side, path = 1440, 900, tmp_path / "part.pdf"
    keep_near(whole, path, at_mm, 12.0)
    left, bottom = crop_at(made, dpi, side, *at_mm)
    black = render_ghostscript(path, dpi, left, bottom, side, side) < 128
    labels = labels_of(pattern, made.page_mm, dpi, left, bottom, side, side)
    inside = labels != 255
    # only pixels whose centre lies within rounding (1/256 px) of an edge may differ
    assert np.mean((black != (labels == 0))[inside]) <= 0.001
    assert abs(black[inside].mean() - np.mean(labels[inside] == 0)) <= 0.001
    if np.all(inside):
        assert abs(hann_mean(black) - 0.5) <= 0.001
    # a clip, unlike an image, paints every pixel it touches: the rim of the area may reach one further
    assert not np.any(black & ~inside & far_from_edges(inside, 1))


@needs_ghostscript
@pytest.mark.parametrize(
    ("colorants", "dot_size_mm", "angle_deg"), [(BW, 0.75, 0), (("white", "black"), 0.6, -71.3), (BW, 0.5, 18.43494882)]
)
def test_ghostscript_agrees_at_any_angle(tmp_path, colorants, dot_size_mm, angle_deg):
    pattern = make_pattern("checkerboard", colorants, dot_size_mm, angle_deg, (60, 40))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf")
    dpi, side = 1440, 700
    left, bottom = crop_at(made, dpi, side, 20.0, 11.0)
    black = render_ghostscript(tmp_path / "pattern.pdf", dpi, left, bottom, side, side) < 128
    wanted = labels_of(pattern, made.page_mm, dpi, left, bottom, side, side) == colorants.index("black")
    # at 0 degrees a whole column of pixels may have its centres on an edge, to Ghostscript's rounding of 1/256 px
    on_edge = np.zeros(wanted.shape, bool)
    for dx, dy in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        moved = labels_of(pattern, made.page_mm, dpi, left + dx / 128, bottom + dy / 128, side, side)
        on_edge |= (moved == colorants.index("black")) != wanted
    assert np.mean((black != wanted) & ~on_edge) <= 0.001
    assert on_edge.mean() < 0.01


def operators_of(path):
    """Operands and operator of every instruction of the first page, in order."""
    with pikepdf.open(path) as pdf:
        return [(list(i.operands), str(i.operator)) for i in pikepdf.parse_content_stream(pdf.pages[0])]


def test_blocks_of_a_wall_lie_on_the_lattice_of_cells_to_a_nanometre(tmp_path):
    pattern = make_pattern("checkerboard", BW, 2.0, 30, (3000, 2000))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf")
    found = [operands for operands, operator in operators_of(tmp_path / "pattern.pdf") if operator == "cm"]
    matrices = np.array(found, float)
    centre, blocks_pt = matrices[1], matrices[2:]  # matrices[0] is reportlab's own, the identity
    assert centre[4:] * MM_PER_INCH / 72 == pytest.approx(np.array(made.page_mm) / 2, abs=1e-6)
    turn = np.exp(-1j * np.deg2rad(30)) * MM_PER_INCH / 72 / 2.0  # points on the page -> cells
    cells = turn * (blocks_pt[:, 0::2] + 1j * blocks_pt[:, 1::2])
    right, upward, corner = cells.T
    steps, upward = right - 1 / made.subpixels_per_cell, upward - 1j / made.subpixels_per_cell  # into the next block
    for whole in (steps, upward / 1j, corner.real, corner.imag):
        assert np.abs(whole - np.rint(np.real(whole))).max() < 5e-7  # cells of 2 mm
    assert np.all(np.rint(corner.real) % 2 == 0)
    assert np.all(np.rint(corner.imag) % 2 == 0)


@needs_ghostscript
@pytest.mark.parametrize(("spread_um", "angle_deg"), [(62.5, 30), (20.0, 20)])
def test_compensation_leaves_the_share_it_states(tmp_path, spread_um, angle_deg):
    pattern = make_pattern("checkerboard", BW, 0.75, angle_deg, (24, 24))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf", ink_spread_um=spread_um)
    assert abs(made.ink_spread_um - spread_um) <= 1.0
    assert made.shares["black"] == pytest.approx(0.5 * (1 - 2 * made.ink_spread_um / 750) ** 2, abs=1e-6)
    dpi, side = 1440, 1100
    left, bottom = crop_at(made, dpi, side, 1.0, -1.0)
    black = render_ghostscript(tmp_path / "pattern.pdf", dpi, left, bottom, side, side) < 128
    x_mm = (left + np.arange(side) + 0.5) * MM_PER_INCH / dpi - made.page_mm[0] / 2
    y_mm = (bottom + np.arange(side)[::-1] + 0.5) * MM_PER_INCH / dpi - made.page_mm[1] / 2
    wanted = ink_left(pattern.label, 0, x_mm[None, :], y_mm[:, None], made.ink_spread_um / 1000, angle_deg)
    assert np.mean(black != wanted) <= 0.001
    assert abs(hann_mean(black) - made.shares["black"]) <= 0.001


@needs_ghostscript
def test_outlines_grow_in_print_software_and_images_do_not(tmp_path):
    pattern = make_pattern("checkerboard", BW, 0.75, 30, (24, 24))
    dpi, side = 1440, 900
    shares = []
    for vector in (False, True):
        made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf", vector=vector)
        left, bottom = crop_at(made, dpi, side, 0, 0)
        black = render_ghostscript(tmp_path / "pattern.pdf", dpi, left, bottom, side, side) < 128
        wanted = labels_of(pattern, made.page_mm, dpi, left, bottom, side, side) == 0
        assert np.all(black[far_from_edges(wanted, 2)] == wanted[far_from_edges(wanted, 2)])
        shares.append(hann_mean(black))
    assert abs(shares[0] - 0.5) <= 0.001
    assert 0.52 < shares[1] < 0.56  # an outline paints every pixel it touches: about half a pixel at each edge


@needs_ghostscript
def test_outlines_are_shrunk_as_the_images_are(tmp_path):
    pattern = make_pattern("tiles", ("cyan", "red", "black"), 1.0, 20, (24, 24))
    dpi, side, pages = 720, 500, []
    for vector in (False, True):
        made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf", ink_spread_um=100, vector=vector)
        left, bottom = crop_at(made, dpi, side, 0, 0)
        pages.append(render_ghostscript(tmp_path / "pattern.pdf", dpi, left, bottom, side, side))
    same = far_from_edges(pages[0], 2)
    assert same.mean() > 0.2
    assert np.array_equal(pages[0][same], pages[1][same])


@needs_poppler
def test_poppler_paints_the_same_pattern(tmp_path):
    pattern = make_pattern("checkerboard", BW, 0.75, 30, (60, 40))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf")
    dpi, side = 1440, 900
    left, _ = crop_at(made, dpi, side, 0, 0)
    page_px = made.page_mm[1] * dpi / MM_PER_INCH
    top = int(page_px / 2) - side // 2
    black = render_poppler(tmp_path / "pattern.pdf", dpi, left, top, side, side) < 128
    labels = labels_of(pattern, made.page_mm, dpi, left, page_px - top - side, side, side)
    assert abs(hann_mean(black) - 0.5) <= 0.006
    # poppler scales an image to whole pixels before it turns it: up to 2 px off
    away = far_from_edges(labels, 2)
    assert away.mean() > 0.5
    assert np.mean(black[away] == (labels[away] == 0)) > 0.99


def test_pdfium_paints_the_same_pattern(tmp_path):
    pdfium = pytest.importorskip("pypdfium2")
    pattern = make_pattern("checkerboard", BW, 0.75, 30, (20, 20))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf")
    dpi = 720
    width_mm, height_mm = made.page_mm
    margins = [(side - 18.0) / 2 * 72 / MM_PER_INCH for side in (width_mm, height_mm, width_mm, height_mm)]
    document = pdfium.PdfDocument(tmp_path / "pattern.pdf")
    gray = document[0].render(scale=dpi / 72, crop=tuple(margins), grayscale=True).to_numpy().squeeze()[:500, :500]
    document.close()
    ink = (float(gray.max()) - gray) / (float(gray.max()) - gray.min())  # its paper is 253, its K100 not quite black
    assert abs(hann_mean(ink) - 0.5) <= 0.006


SPOTS = {
    "uv red": (("UV red", (0.0, 0.7, 0.6, 0.0))),
    "uv green": (("UV green", (0.6, 0.0, 0.8, 0.0))),
}


def spot_pattern(names, **kwargs):
    """Tiles of the library's inks and of two spot inks of our own."""
    library = dict(colorant_library())
    for name, (spot, cmyk) in SPOTS.items():
        library[name] = replace(library["white"], name=name, cmyk=cmyk, spot=spot)
    return make_pattern("tiles", names, 0.75, 30, (24, 24), library=library, **kwargs)


@needs_ghostscript
@pytest.mark.parametrize("vector", [False, True])
def test_spot_plates_and_process_plates_meet_without_overlap_or_gap(tmp_path, vector):
    pattern = spot_pattern(("uv red", "cyan", "uv green", "black"))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf", vector=vector)
    assert made.plates == ("Cyan", "Black", "UV red", "UV green")
    dpi, side = 720, 500
    left, bottom = crop_at(made, dpi, side, 0, 0)  # 17.6 of 24 mm
    shift = f"<</Install {{{-left * 72 / dpi} {-bottom * 72 / dpi} translate}}>> setpagedevice"
    device = ["-sDEVICE=tiffsep1", f"-r{dpi}", f"-g{side}x{side}", "-dFIXEDMEDIA", f"-sOutputFile={tmp_path}/out.tif"]
    command = ["gs", "-q", "-dNOPAUSE", "-dBATCH", "-dSAFER", *device, "-c", shift, "-f", str(tmp_path / "pattern.pdf")]
    subprocess.run(command, capture_output=True, check=True)  # it lists the plates as errors
    labels = labels_of(pattern, made.page_mm, dpi, left, bottom, side, side)
    count = np.zeros((side, side), int)
    for index, plate in enumerate(("UV red", "Cyan", "UV green", "Black")):
        with Image.open(tmp_path / f"out({plate}).tif") as image:
            ink = ~np.asarray(image.convert("1"))
        count += ink
        if not vector:
            assert np.mean(ink != (labels == index)) <= 0.001
    for plate in ("Magenta", "Yellow"):
        with Image.open(tmp_path / f"out({plate}).tif") as image:
            assert np.asarray(image.convert("1")).all()  # no ink
    # images share every pixel out exactly; of outlines the later ink knocks the earlier one out of pixels of both
    assert np.all(count == 1)


@needs_ghostscript
@needs_poppler
def test_a_proof_shows_spot_inks_as_their_recipe(tmp_path):
    pattern = spot_pattern(("uv red", "black", "uv green"))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf")
    width, height = (round(side * 72 / MM_PER_INCH) for side in made.page_mm)
    device = ["-sDEVICE=tiff32nc", "-r72", f"-sOutputFile={tmp_path}/proof.tif"]
    _run(["gs", "-q", "-dNOPAUSE", "-dBATCH", "-dSAFER", *device, str(tmp_path / "pattern.pdf")])
    with Image.open(tmp_path / "proof.tif") as image:
        proof = np.asarray(image) / 255.0
    assert proof.shape[:2] == pytest.approx((height, width), abs=1)
    found = {tuple(colour) for colour in np.round(proof.reshape(-1, 4), 1)}
    assert {(0.0, 0.7, 0.6, 0.0), (0.6, 0.0, 0.8, 0.0), (0.0, 0.0, 0.0, 1.0)} <= found  # the patches


@needs_ghostscript
def test_rulers_and_pattern_have_their_size_on_the_page(tmp_path):
    pattern = make_pattern("checkerboard", ("cyan", "black"), 1.0, 0, (170, 110))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf")
    dpi = 508  # 20 px a mm
    width, height = (round(side * 20) for side in made.page_mm)
    page = render_ghostscript(tmp_path / "pattern.pdf", dpi, 0, 0, width, height)[::-1]
    to_px = lambda x_mm, y_mm: (round(20 * (x_mm + made.page_mm[0] / 2)), round(20 * (y_mm + made.page_mm[1] / 2)))  # noqa: E731
    column, row = to_px(-85, -55 - 14 + 6)  # above all ticks of the x ruler but the outer two
    dark = np.flatnonzero(page[row, column - 20 : column + 2100] < 128)
    assert dark.max() - dark.min() == pytest.approx(2000, abs=3)  # 100 mm, and a line of 0.1 mm = 2 px
    column, row = to_px(-85 - 9 + 6, -53)
    dark = np.flatnonzero(page[row - 20 : row + 2100, column] < 128)
    assert dark.max() - dark.min() == pytest.approx(2000, abs=3)
    row = to_px(0, 10.5)[1]
    inked = np.flatnonzero(page[row, to_px(-86, 0)[0] : to_px(86, 0)[0]] < 250)
    assert inked.max() - inked.min() + 1 == pytest.approx(3400, abs=1)  # 170 mm of pattern


def test_boxes_are_nested_and_true(tmp_path):
    pattern = make_pattern("checkerboard", BW, 0.75, 30, (600, 400))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf")
    with pikepdf.open(tmp_path / "pattern.pdf") as pdf:
        page = pdf.pages[0].obj
        boxes = {name: np.array([float(v) for v in page[f"/{name}"]]) for name in ("MediaBox", "BleedBox", "TrimBox")}
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


def test_images_have_a_palette_of_inks(tmp_path):
    pattern = make_pattern("checkerboard", ("red", "cyan"), 0.75, 30, (60, 40))
    write_pattern_pdf(pattern, tmp_path / "pattern.pdf", ink_spread_um=10)
    with pikepdf.open(tmp_path / "pattern.pdf") as pdf:
        xobjects = pdf.pages[0].obj.Resources.XObject
        images = [xobjects[name] for name in xobjects]
        assert len(images) == 1  # the torus repeats
        indexed, base, highest, table = images[0].ColorSpace
        assert (str(indexed), str(base), int(highest)) == ("/Indexed", "/DeviceCMYK", 2)
        # red = M + Y, cyan, and the bare paper that the shrunk dots leave
        assert bytes(table).hex() == "00ffff00ff00000000000000"
        assert images[0].Interpolate is False


@pytest.mark.parametrize(
    ("layout", "kwargs", "limit_bytes"),
    [("checkerboard", {}, 400_000), ("blue-noise", {"blue_noise": "zhou-fang"}, 1_200_000)],
)
def test_the_paper_s_sheet_is_small_and_quick(tmp_path, layout, kwargs, limit_bytes):
    pattern = make_pattern(layout, BW, 0.5, 30, (600, 400), **kwargs)
    assert (pattern.cells.size > 1_000_000) == bool(kwargs)  # error diffusion has no period
    start = time.process_time()
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf")
    assert time.process_time() - start < 2.0  # 0.2 and 0.6 s measured
    assert made.bytes == (tmp_path / "pattern.pdf").stat().st_size <= limit_bytes  # 97 and 540 kB measured


def test_nothing_is_written_when_the_sheet_is_impossible(tmp_path):
    pattern = make_pattern("checkerboard", BW, 0.75, 30, (60, 40))
    with pytest.raises(InputError, match="at least 3 dots of the printer"):
        write_pattern_pdf(pattern, tmp_path / "pattern.pdf", dpi=72)
    with pytest.raises(InputError, match="at most 5080 mm"):
        write_pattern_pdf(replace(pattern, size_mm=(6000.0, 100.0)), tmp_path / "pattern.pdf")
    assert list(tmp_path.iterdir()) == []
