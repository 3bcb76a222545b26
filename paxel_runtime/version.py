"""The version of the distribution, written into every file Paxel makes."""

__all__ = ["WRITER", "__version__"]

__version__ = "0.1.0"

WRITER = f"paxel-toolkit {__version__}"
