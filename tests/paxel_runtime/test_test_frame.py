"""The 1:1 frame: even grays where nothing is scaled."""

import numpy as np

from paxel_runtime.test_frame import one_to_one_frame


def test_fields_are_half_lit_at_the_pixel_and_the_border_is_one_pixel() -> None:
    frame = one_to_one_frame(320, 200, 3, 10)
    assert frame.shape == (200, 320, 3)
    assert set(np.unique(frame)) == {0, 1023}
    lit = frame[..., 0] > 0
    assert lit[[0, -1]].all()
    assert lit[:, [0, -1]].all()
    assert not lit[1:3, 1:-1].any()
    middle = lit[90:110, 150:170]
    assert (middle ^ np.roll(middle, 1, 0))[1:].all()
    assert (middle ^ np.roll(middle, 1, 1))[:, 1:].all()
    upright = lit[40:60, 56:72]
    assert (upright[0] == upright).all()
    assert (upright[:, 1:] ^ upright[:, :-1]).all()
    for across, down in ((0.2, 0.25), (0.8, 0.25), (0.8, 0.75), (0.2, 0.75), (0.5, 0.5)):
        row, column = round(down * 200), round(across * 320)
        assert lit[row - 20 : row + 20, column - 20 : column + 20].mean() == 0.5
