"""The section on gamuts: what the installation can show in which effect, as volumes, bodies and areas.

A list of parts; where figures come from stands in `gamut_sets`, words without figures in `gamut_texts`.
"""

from __future__ import annotations

from paxel_design.gamut import JointGamut
from paxel_design.gamut.primaries import has_primaries
from paxel_design.report.content import Block, Paragraph, Section, Verdicts
from paxel_design.report.sections.gamut_areas import hue, lightness
from paxel_design.report.sections.gamut_bodies import full_gamuts, product_pair, sub_gamuts, volumes
from paxel_design.report.sections.gamut_sets import colour_sets
from paxel_design.report.sections.parts import on_the_bench
from paxel_design.report.sections.primaries import primaries
from paxel_design.report.source import ReportSource

__all__ = ["section"]


def section(source: ReportSource) -> Section:
    """What the model can show: volumes, sub-gamuts, lightness and hue areas, product pair.

    Parameters
    ----------
    source : ReportSource
        Records of ``gamut/`` are taken where they are up to date; what is missing is computed (some seconds).

    Raises
    ------
    InputError
        If the model has no joint gamut.
    """
    joint = JointGamut(source.model)
    sets, missing = colour_sets(source, joint)
    parts = [volumes(source, sets, missing), full_gamuts(source, sets)]
    if has_primaries(source.model):
        parts.append(primaries(source))
    if source.model.white is not None:
        parts += [sub_gamuts(source, sets), lightness(source, joint), hue(source, joint), product_pair(source, sets)]
    quantities = {name: quantity for part in parts for name, quantity in part.quantities.items()}
    verdicts = tuple(verdict for part in parts for verdict in part.verdicts)
    blocks: list[Block] = [Paragraph(_introduction(source))]
    if verdicts:
        blocks.append(Verdicts("gamut-verdicts", f"What the gamuts allow{on_the_bench(source)}.", verdicts))
    blocks += [block for part in parts for block in part.blocks]
    return Section("gamut", "Gamuts", tuple(blocks), quantities, verdicts)


def _introduction(source: ReportSource) -> str:
    two_surfaces = source.model.white is not None
    white = "full projection on white paper" if two_surfaces else "the model's white point"
    text = (
        "A gamut is a set of colours that can be shown. Its size is a volume in CIELAB, a space in which equal "
        f"distances look about equally large: L* is lightness, from 0 (black) to 100 ({white}), a* runs from green to "
        "red, b* from blue to yellow. For scale: all colours of an ordinary screen (sRGB) fill 820 300 cubic units."
    )
    if two_surfaces:
        text += (
            " Each effect allows fewer colours than the full gamut, because the other surface has to follow: its "
            "sub-gamut."
        )
    return text
