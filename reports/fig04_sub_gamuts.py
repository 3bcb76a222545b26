"""Fig. 4 of the paper: the colours on the print from which an effect is possible, inside all that it can show.

(a) A hue shift by 45, 90 and 135 degrees on the white sheet. (b) Decolorisation (to a gray of any lightness),
neutralisation (to CIELAB 50, 0, 0) and the full change. Exact sets of a b/w checkerboard with K = 2, the paper's setup;
its own are samples of 21 steps an input, with a tolerance of dE00 2 where ours have none. The paper gives no volumes:
what its text says of the shapes is checked.
"""

from __future__ import annotations

import sys

import numpy as np
from PIL import Image

from paxel_design.gamut import JointGamut, coverage, subgamut_and_mesh
from paxel_design.gamut.scenes import SceneBody, write_scene
from paxel_runtime.calibration import fit_model
from paxel_runtime.captures.acquisition import load_captures
from paxel_runtime.model.effects import parse_effect
from paxel_runtime.storage import read_image
from reports.paper import Figure, Item, Result, Run, run_item
from reports.shared_installations import shared

ITEM = Item(
    "fig04_sub_gamuts",
    "Fig. 4",
    "greater hue shifts leave less chroma and all the lightness; neutralisation loses lightness; the full change is "
    "small (K = 2; no volumes given)",
    ("bw-checkerboard",),
)
SHIFTS_DEG = (45, 90, 135)
PARTS = {
    "a": {
        f"hue-shift:{angle}": color for angle, color in zip(SHIFTS_DEG, ("#9ecae1", "#3182bd", "#08306b"), strict=True)
    },
    "b": {"decolorize": "#1f77b4", "neutralize:50,0,0": "#2ca02c", "full-change": "#d62728"},
}
"""Effects and colours of their bodies; those of (b) are the paper's."""


def make(run: Run) -> Result:
    """Volumes, shapes and both pictures."""
    installation = shared("bw-checkerboard", run.quick)
    captures = load_captures(installation)
    names = tuple(captures.facts["clusters"]["2"]["names"])
    joint = JointGamut(fit_model(captures.readings, captures.plan, installation.settings.projector.channels, names))
    texts = ["full", *PARTS["a"], *PARTS["b"]]
    meshes = {
        text: subgamut_and_mesh(joint, parse_effect(text), "pattern", step=4.0 if run.quick else 2.0)[1]
        for text in texts
    }
    figures, chroma, L_range, inside = {}, {}, {}, {}
    for text, mesh in meshes.items():
        chroma[text] = float(np.hypot(mesh.Lab[:, 1], mesh.Lab[:, 2]).max())
        L_range[text] = float(np.ptp(mesh.Lab[:, 0]))
        inside[text] = coverage(meshes["full"], mesh)
        figures[f"{text}: volume"] = Figure(mesh.volume, "CIELAB units cubed", "volume")
        figures[f"{text}: largest chroma"] = Figure(chroma[text], "chroma", "CIELAB")
        figures[f"{text}: range of lightness"] = Figure(L_range[text], "L*", "CIELAB")
    shifts = [f"hue-shift:{angle}" for angle in SHIFTS_DEG]
    volume = {text: mesh.volume for text, mesh in meshes.items()}
    relations = {
        "every sub-gamut lies inside the full gamut": min(inside.values()) > 0.999,
        "the greater the hue shift, the smaller the volume": sorted(shifts, key=volume.__getitem__) == shifts[::-1],
        "the greater the hue shift, the less chroma": sorted(shifts, key=chroma.__getitem__) == shifts[::-1],
        "a hue shift keeps 95 % of the lightness range": min(L_range[s] for s in shifts) > 0.95 * L_range["full"],
        "neutralisation keeps less than 60 % of it": L_range["neutralize:50,0,0"] < 0.6 * L_range["full"],
        "the full change is the smallest": volume["full-change"] == min(volume.values()),
    }
    halves = []
    for part, colors in PARTS.items():
        bodies = [SceneBody(meshes["full"], "full gamut on the print (virtual bench)", "#7f7f7f")]
        bodies += [SceneBody(meshes[text], text.replace(":", " "), color) for text, color in colors.items()]
        path = run.folder / f".{ITEM.name}-{part}.png"
        write_scene(path, bodies, size_px=(820, 640))
        halves.append(read_image(path))
        path.unlink()
    picture = f"{ITEM.name}.jpg"
    Image.fromarray(np.hstack(halves)[..., :3]).save(run.folder / picture, quality=88)
    shares = [f"{text} {volume[text] / volume['full']:.0%}" for text in texts[1:]]
    return Result(
        f"of the full gamut's volume, {volume['full']:.0f}: {', '.join(shares)}", figures, relations, (picture,)
    )


if __name__ == "__main__":
    sys.exit(run_item(ITEM, make))
