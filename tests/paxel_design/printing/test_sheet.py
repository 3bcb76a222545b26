import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paxel_design.patterns import make_pattern
from paxel_design.printing.font import text_width_mm
from paxel_design.printing.sheet import BLEED_MM, SLUG_MM, Patch, Sheet, sheet_of
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import colorant_library

QUIET_MODULES = (1, 4)  # of bare paper that a marker of OpenCV, and a QR code (ISO 18004), must have around


def bw(size_mm=(600.0, 400.0), dot_size_mm=0.75):
    return make_pattern("checkerboard", ("black", "white"), dot_size_mm, 30, size_mm)


def boxes_of(sheet: Sheet):
    """Bounding boxes (x0, y0, x1, y1) of patches and texts."""
    for patch in sheet.patches:
        (x, y), (width, height) = patch.lower_left_mm, patch.size_mm
        yield x, y, x + width, y + height
    for modules in sheet.modules:
        (x, y), (width, height) = modules.upper_left_mm, modules.size_mm
        quiet = QUIET_MODULES[len(modules.rows) > 6] * modules.module_mm
        yield x - quiet, y - height - quiet, x + width + quiet, y + quiet
    for text in sheet.texts:
        width = text_width_mm(text.text, text.height_mm)
        x = text.at_mm[0] - {"left": 0.0, "middle": 0.5, "right": 1.0}[text.anchor] * width
        yield x, text.at_mm[1] - 0.22 * text.height_mm, x + width, text.at_mm[1] + 0.74 * text.height_mm


def overlap(a, b):
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


@settings(deadline=None)
@given(size_mm=st.tuples(st.floats(5, 3000), st.floats(5, 3000)), caption=st.text("abc WM°", max_size=120))
def test_furniture_lies_between_pattern_and_trim_and_nothing_overlaps(size_mm, caption):
    sheet = sheet_of(bw(size_mm), dpi=1440, ink_spread_um=12.5, caption=caption)
    area = (-size_mm[0] / 2, -size_mm[1] / 2, size_mm[0] / 2, size_mm[1] / 2)
    boxes = list(boxes_of(sheet))
    for box in boxes:
        assert not overlap(box, area)
        assert max(abs(box[0]), abs(box[2])) < sheet.trim_mm[0] / 2
        assert max(abs(box[1]), abs(box[3])) < sheet.trim_mm[1] / 2
    assert not any(overlap(a, b) for a, b in itertools.combinations(boxes, 2))
    for line in sheet.lines:
        (x0, x1), (y0, y1) = (sorted(pair) for pair in zip(line.start_mm, line.end_mm, strict=True))
        hull = (x0 - 0.05, y0 - 0.05, x1 + 0.05, y1 + 0.05)
        assert not overlap(hull, area)
        assert not any(overlap(hull, box) for box in boxes)
        outside_trim = max(-x0, x1) - sheet.trim_mm[0] / 2, max(-y0, y1) - sheet.trim_mm[1] / 2
        assert max(outside_trim) < -1 or BLEED_MM < max(outside_trim) < SLUG_MM  # rulers within, crop marks beyond


@pytest.mark.parametrize("size_mm", [(20.0, 30.0), (150.0, 90.0), (600.0, 400.0)])
def test_both_rulers_are_100_mm_between_their_longest_ticks(size_mm):
    sheet = sheet_of(bw(size_mm), dpi=1440, ink_spread_um=0, caption="")
    ticks = [line for line in sheet.lines if abs(sum(line.end_mm) - sum(line.start_mm)) == pytest.approx(7.0)]
    upright = sorted(line.start_mm[0] for line in ticks if line.start_mm[0] == line.end_mm[0])
    level = sorted(line.start_mm[1] for line in ticks if line.start_mm[1] == line.end_mm[1])
    assert len(upright) == len(level) == 2
    assert upright[1] - upright[0] == pytest.approx(100.0, abs=1e-9)
    assert level[1] - level[0] == pytest.approx(100.0, abs=1e-9)


def test_there_is_a_patch_of_every_colorant_and_of_bare_paper():
    def solids(*colorants):
        pattern = make_pattern("checkerboard", colorants, 0.75, 30, (100, 100))
        patches: tuple[Patch, ...] = sheet_of(pattern, dpi=1440, ink_spread_um=0, caption="").patches
        assert all(min(patch.size_mm) >= 20 for patch in patches)  # the meter's usual aperture
        return [patch.colorant and patch.colorant.name for patch in patches]

    assert solids("black", "white") == ["black", None]
    assert solids("red", "cyan") == ["red", "cyan", None]
    assert set(colorant_library()) >= {"red", "cyan"}


@pytest.mark.parametrize(
    ("pattern", "change", "text"),
    [
        (bw(dot_size_mm=0.05), {}, r"at least 3 dots of the printer, got 2.83 .*at least 0.053 mm or 1524 dpi"),
        (bw(), {"dpi": 0}, "dpi must be > 0"),
        (bw(), {"caption": "x" * 121}, "at most 120 characters, got 121"),
        (bw(), {"caption": "two\nlines"}, "one line"),
        (bw(), {"caption": "日本"}, "Latin letters"),
    ],
)
def test_an_impossible_sheet_is_named_with_what_would_work(pattern, change, text):
    with pytest.raises(InputError, match=text):
        sheet_of(pattern, **({"dpi": 1440, "ink_spread_um": 0.0, "caption": ""} | change))


def test_fluorescent_inks_ask_for_paper_without_brightener() -> None:
    """It would shine as brightly as the inks; the sheet itself says so, as instructions get lost."""
    glowing = make_pattern("tiles", ("uv-red", "uv-green", "uv-blue"), 0.75, 30.0, (100.0, 60.0))
    plain = make_pattern("tiles", ("red", "green", "blue"), 0.75, 30.0, (100.0, 60.0))
    words = [
        " ".join(text.text for text in sheet_of(pattern, dpi=1440, ink_spread_um=0.0, caption="").texts)
        for pattern in (glowing, plain)
    ]
    assert "without optical brightener" in words[0]
    assert "brightener" not in words[1]
