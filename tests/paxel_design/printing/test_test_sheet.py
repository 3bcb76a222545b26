"""The test sheet: what stands on it is what its table asks for, and dots are drawn at their own size."""

import io
import subprocess
from shutil import which

import numpy as np
import pikepdf
import pytest
from PIL import Image

from paxel_design.printing.ink_spread import parse_readings
from paxel_design.printing.test_sheet import DOT_SIZES_MM, measurements_table, patches_of, write_test_sheet
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import colorant_library

LIBRARY = colorant_library()


def inks(*names):
    return [LIBRARY[name] for name in names]


def test_paper_comes_first_then_each_ink_solid_and_in_three_sizes():
    patches = patches_of(inks("black", "white", "cyan"), 1440)
    assert [patch.number for patch in patches] == list(range(1, 10))
    assert [patch.dots for patch in patches] == ["paper", *(["solid", *(f"{s:g}" for s in DOT_SIZES_MM)] * 2)]
    assert [patch.colorant.name for patch in patches[1:]] == ["black"] * 4 + ["cyan"] * 4
    assert patches[1].name == "2  black, solid"
    assert patches[2].name == "3  black, 0.15 mm"


def test_a_coarse_printer_gets_larger_dots_of_at_least_five_pixels():
    sizes = [patch.dot_mm for patch in patches_of(inks("black"), 360) if patch.dot_mm]
    assert sizes[0] * 360 / 25.4 >= 5
    assert np.allclose(np.array(sizes) / sizes[0], [1, 2, 4])


def test_inks_that_no_reading_could_tell_from_paper_are_named():
    with pytest.raises(InputError, match="an ink that is darker than the paper, got uv-red, white"):
        patches_of(inks("uv-red", "white"), 1440)


def test_the_table_filled_in_is_read_back_patch_by_patch():
    patches = patches_of(inks("black", "yellow"), 1440)
    filled = measurements_table(patches).replace(",,,", ",1,2,3")
    readings = parse_readings(filled)
    assert [(r.patch, r.dot_mm) for r in readings] == [(str(patch.number), patch.dot_mm) for patch in patches]
    assert readings[0].colorant == "white"
    with pytest.raises(InputError, match="fill it in"):
        parse_readings(measurements_table(patches))


def test_the_sheet_is_one_page_of_pdf_x_4_and_always_the_same(tmp_path):
    for name in ("a.pdf", "b.pdf"):
        write_test_sheet(inks("black", "white"), tmp_path / name)
    content = (tmp_path / "a.pdf").read_bytes()
    assert content == (tmp_path / "b.pdf").read_bytes()
    with pikepdf.open(io.BytesIO(content)) as pdf:
        assert len(pdf.pages) == 1
        assert "/OutputIntents" in pdf.Root
        forms = pdf.pages[0].Resources.XObject
        assert sum(str(name).startswith("/Patch-") for name, _ in forms.items()) == 4


@pytest.mark.skipif(which("gs") is None, reason="needs Ghostscript")
def test_half_of_every_dotted_patch_is_ink(tmp_path):
    patches = write_test_sheet(inks("black", "white"), tmp_path / "sheet.pdf")
    dpi = 300.0
    command = ["gs", "-q", "-dNOPAUSE", "-dBATCH", "-dSAFER", "-sDEVICE=pnggray", f"-r{dpi}"]
    subprocess.run([*command, f"-sOutputFile={tmp_path / 'sheet.png'}", tmp_path / "sheet.pdf"], check=True)
    picture = np.asarray(Image.open(tmp_path / "sheet.png").convert("L")).astype(float)
    step = 25.4 / dpi
    light = {}
    for patch in patches:
        x, y = (v + 2.0 for v in patch.lower_left_mm)  # 18 mm of the 22
        column, row = (int(side / 2 + v / step) for side, v in ((picture.shape[1], x), (picture.shape[0], -y)))
        side = int(18 / step)
        light[patch.dots] = picture[row - side : row, column : column + side].mean()
    assert light["paper"] == 255
    for size in DOT_SIZES_MM:
        share = (light["paper"] - light[f"{size:g}"]) / (light["paper"] - light["solid"])
        # 18 mm hold 30 dots of 0.6 mm and parts of some: half to 0.4 %, and the smallest has only four of these pixels
        assert share == pytest.approx(0.5, abs=0.01)
