"""Rebuild cie_d65_5nm.csv and cie_d50_5nm.csv of paxel_runtime/data from colour-science. Run from a checkout::

python reports/make_illuminants.py
"""

from __future__ import annotations

from pathlib import Path

import colour

FOLDER = Path(__file__).parent.parent / "paxel_runtime" / "data"


def main() -> None:
    """Write both tables: 300-780 nm by 5 nm, with the ultraviolet that excites what fluoresces."""
    for name in ("D65", "D50"):
        spectrum = colour.SDS_ILLUMINANTS[name]
        rows = [f"{nm:.0f},{spectrum[nm]:g}" for nm in range(300, 781, 5)]
        header = f"# CIE standard illuminant {name}, 300-780 nm by 5 nm, relative (CIE 018:2019): wavelength_nm, power"
        (FOLDER / f"cie_{name.lower()}_5nm.csv").write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
