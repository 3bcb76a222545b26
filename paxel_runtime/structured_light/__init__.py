"""Structured light: the frames to show, and captures -> sub-pixel projector coordinates of every camera pixel."""

from paxel_runtime.structured_light.checks import LINE_PERIOD, REASONS, SensorNoise
from paxel_runtime.structured_light.decoded import Decoded
from paxel_runtime.structured_light.decoding import decode
from paxel_runtime.structured_light.frames import LightFrame, Method, plan_frames, plan_gray_sequence
from paxel_runtime.structured_light.gray_sequence import decode_gray_sequence

__all__ = [
    "LINE_PERIOD",
    "REASONS",
    "Decoded",
    "LightFrame",
    "Method",
    "SensorNoise",
    "decode",
    "decode_gray_sequence",
    "plan_frames",
    "plan_gray_sequence",
]
