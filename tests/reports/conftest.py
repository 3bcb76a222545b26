"""The scripts of ``reports/`` stand beside the tests, not in the installed package: last on the path, behind it."""

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2]))
