"""Fig. 6 of the paper: photographs whose hue or chroma changes between the print and a white sheet.

A slight hue shift, a drastic one and a chroma change, on the b/w checkerboard with K = 3. Seen and compared: by how
much hue turns and chroma changes between the surfaces, and what of lightness and chroma the print's gamut leaves.
"""

from __future__ import annotations

import sys

from paxel_design.contact_sheet import Group
from reports.paper import Figure, Item, Result, Run, run_item
from reports.shared_installations import seen_row, shared, show_all, write_sheet

ITEM = Item(
    "fig06_hue_and_chroma",
    "Fig. 6",
    "photographs: a hue shift of 45 degrees, a drastic one, a chroma change (K = 3); lightness contrast is kept, a "
    "larger shift has less saturation",
    ("bw-checkerboard",),
)
EFFECTS = {
    "hue shift by 45 degrees": ("hue-shift:45", ("coffee",)),
    "hue shift by 135 degrees": ("hue-shift:135", ("coffee",)),
    "30 % of the chroma": ("chroma:0.3", ("motorcycle_left",)),
}


def make(run: Run) -> Result:
    """Project, look, compare; the quick set leaves out the change of chroma."""
    names = {words: f"fig06-{effect.replace(':', '-').replace('.', '_')}" for words, (effect, _) in EFFECTS.items()}
    chosen = list(EFFECTS)[:2] if run.quick else list(EFFECTS)
    installation = shared("bw-checkerboard", run.quick)
    shown = show_all(installation, {names[words]: EFFECTS[words] for words in chosen})
    figures, relations, groups = {}, {}, []
    for words in chosen:
        one = shown[names[words]]
        effect, value = EFFECTS[words][0].split(":")
        on_print, change = one.preview["on_pattern"], one.preview["change"]
        low, high = on_print["L_range"]
        figures |= {
            f"{words}: hue turned": Figure(change["hue_turn_deg"], "degrees", "hue angle"),
            f"{words}: chroma on white over that on the print": Figure(change["chroma_ratio"], "", "ratio"),
            f"{words}: mean chroma on the print": Figure(on_print["chroma_mean"], "chroma", "CIELAB"),
            f"{words}: range of lightness on the print": Figure(high - low, "L*", "CIELAB"),
            f"{words}: dE00 to the mapped picture, print": Figure(on_print["dE00_mean"], "dE00", "colour difference"),
            f"{words}: dE00 to the mapped picture, white": Figure(
                one.preview["on_white"]["dE00_mean"], "dE00", "colour difference"
            ),
        }
        turn, ratio = (float(value), 1.0) if effect == "hue-shift" else (0.0, float(value))
        relations[f"{words}: hue turns by {turn:g} degrees, within 5"] = abs(change["hue_turn_deg"] - turn) < 5
        relations[f"{words}: chroma is {ratio:g} of what it was, within 0.1"] = (
            abs(change["chroma_ratio"] - ratio) < 0.1
        )
        relations[f"{words}: lightness keeps a range of 50 on the print"] = high - low > 50
        groups.append(Group(f"{words[0].upper()}{words[1:]}", (seen_row(one, "seen"),)))
    small, large = (figures[f"hue shift by {a} degrees: mean chroma on the print"].value for a in (45, 135))
    relations["the larger hue shift has less chroma"] = large < small
    picture = f"{ITEM.name}.jpg"
    write_sheet(run.folder / picture, groups, "Hue and chroma", "after the paper's Fig. 6; exposed as the eye adapts")
    turns = " and ".join(f"{figures[f'{words}: hue turned'].value:.0f}" for words in chosen[:2])
    ours = f"hue turned by {turns} degrees; mean chroma {small:.0f} at 45 degrees, {large:.0f} at 135; lightness kept"
    return Result(ours, figures, relations, (picture,))


if __name__ == "__main__":
    sys.exit(run_item(ITEM, make))
