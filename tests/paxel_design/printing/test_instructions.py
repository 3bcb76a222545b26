import pytest

from paxel_design.patterns import make_pattern
from paxel_design.printing import print_sheet_text, write_pattern_pdf
from paxel_runtime.errors import InputError


def test_the_text_states_what_the_pdf_is(tmp_path):
    pattern = make_pattern("checkerboard", ("red", "white"), 0.75, 30, (600, 400))
    made = write_pattern_pdf(pattern, tmp_path / "pattern.pdf", dpi=720, ink_spread_um=20, caption="Hall 3")
    text = print_sheet_text(pattern, dpi=720, ink_spread_um=20, caption="Hall 3")
    assert text.startswith("Hall 3\n")
    for fact in (
        f"{made.page_mm[0]:.1f} x {made.page_mm[1]:.1f} mm",
        f"{made.trim_mm[0]:.1f} x {made.trim_mm[1]:.1f} mm",
        "600 x 400 mm, dots of 0.75 mm at 30 degrees",
        "exactly 100 %",
        "720 dpi or finer (21.3 dots of the printer",
        f"drawn {made.ink_spread_um:.1f} um smaller at every edge",
        "100 mm along x and along y",
    ):
        assert fact in text
    inks = [line.split() for line in text.splitlines() if "% of the area" in line]
    assert [(ink[0], ink[1]) for ink in inks] == [("red", "M100"), ("white", "no")]
    assert max(len(line) for line in text.splitlines()) <= 120


def test_the_text_does_not_promise_a_compensation_that_is_not_there():
    pattern = make_pattern("checkerboard", ("black", "white"), 0.75, 30, (600, 400))
    assert "ink spread is not compensated" in print_sheet_text(pattern)
    with pytest.raises(InputError, match="at least 3 dots"):
        print_sheet_text(pattern, dpi=72)
