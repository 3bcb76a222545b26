"""Structured light against an analytic projector and camera: Gaussian blur, ink, shot and read noise."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.special import erf

from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.structured_light import LINE_PERIOD, REASONS, Decoded, LightFrame, decode, kernels, plan_frames
from paxel_runtime.structured_light.ripple import remove_ripple

WIDTH, HEIGHT = 101, 76  # no powers of two, one of them odd
REASON = {text: number for number, text in enumerate(REASONS)}
Captures = dict[str, NDArray[np.uint16]]


@dataclass(frozen=True)
class Wall:
    """A projector's frame on ink, seen by a camera of about 2 pixels a projector pixel (box pixels of 1).

    Light along each axis is the frame's profile under a Gaussian of `blur_px`, integrated in closed form; a camera
    pixel is the mean of 5 x 5 points.
    """

    blur_px: float = 0.4
    ink: float = 1.0
    dot_px: float = 5.12
    noisy: bool = False
    full_well_e: float = 45000.0
    read_noise_e: float = 4.0
    bits: int = 16
    turn_px: float = 0.0
    seed: int = 0

    shape = (172, 224)

    def uv(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Projector coordinates of camera places: turned by 1.2 degrees, keystone, two camera pixels each."""
        c, s = 0.5 * math.cos(0.021), 0.5 * math.sin(0.021)
        a, b = x - 112.0 - self.turn_px, y - 86.0
        z = 1.0 + 1e-4 * a - 7e-5 * b
        return (c * a - s * b) / z + 49.3, (s * a + 1.01 * c * b) / z + 37.6

    @cached_property
    def centres(self) -> NDArray[np.float64]:
        y, x = np.indices(self.shape).astype(np.float64)
        return np.stack(self.uv(x, y), axis=-1)

    @cached_property
    def _points(self) -> list[tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float32]]]:
        y, x = np.indices(self.shape).astype(np.float64)
        points = []
        for dy in (-0.4, -0.2, 0.0, 0.2, 0.4):
            for dx in (-0.4, -0.2, 0.0, 0.2, 0.4):
                u, v = self.uv(x + dx, y + dy)
                c, s = math.cos(math.radians(30)) / self.dot_px, math.sin(math.radians(30)) / self.dot_px
                black = (np.floor(c * u + s * v) + np.floor(c * v - s * u)) % 2 == 0
                reflectance = np.where(black, self.ink, 1.0).astype(np.float32) / 25.0
                points.append((self._index(u, WIDTH), self._index(v, HEIGHT), reflectance))
        return points

    @staticmethod
    def _index(place: NDArray[np.float64], length: int) -> NDArray[np.intp]:
        return np.clip(np.rint((place + 4.0) * 256.0), 0, (length + 8) * 256 - 1).astype(np.intp)

    def _light(self, profile: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Light along the profile's axis from pixel -4 on, at steps of 1/256 pixel."""
        place = np.arange((len(profile) + 8) * 256) / 256.0 - 4.0
        edges = np.flatnonzero(np.diff(np.concatenate(([0], profile.astype(int), [0]))))
        light = np.zeros(len(place))
        for k, edge in enumerate(edges):
            light += (-1) ** k * 0.5 * (1.0 + erf((place - (edge - 0.5)) / (self.blur_px * math.sqrt(2.0))))
        return light.astype(np.float32)

    def capture(self, frame: LightFrame) -> NDArray[np.uint16]:
        across = self._light(frame.profile if frame.axis == "x" else np.ones(WIDTH, bool))
        down = self._light(frame.profile if frame.axis == "y" else np.ones(HEIGHT, bool))
        level = np.full(self.shape, 0.002)
        if frame.profile.any():
            for i, j, reflectance in self._points:
                level += 0.7 * reflectance * across[i] * down[j]
        if self.noisy:
            rng = np.random.default_rng((self.seed, *frame.name.encode()))
            electrons = rng.poisson(level * self.full_well_e) + rng.normal(0.0, self.read_noise_e, level.shape)
            level = electrons / self.full_well_e
        steps = 2**self.bits - 1
        return np.rint(np.rint(np.clip(level, 0.0, 1.0) * steps) * (65535 / steps)).astype(np.uint16)

    def captures(self) -> Captures:
        return {frame.name: self.capture(frame) for frame in plan_frames(WIDTH, HEIGHT)}

    def inside(self, margin_px: float = 1.6) -> NDArray[np.bool_]:
        u, v = self.centres[..., 0], self.centres[..., 1]
        low = margin_px - 0.5
        return (u > low) & (u < WIDTH - 1 - low) & (v > low) & (v < HEIGHT - 1 - low)


@pytest.fixture(scope="module")
def clean() -> tuple[Wall, Captures]:
    wall = Wall()
    return wall, wall.captures()


@pytest.fixture(scope="module")
def printed() -> tuple[Wall, Captures]:
    wall = Wall(ink=0.025, noisy=True, bits=14)
    return wall, wall.captures()


def read(captures: Captures, **changed: NDArray[np.uint16]) -> Callable[[str], NDArray[np.uint16]]:
    """Captures with some replaced; dashes of names are written as underscores."""
    other = {name.replace("_", "-"): capture for name, capture in changed.items()}
    return lambda name: other.get(name, captures[name])


# --- frames ---------------------------------------------------------------------------------------------------------


@given(width=st.integers(16, 4100), height=st.integers(16, 3000))
def test_plan_names_every_place_and_counts_its_frames(width: int, height: int) -> None:
    frames = plan_frames(width, height)
    bits = {"x": math.ceil(math.log2(width / 2)), "y": math.ceil(math.log2(height / 2))}
    assert len(frames) == 2 + 2 * (bits["x"] + bits["y"]) + 2 * LINE_PERIOD
    assert len({frame.name for frame in frames}) == len(frames)
    for axis, length in (("x", width), ("y", height)):
        gray = np.array([f.profile for f in frames if f.name.startswith(f"gray-{axis}") and "inverse" not in f.name])
        inverse = np.array([f.profile for f in frames if f.name.startswith(f"gray-{axis}") and "inverse" in f.name])
        assert np.array_equal(gray, ~inverse)
        changes = np.sum(gray[:, 1:] != gray[:, :-1], axis=0)  # a Gray code: one bit at a time, every second pixel
        assert np.array_equal(changes, np.arange(1, length) % 2 == 0)
        assert len(np.unique(gray[:, ::2], axis=1).T) == (length + 1) // 2
        lines = np.array([f.profile for f in frames if f.name.startswith(f"line-{axis}")])
        assert np.array_equal(np.sum(lines, axis=0), np.ones(length))  # each pixel is lit once


def test_finest_stripes_are_four_pixels_wide() -> None:
    finest = next(f.profile for f in plan_frames(64, 64) if f.name == "gray-x-0")
    edges = np.flatnonzero(np.diff(finest.astype(int)))
    assert np.all(np.diff(edges) == 4)


def test_the_brief_counts_54_frames_for_960_x_540_and_16_for_a_further_channel() -> None:
    assert len(plan_frames(960, 540)) == 54
    further = plan_frames(960, 540, coarse=False)
    assert [f.name for f in further] == [f.name for f in plan_frames(960, 540)[-16:]]


def test_a_frame_fills_the_raster_along_its_axis() -> None:
    frame = next(f for f in plan_frames(20, 30) if f.name == "line-y-3")
    pixels = frame.pixels(20, 30)
    assert pixels.shape == (30, 20)
    assert np.array_equal(np.flatnonzero(pixels[:, 7]), [3, 11, 19, 27])
    with pytest.raises(InputError, match="planned for 30 pixels along y, asked for 31"):
        frame.pixels(20, 31)


def test_a_projector_too_small_is_refused() -> None:
    with pytest.raises(InputError, match="16 to 65536"):
        plan_frames(8, 100)


# --- decoding -------------------------------------------------------------------------------------------------------


def test_positions_are_exact_without_noise_and_ink(clean: tuple[Wall, Captures]) -> None:
    wall, captures = clean
    decoded = decode(captures.__getitem__, WIDTH, HEIGHT)
    inside = wall.inside()
    assert np.all(decoded.reason[inside] == 0)
    error = (decoded.projector_xy - wall.centres)[inside]
    # 16 bits, 1/256-pixel light tables and a box of 5 points leave a few 1e-4; 0.002 px is what the lines must not bias
    assert np.sqrt(np.mean(error**2)) < 5e-4
    assert np.max(np.abs(error)) < 0.002


def test_the_ripple_is_that_of_the_lines_own_harmonics(clean: tuple[Wall, Captures]) -> None:
    wall, captures = clean
    decoded = decode(captures.__getitem__, WIDTH, HEIGHT)

    def harmonic(k: int) -> float:  # of a line: pixel box, Gaussian blur, and the camera's box of half a pixel
        return float(np.exp(-2.0 * (math.pi * wall.blur_px * k / 8.0) ** 2) * np.sinc(k / 8.0) * np.sinc(k / 16.0))

    expected = 8.0 / (2.0 * math.pi) * (harmonic(7) - harmonic(9)) / harmonic(1)
    assert expected > 0.008  # the correction is needed at this blur
    # the camera turns and stretches by 2 %, and the camera's box is 5 points
    assert decoded.ripple_px == pytest.approx((expected, expected), rel=0.06)


@pytest.mark.parametrize("pitch_px", [0.5, 0.71, 1.3])
def test_ripple_is_found_at_any_camera_resolution(pitch_px: float) -> None:
    y, x = np.indices((200, 300)).astype(np.float64)
    truth = pitch_px * x + 0.03 * y + 1e-4 * x**2
    amplitude = 0.02 * (1.0 + 0.3 * x / 300)
    place = (truth + amplitude * np.sin(2.0 * np.pi * truth)).astype(np.float32)
    noise = np.random.default_rng(0).normal(0.0, 0.003, place.shape).astype(np.float32)
    place += noise
    rms_px = remove_ripple(place, np.ones(place.shape, np.float32), np.zeros(place.shape, np.uint8))
    assert rms_px == pytest.approx(0.023, rel=0.01)
    # noise moves the place at which the ripple is taken: 2 pi 0.023 0.003 / sqrt 2 = 3e-4; float32 at 400 px is 2e-5
    assert np.sqrt(np.mean((place - truth - noise) ** 2)) < 4.5e-4


def test_nearly_all_pixels_decode_on_black_ink(printed: tuple[Wall, Captures]) -> None:
    wall, captures = printed
    decoded = decode(captures.__getitem__, WIDTH, HEIGHT)
    assert np.mean(decoded.reason[wall.inside()] == 0) > 0.99
    assert np.all(decoded.reason[~wall.inside(0.0)] != 0)
    error = np.abs(decoded.projector_xy - wall.centres)[wall.inside() & (decoded.reason == 0)]
    # a camera pixel on an edge of ink is pulled by a quarter of its width at most, 0.13 px; a black dot's noise is 0.04
    assert np.percentile(error, 99) < 0.2
    assert decoded.counts["decoded"] == np.sum(np.all(np.isfinite(decoded.projector_xy), axis=-1))
    assert sum(decoded.counts.values()) == decoded.reason.size


def test_noise_is_read_off_the_captures(printed: tuple[Wall, Captures]) -> None:
    _, captures = printed
    noise = decode(captures.__getitem__, WIDTH, HEIGHT).noise
    per_electron = 65535 / 45000
    assert noise.gain == pytest.approx(per_electron, rel=0.05)  # 24 classes of 1600 samples: 1 % each
    # the dark classes still hold the shot noise of 90 electrons, so that the read noise is known less well
    assert noise.read_variance == pytest.approx((4 * per_electron) ** 2 + 4**2 / 12, rel=0.5)


def test_an_8_bit_noisy_camera_decodes_the_white_dots() -> None:
    wall = Wall(ink=0.025, noisy=True, bits=8, full_well_e=8000.0, read_noise_e=12.0, blur_px=0.7)
    decoded = decode(wall.captures().__getitem__, WIDTH, HEIGHT)
    bright = decoded.signal > 0.5 * np.percentile(decoded.signal, 90)
    assert np.mean(decoded.reason[wall.inside() & bright] == 0) > 0.995
    # black ink gives 130 electrons under noise of 14, and an 8-bit step is 31: contrast 4 to 5, where 3 is asked for
    assert np.mean(decoded.reason[wall.inside()] == 0) > 0.8
    rounding = 257.0**2 / 12.0
    assert decoded.noise.read_variance == pytest.approx((12 * 65535 / 8000) ** 2 + rounding, rel=0.5)


def test_the_cheap_set_equals_the_full_one(printed: tuple[Wall, Captures]) -> None:
    _, captures = printed
    full = decode(captures.__getitem__, WIDTH, HEIGHT)
    asked: list[str] = []

    def note(name: str) -> NDArray[np.uint16]:
        asked.append(name)
        return captures[name]

    cheap = decode(note, WIDTH, HEIGHT, guide=full)
    assert asked == [frame.name for frame in plan_frames(WIDTH, HEIGHT, coarse=False)]
    both = (full.reason == 0) & (cheap.reason == 0)
    assert np.sum(both) > 0.999 * np.sum(full.reason == 0)
    # the same lines; only the ripple is measured on slightly other pixels
    assert np.max(np.abs(full.projector_xy - cheap.projector_xy)[both]) < 1e-3


def test_the_cheap_set_follows_a_shift_between_channels(printed: tuple[Wall, Captures]) -> None:
    _, captures = printed
    guide = decode(captures.__getitem__, WIDTH, HEIGHT)
    other = Wall(turn_px=0.6)  # lateral chromatic aberration of 0.6 camera pixels
    decoded = decode(other.captures().__getitem__, WIDTH, HEIGHT, guide=guide)
    inside = other.inside(3.0)
    assert np.mean(decoded.reason[inside] == 0) > 0.999
    assert np.max(np.abs(decoded.projector_xy - other.centres)[inside & (decoded.reason == 0)]) < 0.003


def test_blinded_pixels_are_named(clean: tuple[Wall, Captures]) -> None:
    _, captures = clean
    changed = {name: capture.copy() for name, capture in captures.items()}
    for capture in changed.values():
        capture[40:60, 40:60] = 65535  # a lamp's reflection
        capture[80:100, 80:100] = 131  # a hole
        capture[110:112, 60:62] = 30000  # stuck pixels
    decoded = decode(changed.__getitem__, WIDTH, HEIGHT)
    assert np.all(decoded.reason[80:100, 80:100] == REASON["too dark"])
    assert np.all(decoded.reason[110:112, 60:62] == REASON["too dark"])
    assert np.all(decoded.reason[40:60, 40:60] != 0)
    assert np.all(np.isnan(decoded.projector_xy[decoded.reason != 0]))
    lit = changed["line-x-2"][150, 100:110]
    lit[:] = 65535
    assert np.all(decode(changed.__getitem__, WIDTH, HEIGHT).reason[150, 100:110] == REASON["saturated"])


def test_the_rim_where_lines_lack_a_neighbour_is_left_out(clean: tuple[Wall, Captures]) -> None:
    wall, captures = clean
    decoded = decode(captures.__getitem__, WIDTH, HEIGHT)
    rim = wall.inside(0.3) & ~wall.inside(1.3)
    assert np.all(decoded.reason[rim] == REASON["outside the frame"])


def test_confidence_is_the_noise_of_the_place(printed: tuple[Wall, Captures]) -> None:
    # two sessions that differ by nothing but noise: half of the square of their difference is the variance of each
    _, captures = printed
    again = Wall(ink=0.025, noisy=True, bits=14, seed=1).captures()
    one, two = (decode(session.__getitem__, WIDTH, HEIGHT) for session in (captures, again))
    both = (one.reason == 0) & (two.reason == 0)
    variance = np.mean((one.projector_xy - two.projector_xy)[both] ** 2, axis=-1) / 2.0
    claimed = 0.01 * (1.0 / one.confidence[both] - 1.0)
    for dots in (claimed < np.median(claimed), claimed > np.percentile(claimed, 70)):  # paper, ink
        # gain and read noise of the camera are known to 5 and 50 %, and dark ink's own light is as noisy as its place
        assert np.mean(variance[dots] / claimed[dots]) == pytest.approx(1.0, rel=0.25)
    assert np.all(one.confidence[one.reason != 0] == 0)
    assert np.median(one.confidence[both][claimed < np.median(claimed)]) > 0.95


# --- phase shifting -------------------------------------------------------------------------------------------------


@given(width=st.integers(16, 2000), height=st.integers(16, 1200))
def test_sinusoids_take_the_place_of_lines(width: int, height: int) -> None:
    lines, phase = plan_frames(width, height), plan_frames(width, height, method="phase")
    assert [f.name.replace("line", "phase") for f in lines] == [f.name for f in phase]
    for axis, length in (("x", width), ("y", height)):
        waves = np.array([f.profile for f in phase if f.name.startswith(f"phase-{axis}")])
        assert waves.min() >= 0.0
        assert waves.max() <= 1.0
        assert np.allclose(np.sum(waves, axis=0), 4.0, atol=1e-5)  # float32: half of the light everywhere
        first = np.sum(waves * np.exp(2j * np.pi * np.arange(8) / 8)[:, None], axis=0)
        place = np.angle(first) * 16 / (2 * np.pi)
        assert np.allclose((place - np.arange(length) + 8) % 16 - 8, 0.0, atol=1e-4)


@cache
def pixels_light(length: int, blur_px: float) -> NDArray[np.float32]:
    """Light of each single pixel along an axis, as `Wall` tabulates it, (length, n)."""
    place = np.arange((length + 8) * 256) / 256.0 - 4.0
    light = np.zeros((length, place.size), np.float32)
    for pixel in range(length):
        near = np.abs(place - pixel) < 0.5 + 6.0 * blur_px
        ends = [(place[near] - pixel + side) / (blur_px * math.sqrt(2.0)) for side in (0.5, -0.5)]
        light[pixel, near] = 0.5 * (erf(ends[0]) - erf(ends[1]))
    return light


class GrayWall(Wall):
    """A wall on which a frame's profile may have any level: light adds up."""

    def _light(self, profile: NDArray[np.generic]) -> NDArray[np.float32]:
        return profile.astype(np.float32) @ pixels_light(len(profile), self.blur_px)


def phase_captures(gamma: float) -> Captures:
    """Captures of the phase method by a projector of that response."""
    frames = plan_frames(WIDTH, HEIGHT, method="phase")
    wall = GrayWall()
    return {f.name: wall.capture(LightFrame(f.name, f.axis, f.profile.astype(np.float32) ** gamma)) for f in frames}


@pytest.mark.parametrize("gamma", [1.0, 2.2])
def test_phases_are_exact_whatever_the_response(gamma: float) -> None:
    wall = Wall()
    decoded = decode(phase_captures(gamma).__getitem__, WIDTH, HEIGHT, method="phase")
    inside = wall.inside(6.0)
    assert np.all(decoded.reason[inside] == 0)
    # 8 shifts leave nothing of harmonics 2 to 6 that a response makes
    error = (decoded.projector_xy - wall.centres)[inside]
    assert np.sqrt(np.mean(error**2)) < 1e-3

    def harmonic(k: int) -> float:  # of a sinusoid's steps: pixel box, Gaussian blur, and the camera's box
        return float(np.exp(-2.0 * (math.pi * wall.blur_px * k / 16.0) ** 2) * np.sinc(k / 16.0) * np.sinc(k / 32.0))

    expected = 16.0 / (2.0 * math.pi) * (harmonic(15) - harmonic(17)) / harmonic(1)
    assert decoded.ripple_px == pytest.approx((expected, expected), rel=0.06)  # as for lines


def test_phases_out_of_order_are_named() -> None:
    captures = phase_captures(1.0)
    exchanged = read(captures, phase_y_3=captures["phase-y-5"], phase_y_5=captures["phase-y-3"])
    with pytest.raises(CalibrationError, match="phase-y-3 shows phase-y-5, phase-y-5 shows phase-y-3"):
        decode(exchanged, WIDTH, HEIGHT, method="phase")


# --- captures that are not what they should be ----------------------------------------------------------------------


def test_two_pairs_that_lost_a_partner_to_each_other_are_named(printed: tuple[Wall, Captures]) -> None:
    _, captures = printed
    swapped = read(captures, gray_x_3=captures["gray-y-2"], gray_y_2=captures["gray-x-3"])
    with pytest.raises(CalibrationError, match=r"add up to white \+ black") as caught:
        decode(swapped, WIDTH, HEIGHT)
    assert "gray-x-3 (" in str(caught.value)
    assert "gray-y-2 (" in str(caught.value)
    assert "2 of 12 pairs" in str(caught.value)


def test_the_first_pair_may_be_the_wrong_one(printed: tuple[Wall, Captures]) -> None:
    _, captures = printed
    with pytest.raises(CalibrationError, match=r"1 of 12 pairs.*gray-x-5"):
        decode(read(captures, gray_x_5=captures["gray-x-5-inverse"]), WIDTH, HEIGHT)  # the camera was too quick


@pytest.mark.parametrize("name", ["gray-x-0", "gray-x-2", "gray-x-5", "gray-y-4", "gray-y-5"])
def test_a_capture_exchanged_with_its_inverse_is_named(printed: tuple[Wall, Captures], name: str) -> None:
    _, captures = printed
    exchanged = {**captures, name: captures[f"{name}-inverse"], f"{name}-inverse": captures[name]}
    with pytest.raises(CalibrationError, match=f"{name} and its inverse are exchanged"):
        decode(exchanged.__getitem__, WIDTH, HEIGHT)


@pytest.mark.parametrize(("one", "two"), [("gray-x-1", "gray-x-2"), ("gray-x-0", "gray-x-5"), ("gray-y-4", "gray-y-5")])
def test_bits_exchanged_are_named(printed: tuple[Wall, Captures], one: str, two: str) -> None:
    _, captures = printed
    names = [one, two, f"{one}-inverse", f"{two}-inverse"]
    other = [captures[name] for name in (two, one, f"{two}-inverse", f"{one}-inverse")]
    with pytest.raises(CalibrationError, match=f"{one} and {two} are exchanged"):
        decode({**captures, **dict(zip(names, other, strict=True))}.__getitem__, WIDTH, HEIGHT)


def test_lines_out_of_order_are_named_also_neighbours(printed: tuple[Wall, Captures]) -> None:
    _, captures = printed
    exchanged = read(captures, line_x_3=captures["line-x-4"], line_x_4=captures["line-x-3"])
    with pytest.raises(CalibrationError, match="line-x-3 shows line-x-4, line-x-4 shows line-x-3"):
        decode(exchanged, WIDTH, HEIGHT)
    with pytest.raises(CalibrationError, match="line-y-6 shows no line"):
        decode(read(captures, line_y_6=captures["black"]), WIDTH, HEIGHT)


def test_the_cheap_set_notices_its_order_too(printed: tuple[Wall, Captures]) -> None:
    _, captures = printed
    guide = decode(captures.__getitem__, WIDTH, HEIGHT)
    repeated = read(captures, line_y_5=captures["line-y-4"])
    with pytest.raises(CalibrationError, match="line-y-5 shows line-y-4"):
        decode(repeated, WIDTH, HEIGHT, guide=guide)


def test_a_camera_that_moved_is_noticed(printed: tuple[Wall, Captures]) -> None:
    _, captures = printed
    moved = Wall(ink=0.025, noisy=True, bits=14, turn_px=5.0).captures()
    late = {name: moved[name] if name.startswith(("gray-y", "line")) else captures[name] for name in captures}
    with pytest.raises(CalibrationError, match="something moved while they were taken"):
        decode(late.__getitem__, WIDTH, HEIGHT)
    with pytest.raises(CalibrationError, match="contradict"):
        decode({**captures, **{n: moved[n] for n in captures if n.startswith("line")}}.__getitem__, WIDTH, HEIGHT)


def test_no_light_and_swapped_white_are_refused(printed: tuple[Wall, Captures]) -> None:
    _, captures = printed
    dark = dict.fromkeys(captures, captures["black"])
    with pytest.raises(CalibrationError, match="white must be brighter"):
        decode(dark.__getitem__, WIDTH, HEIGHT)
    with pytest.raises(CalibrationError, match="white must be brighter"):
        decode(read(captures, white=captures["black"], black=captures["white"]), WIDTH, HEIGHT)


def test_captures_of_another_size_or_kind_are_named(printed: tuple[Wall, Captures]) -> None:
    _, captures = printed
    with pytest.raises(CalibrationError, match=r"gray-x-2 has 224 x 171 pixels, the others 224 x 172"):
        decode(read(captures, gray_x_2=captures["gray-x-2"][:-1]), WIDTH, HEIGHT)
    with pytest.raises(CalibrationError, match="line-x-1 must be one plane of uint16, got uint8"):
        decode(read(captures, line_x_1=captures["line-x-1"].astype(np.uint8)), WIDTH, HEIGHT)


def test_captures_may_be_read_only_or_views(printed: tuple[Wall, Captures]) -> None:
    _, captures = printed
    frozen = {}
    for name, capture in captures.items():
        frozen[name] = np.asfortranarray(capture)
        frozen[name].flags.writeable = False
    expected, got = (decode(c.__getitem__, WIDTH, HEIGHT) for c in (captures, frozen))
    assert isinstance(got, Decoded)
    assert np.array_equal(expected.projector_xy, got.projector_xy, equal_nan=True)


# --- kernels against slow references --------------------------------------------------------------------------------


def test_gray_code_with_a_bit_in_doubt_gives_the_edge_or_nothing() -> None:
    bits = 5
    bins = np.arange(2**bits)
    reason = np.zeros((1, bins.size), np.uint8)
    code = bins.astype(np.uint16)[None]
    plain = kernels.gray_to_position(code, np.zeros_like(reason), bits, reason, 3)
    assert np.array_equal(plain[0], 2 * bins + 0.5)
    for bit in range(bits):
        reason = np.zeros_like(reason)
        doubt = np.full_like(reason, bit + 1)
        position = kernels.gray_to_position(code, doubt, bits, reason, 3)[0]
        gray = bins ^ (bins >> 1)
        for here in bins:  # the bin whose Gray code differs in just this bit
            other = int(np.flatnonzero(gray == gray[here] ^ (1 << bit))[0])
            if abs(other - here) == 1:
                assert position[here] == 2 * max(here, other) - 0.5
                assert reason[0, here] == 0
            else:
                assert np.isnan(position[here])
                assert reason[0, here] == 3
    reason = np.zeros_like(reason)
    many = kernels.gray_to_position(code, np.full_like(reason, kernels.MANY), bits, reason, 3)
    assert np.all(np.isnan(many))
    assert np.all(reason == 3)


def test_adding_pairs_and_lines_is_binary_and_fourier() -> None:
    rng = np.random.default_rng(1)
    shape, bits = (7, 9), 6
    index = rng.integers(0, 2**bits, shape)
    gray = index ^ (index >> 1)
    code, doubt = np.zeros(shape, np.uint16), np.zeros(shape, np.uint8)
    for bit in reversed(range(bits)):
        lit = np.where(gray >> bit & 1, 900, 100).astype(np.uint16)
        kernels.add_gray_pair(lit, (1000 - lit).astype(np.uint16), bit, 1.0, 16.0, 3.0, code, doubt)
    assert np.array_equal(code, index)
    assert not doubt.any()
    kernels.add_gray_pair(
        np.full(shape, 500, np.uint16), np.full(shape, 510, np.uint16), 2, 1.0, 16.0, 3.0, code, doubt
    )
    assert np.all(doubt == 3)

    lines = rng.integers(0, 60000, (8, *shape)).astype(np.uint16)
    wave, total, clipped = np.zeros((4, *shape), np.float32), np.zeros(shape, np.float32), np.zeros(shape, bool)
    for k, line in enumerate(lines):
        kernels.add_line(line, math.cos(math.pi * k / 4), math.sin(math.pi * k / 4), 50000, wave, total, clipped)
    first = np.conj(np.fft.fft(lines, axis=0)[1])
    assert np.allclose(wave[2] + 1j * wave[3], np.conj(np.fft.fft(lines, axis=0)[2]), atol=0.05)
    assert np.allclose(wave[0] + 1j * wave[1], first, atol=0.05)  # float32 sums of eight values up to 60000
    assert np.array_equal(total, np.sum(lines, axis=0))
    assert np.array_equal(clipped, np.any(lines >= 50000, axis=0))


def test_filling_takes_the_nearest_known_value_within_reach() -> None:
    rng = np.random.default_rng(2)
    values = np.where(rng.random((15, 18)) < 0.04, rng.random((15, 18)), np.nan).astype(np.float32)
    filled = kernels.fill_near(values, 3)
    known = np.argwhere(np.isfinite(values))
    for row, column in np.ndindex(values.shape):
        distance = np.hypot(*(known - (row, column)).T)
        if distance.min() <= 3:
            assert filled[row, column] in values[tuple(known[distance == distance.min()].T)]
        else:
            assert distance.min() >= 3
