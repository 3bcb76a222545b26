"""Structured light: the frames to show, and captures -> sub-pixel projector coordinates of every camera pixel."""

from paxel_runtime.structured_light.checks import LINE_PERIOD, REASONS, SensorNoise
from paxel_runtime.structured_light.decoding import Decoded, decode
from paxel_runtime.structured_light.frames import LightFrame, plan_frames

__all__ = ["LINE_PERIOD", "REASONS", "Decoded", "LightFrame", "SensorNoise", "decode", "plan_frames"]
