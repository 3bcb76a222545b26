"""What an installation would gain by a change: of its print, its light, its sheets, its clusters or its viewers.

Gains are computed, never looked up: exactly from the measured matrices where those tell it, else as the ratio of two
prints simulated alike, applied to the installation's own figures.
"""

from paxel_design.what_if.case import Case, PrintCase, case_of
from paxel_design.what_if.changes import AIMS, BASES, LEAST_GAIN, Change, Number, helpful, idle
from paxel_design.what_if.figures import Room, common_range, room_of
from paxel_design.what_if.possible import possible_changes
from paxel_design.what_if.simulated_print import Lighting, simulated_print

__all__ = [
    "AIMS",
    "BASES",
    "LEAST_GAIN",
    "Case",
    "Change",
    "Lighting",
    "Number",
    "PrintCase",
    "Room",
    "case_of",
    "common_range",
    "helpful",
    "idle",
    "possible_changes",
    "room_of",
    "simulated_print",
]
