"""Every error Paxel raises on purpose; the command line prints its text and nothing else.

An error says what is wrong, the rule, what was found, and the cure::

    PaxelError                 anything below; exit code 1 on the command line
    ├── UsageError             what a person asked for cannot be done as asked; exit code 2   (ValueError)
    │   ├── SettingsError      paxel.toml: the key, the rule, the value found, the line
    │   └── InputError         a picture, a model or an argument that cannot be used
    ├── InstallationError      a stage of the installation folder is missing or damaged      (RuntimeError)
    ├── CalibrationError       captures or readings that do not make a calibration           (RuntimeError)
    ├── GamutError             a gamut or a mesh that does not exist or is not closed        (RuntimeError)
    └── DeviceError            a projector, camera or meter does not answer as it should     (RuntimeError)
"""

__all__ = [
    "CalibrationError",
    "DeviceError",
    "GamutError",
    "InputError",
    "InstallationError",
    "PaxelError",
    "SettingsError",
    "UsageError",
]


class PaxelError(Exception):
    """Anything that Paxel raises on purpose."""

    exit_code = 1


class UsageError(PaxelError, ValueError):
    """What a person asked for cannot be done as asked."""

    exit_code = 2


class SettingsError(UsageError):
    """A key of paxel.toml breaks its rule."""


class InputError(UsageError):
    """A picture, a model file or an argument cannot be used."""


class InstallationError(PaxelError, RuntimeError):
    """A stage of the installation folder is missing, damaged or out of date."""


class CalibrationError(PaxelError, RuntimeError):
    """The captures or readings do not make a calibration."""


class GamutError(PaxelError, RuntimeError):
    """A gamut or a mesh does not exist, or is not closed."""


class DeviceError(PaxelError, RuntimeError):
    """A projector, a camera or a meter does not answer as it should."""
