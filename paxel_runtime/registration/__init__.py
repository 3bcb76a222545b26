"""Registration: where the camera sees each projector pixel, and captures warped to nodal images."""

from paxel_runtime.registration.table import ChannelRegistration, fit_registration, verdict, warp_to_nodal

__all__ = ["ChannelRegistration", "fit_registration", "verdict", "warp_to_nodal"]
