"""The pinned qualities of the virtual bench: how far it strays from a perfect projector, print, camera and meter.

The values are those of the design, section 6; nobody tunes them until a test is green. Each physical effect has its
own field, so that `dataclasses.replace` switches one on or off. This file knows numbers only.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from types import MappingProxyType

__all__ = ["QUALITIES", "BenchQuality"]


@dataclass(frozen=True)
class BenchQuality:
    """One column of the design's table; lengths named ``camera_px`` are in camera pixels on the wall.

    Attributes
    ----------
    black : float
        Intensity of a channel at code 0, as a share of full.
    cross_talk : float
        Loss of a channel when all others are at full, times half their number.
    drift : float
        Standard deviation of all light over a session.
    fringing, fringing_exponent : float
        Loss of a pixel to darker neighbours, and the exponent of the difference.
    dimming : float
        Loss of all light at average picture level 1.
    fall_off : float
        Loss of light at the corner of the projection.
    blur_centre_px, blur_corner_px : float
        Standard deviation of the projector's Gaussian blur, projector pixels.
    fill_factor : float
        Area of the lit part of a projector pixel, 0..1 (not pinned: typical of a DLP).
    chromatic_shift_camera_px : float
        Shift of the outermost channels against the middle one at the corner (lateral chromatic aberration).
    wave_camera_px, wave_correlation_px : float
        Rms of the sheet's displacement along each axis, and the distance in projector pixels at which its correlation
        has fallen to 1/e.
    ink_spread_um : float
        Growth of every edge of ink.
    ragged_um, ragged_correlation_um : float
        Rms of an edge's noise and its correlation length (1/e).
    print_scale_x, print_scale_y : float
        Relative error of the print's size.
    ink_offset_um : float
        Distance of every ink from the first (misregistration).
    scattering_mm : float
        Standard deviation of the light's lateral spread in the paper; 0 = none (Murray-Davies).
    glare : float
        Share of the camera's light that is spread over the picture.
    full_well_e, read_noise_e : float
        Electrons at saturation, and the noise of reading them.
    camera_bits : int
        Of the camera's converter.
    meter_noise_level, meter_noise_band : float
        Relative standard deviation of a reading as a whole, and of each band of it.
    """

    black: float
    cross_talk: float
    drift: float
    fringing: float
    fringing_exponent: float
    dimming: float
    fall_off: float
    blur_centre_px: float
    blur_corner_px: float
    fill_factor: float
    chromatic_shift_camera_px: float
    wave_camera_px: float
    wave_correlation_px: float
    ink_spread_um: float
    ragged_um: float
    ragged_correlation_um: float
    print_scale_x: float
    print_scale_y: float
    ink_offset_um: float
    scattering_mm: float
    glare: float
    full_well_e: float
    read_noise_e: float
    camera_bits: int
    meter_noise_level: float
    meter_noise_band: float


QUALITIES = MappingProxyType(
    {
        "realistic": BenchQuality(
            black=1 / 1000,
            cross_talk=0.02,
            drift=0.003,
            fringing=0.10,
            fringing_exponent=1.3,
            dimming=0.0,
            fall_off=0.24,
            blur_centre_px=0.36,
            blur_corner_px=0.5,
            fill_factor=0.92,
            chromatic_shift_camera_px=0.25,
            wave_camera_px=0.1,
            wave_correlation_px=60.0,
            ink_spread_um=10.0,
            ragged_um=15.0,
            ragged_correlation_um=50.0,
            print_scale_x=0.002,
            print_scale_y=-0.001,
            ink_offset_um=20.0,
            scattering_mm=0.06,
            glare=0.01,
            full_well_e=45_000.0,
            read_noise_e=4.0,
            camera_bits=14,
            meter_noise_level=0.001,
            meter_noise_band=0.003,
        ),
        "ideal": BenchQuality(
            black=0.0,
            cross_talk=0.0,
            drift=0.0,
            fringing=0.0,
            fringing_exponent=1.0,
            dimming=0.0,
            fall_off=0.0,
            blur_centre_px=0.36,
            blur_corner_px=0.36,
            fill_factor=1.0,
            chromatic_shift_camera_px=0.0,
            wave_camera_px=0.0,
            wave_correlation_px=60.0,
            ink_spread_um=0.0,
            ragged_um=0.0,
            ragged_correlation_um=50.0,
            print_scale_x=0.0,
            print_scale_y=0.0,
            ink_offset_um=0.0,
            scattering_mm=0.06,
            glare=0.0,
            full_well_e=inf,
            read_noise_e=0.0,
            camera_bits=16,
            meter_noise_level=0.0,
            meter_noise_band=0.0,
        ),
        "harsh": BenchQuality(
            black=1 / 400,
            cross_talk=0.12,
            drift=0.01,
            fringing=0.35,
            fringing_exponent=1.6,
            dimming=0.08,
            fall_off=0.40,
            blur_centre_px=0.45,
            blur_corner_px=0.9,
            fill_factor=0.92,
            chromatic_shift_camera_px=0.6,
            wave_camera_px=0.3,
            wave_correlation_px=60.0,
            ink_spread_um=25.0,
            ragged_um=25.0,
            ragged_correlation_um=50.0,
            print_scale_x=0.005,
            print_scale_y=0.001,
            ink_offset_um=50.0,
            scattering_mm=0.1,
            glare=0.03,
            full_well_e=8_000.0,
            read_noise_e=12.0,
            camera_bits=8,
            meter_noise_level=0.003,
            meter_noise_band=0.01,
        ),
    }
)
"""The qualities by name, the default first."""
