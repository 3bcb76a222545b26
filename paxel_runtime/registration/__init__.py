"""Registration: where the camera sees each projector pixel, captures warped to nodal images, and the known print."""

from paxel_runtime.registration.design import DesignRegistration, register_design
from paxel_runtime.registration.inverse import invert_table
from paxel_runtime.registration.quick import QuickRegistration, quick_frame, register_quick
from paxel_runtime.registration.report import registration_report, verdict
from paxel_runtime.registration.table import (
    TABLES,
    ChannelRegistration,
    fit_registration,
    per_pixel_registration,
    warp_to_nodal,
)

__all__ = [
    "TABLES",
    "ChannelRegistration",
    "DesignRegistration",
    "QuickRegistration",
    "fit_registration",
    "invert_table",
    "per_pixel_registration",
    "quick_frame",
    "register_design",
    "register_quick",
    "registration_report",
    "verdict",
    "warp_to_nodal",
]
