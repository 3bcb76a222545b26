"""paxel.toml: the only file a person writes. Its keys and rules, presets, how it is read and how it is written.

Nothing here reads a stage's results.
"""

from paxel_runtime.settings.presets import DEMO_OVERRIDES, PRESETS
from paxel_runtime.settings.reading import load_settings, make_settings
from paxel_runtime.settings.tables import BENCH_CHANNELS, PAPERS, SPECTRA, ColorantSettings, Response, Settings
from paxel_runtime.settings.writing import change_toml, settings_to_toml

__all__ = [
    "BENCH_CHANNELS",
    "DEMO_OVERRIDES",
    "PAPERS",
    "PRESETS",
    "SPECTRA",
    "ColorantSettings",
    "Response",
    "Settings",
    "change_toml",
    "load_settings",
    "make_settings",
    "settings_to_toml",
]
