"""Gamuts against slow judges: HiGHS for exact sets, `invert` for product pairs, a proven search for hue sets.

    python reports/gamut_oracles.py [--probes 10000] [--pairs 20000] [--hues 1000] [--steps 8 4 2]

- Exact sets, n = 6, 9, 18: corners have an input that is found and checked, points 0.5 CIELAB units beyond have none.
- Product pairs: random pairs are inverted, 500 of them also asked of HiGHS.
- Hue sets: places on the boundary, as the margin and as the field on its grid have it; a tenth of a unit inside a
  partner is found on the surface of the section, and inverted; a tenth outside it is proven that there is none. Inside
  and outside are along the margin's slope; where that is wrong, twice as far is asked, and so on.
- Node counts: volumes at several steps beside each other and beside the refined mesh.

Writes ``reference/gamut_oracles.json``.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from gamut_benchmark import model_of
from numpy.typing import NDArray
from scipy.optimize import linprog

from paxel_design.gamut import JointGamut, product_pair, sub_gamut, subgamut_and_mesh
from paxel_design.gamut.margins import hue_margins
from paxel_design.gamut.polytopes import hull_surface, polytope
from paxel_runtime.errors import GamutError
from paxel_runtime.gamut_mapping import luminance_relation
from paxel_runtime.inversion import invert
from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.effects import CHROMA_FLOOR, HueShift
from paxel_runtime.model.prediction import PredictionModel

Array = NDArray[np.float64]
SURFACES = ("pattern", "white")
MODELS = {6: (2, False), 9: (3, False), 18: (6, True)}
ANGLES = (20, 45, 90, 135, 170)
COUNTED = (45, 135)
DISTANCES = (0.1, 0.2, 0.4, 0.8, 1.6)
BESIDE_CORNERS = 32
"""Corners of a section that are asked, at most."""


def input_of(model: PredictionModel, shown_on: str, XYZ: Array, partner: Array, along: Array) -> tuple[float, Array]:
    """Least distance e of a pair to (XYZ, partner + t along), some t, in each number, and its input: HiGHS."""
    own, other = (model.surfaces[s] for s in (shown_on, SURFACES[1 - SURFACES.index(shown_on)]))
    A = np.block([[own.A, np.zeros((3, 1))], [other.A, -along[:, None]]])
    wanted = np.concatenate((XYZ - own.black, partner - other.black))
    one = np.ones((6, 1))
    result = linprog(
        np.append(np.zeros(model.n + 1), 1.0),
        A_ub=np.block([[A, -one], [-A, -one]]),
        b_ub=np.append(wanted, -wanted),
        bounds=[(0, 1)] * model.n + [(-10, 10), (0, None)],
        method="highs",
    )
    return float(result.fun), result.x[: model.n]


def sections(joint: JointGamut, rng: np.random.Generator) -> Any:
    """Endless (surface, half-spaces, and the partner of a colour as two vectors), in turn of several effects."""
    model = joint.model
    assert model.white is not None
    made = {
        (effect, surface): sub_gamut(joint, effect, surface)
        for effect in ("decolorize:free", "decolorize:relative")
        for surface in SURFACES
    }
    while True:
        for (effect, surface), gamut in made.items():
            if effect == "decolorize:free":
                yield effect, surface, gamut.normals, gamut.offsets, lambda XYZ: (np.zeros(3), model.white_point)
            else:
                slope, base = luminance_relation(
                    model.surfaces[surface], model.surfaces[SURFACES[1 - SURFACES.index(surface)]]
                )
                yield effect, surface, gamut.normals, gamut.offsets, (
                    lambda XYZ, slope=slope, base=base: ((slope * XYZ[1] + base) * model.white_point, np.zeros(3))
                )  # fmt: skip
        for surface in SURFACES * 4:
            hidden = model.surfaces[SURFACES[1 - SURFACES.index(surface)]].predict_XYZ(rng.beta(0.7, 0.7, model.n))
            try:
                section = joint.section(hidden, surface)
            except GamutError:  # flat: n = 6 at a corner of the other surface
                continue
            yield "section", surface, section.normals, section.offsets, lambda XYZ, c=hidden: (c, np.zeros(3))


def exact_sets(joint: JointGamut, count: int) -> dict[str, Any]:
    """Corners of sections and points 0.5 CIELAB units beyond them, asked of HiGHS."""
    model, rng = joint.model, np.random.default_rng(1)
    told = {"probes": 0, "corners": 0, "beyond": 0, "disagreements": 0, "worst_reached": 0.0, "nearest_refused": 1.0}
    kinds: dict[str, int] = {}
    for effect, surface, normals, offsets, partner in sections(joint, rng):
        corners = polytope(normals, offsets).vertices
        middle = XYZ_to_Lab(corners.mean(axis=0), model.white_point)
        corners = corners[rng.permutation(len(corners))[:BESIDE_CORNERS]]
        out = XYZ_to_Lab(corners, model.white_point) - middle
        out /= np.linalg.norm(out, axis=1)[:, None]
        beyond = np.asarray(Lab_to_XYZ(XYZ_to_Lab(corners, model.white_point) + 0.5 * out, model.white_point))
        slack = np.min(offsets - beyond @ normals.T, axis=1)
        # Outwards in CIELAB is not outwards in XYZ at every corner; 1e-6 is as sure as HiGHS is.
        for XYZ, reachable in [(c, True) for c in corners] + [(b, False) for b in beyond[slack < -1e-6]]:
            distance, x = input_of(model, surface, XYZ, *partner(XYZ))
            if reachable:
                # The input itself is checked: within the box, and the colour it gives.
                given = model.surfaces[surface].predict_XYZ(np.clip(x, 0, 1))
                distance = max(distance, float(np.abs(given - XYZ).max()))
                told["worst_reached"] = max(told["worst_reached"], distance)
            else:
                told["nearest_refused"] = min(told["nearest_refused"], distance)
            told["corners" if reachable else "beyond"] += 1
            told["disagreements"] += int((distance < 1e-6) != reachable)
            told["probes"] += 1
            kinds[effect] = kinds.get(effect, 0) + 1
            if told["probes"] >= count:
                return {**told, "of": kinds}
    raise AssertionError("sections are endless")


def product_pairs(joint: JointGamut, count: int) -> dict[str, Any]:
    """Random pairs of a product pair: what `invert` leaves, and 500 of them by HiGHS."""
    rng, XYZ = np.random.default_rng(2), []
    for side in product_pair(joint):
        corners = polytope(side.normals, side.offsets).vertices
        XYZ.append(rng.dirichlet(np.full(len(corners), 0.1), count) @ corners)
    Lab = [XYZ_to_Lab(side, joint.model.white_point) for side in XYZ]
    result = invert(Lab[0], Lab[1], joint.model)
    worst = np.maximum(result.dE_pattern, result.dE_white)
    asked = [input_of(joint.model, "pattern", p, w, np.zeros(3))[0] for p, w in zip(XYZ[0][:500], XYZ[1], strict=False)]
    return {
        "pairs": count, "worst_dE": float(worst.max()), "share_below_1e-3": float(np.mean(worst < 1e-3)),
        "asked_of_HiGHS": len(asked), "worst_distance": max(asked),
    }  # fmt: skip


def partner_of(joint: JointGamut, XYZ: Array, angle_deg: float) -> Array | None:
    """A colour on the white surface that goes with `XYZ` and whose hue is the angle away; None: proven to be none.

    Colours of such hue and chroma reach to infinity, so if one is in the section one is on its surface. Triangles of
    it are halved where the largest value at a corner and their size leave hope.
    """
    white_point = joint.model.white_point
    try:
        places, faces = hull_surface(joint.section(XYZ, "white").vertices)
    except GamutError:  # flat or empty: on the surface of the full gamut
        return None
    _, a, b = XYZ_to_Lab(XYZ, white_point)
    angle, hue = np.deg2rad(angle_deg), np.arctan2(b, a)

    def value(ab: Array) -> Array:
        """>= 0 where hue and chroma are as wanted; no two colours differ by more than they are apart."""
        first, last = hue + angle, hue - angle
        left, right = (
            -np.sin(first) * ab[..., 0] + np.cos(first) * ab[..., 1],
            np.sin(last) * ab[..., 0] - np.cos(last) * ab[..., 1],
        )
        hues = np.maximum(left, right) if angle_deg <= 90 else np.minimum(left, right)
        return np.minimum(hues, np.hypot(ab[..., 0], ab[..., 1]) - CHROMA_FLOOR)

    triangles = places[faces]
    while len(triangles):
        ab = XYZ_to_Lab(triangles, white_point)[..., 1:]
        values = value(ab)
        if values.max() >= 0:
            return np.asarray(triangles.reshape(-1, 3)[np.argmax(values)])
        size = np.max(np.linalg.norm(ab - np.roll(ab, 1, axis=1), axis=-1), axis=1)
        # A point of a triangle is within 0.58 of its longest edge from a corner; lines bend by less than a tenth.
        hope = (values.max(axis=1) + 0.65 * size > 0) & (size > 1e-3)
        p, q, r = np.moveaxis(triangles[hope], 1, 0)
        pq, qr, rp = (p + q) / 2, (q + r) / 2, (r + p) / 2
        triangles = np.concatenate([np.stack(t, axis=1) for t in ((p, pq, rp), (pq, q, qr), (rp, qr, r), (pq, qr, rp))])
    return None


def hue_sets(joint: JointGamut, count: int) -> dict[str, Any]:
    """Places on hue sets' boundaries: where the search finds otherwise a tenth of a unit beside them, and how far."""
    model, rng = joint.model, np.random.default_rng(3)
    full = sub_gamut(joint, "full")
    XYZ = model.pattern.predict_XYZ(rng.beta(0.5, 0.5, (4000, model.n)))
    # Straight through the gamut, and not on its surface, where rounding leaves no section.
    XYZ = XYZ.mean(axis=0) + 0.999 * (XYZ - XYZ.mean(axis=0))
    told: dict[str, Any] = {}
    all_margins = []
    for angle in ANGLES:
        margins = hue_margins(model, HueShift(angle), "pattern")
        all_margins.append(margins(XYZ))
        field = sub_gamut(joint, HueShift(angle)).field
        assert field is not None
        at = field.at
        by: dict[str, Callable[[Array], Array]] = {
            "margin": margins,
            "field": lambda places, at=at: at(XYZ_to_Lab(places, model.white_point)),
        }
        for name, judge in by.items():
            value = judge(XYZ)
            some = count // len(ANGLES)
            inside, outside = (rng.choice(np.flatnonzero(side), some) for side in (value > 0, value < 0))
            low, high = XYZ[inside], XYZ[outside]
            for _ in range(40):
                middle = (low + high) / 2
                within = (judge(middle) >= 0)[:, None]
                low, high = np.where(within, middle, low), np.where(within, high, middle)
            place = XYZ_to_Lab(low, model.white_point)
            slopes = margins.with_slopes(low)[1]
            outwards = -slopes / np.maximum(np.linalg.norm(slopes, axis=1), 1e-9)[:, None]
            told[f"{angle}, {name}"] = boundary(joint, angle, place, outwards, full)
            print(angle, name, told[f"{angle}, {name}"], flush=True)
    # A colour that can turn by more can turn by less: 1e-3, where straightening ends.
    broken = [int(np.sum((b > 0) & (a < -1e-3))) for a, b in pairwise(all_margins)]
    return {"boundary": told, "colours": len(XYZ), "not_monotone_in_angle": sum(broken)}


def boundary(joint: JointGamut, angle: float, place: Array, outwards: Array, full: Any) -> dict[str, Any]:
    """Places (k, 3), CIELAB, judged at a tenth of a unit inside and outside, and further where that is wrong."""
    off, pairs = np.zeros(len(place)), []
    for i, (Lab, out) in enumerate(zip(place, outwards, strict=True)):
        for step, wanted in ((-1, True), (1, False)):
            for distance in DISTANCES:
                XYZ = np.asarray(Lab_to_XYZ(Lab + step * distance * out, joint.model.white_point))
                if not full.contains(XYZ):
                    break
                partner = partner_of(joint, XYZ, angle)
                if (partner is not None) == wanted:
                    if partner is not None:
                        pairs.append((XYZ, partner))
                    break
                off[i] = max(off[i], distance)
    found = np.array(pairs).reshape(-1, 2, 3)
    Lab = XYZ_to_Lab(found, joint.model.white_point)
    result = invert(Lab[:, 0], Lab[:, 1], joint.model)
    dE = np.maximum(result.dE_pattern, result.dE_white)
    return {
        "places": len(place), "off_by_more_than": {str(d): int(np.sum(off >= d)) for d in DISTANCES},
        "inverted": len(pairs), "worst_dE": float(np.max(dE, initial=0)),
    }  # fmt: skip


def node_counts(joint: JointGamut, steps: list[float]) -> dict[str, Any]:
    """Volumes of hue sets by node count at several steps over that at the finest, and over the mesh."""
    told = {}
    for angle in COUNTED:
        counts, meshes = [], []
        for step in steps:
            _, mesh = subgamut_and_mesh(joint, HueShift(angle), step=step)
            counts.append(mesh.volume)
            meshes.append(mesh.mesh_volume)
        told[str(angle)] = {
            "steps": steps, "nodes": counts, "mesh": meshes,
            "percent_off_finest": [100 * (c / counts[-1] - 1) for c in counts],
            "percent_mesh_off_nodes": [100 * (m / c - 1) for m, c in zip(meshes, counts, strict=True)],
        }  # fmt: skip
        print(angle, told[str(angle)], flush=True)
    return told


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--probes", type=int, default=10_000, help="of exact sets, in all; 0 leaves them out")
    parser.add_argument("--pairs", type=int, default=20_000, help="of product pairs, each n; 0 leaves them out")
    parser.add_argument("--hues", type=int, default=1_000, help="places on hue sets' boundaries; 0 leaves them out")
    parser.add_argument("--steps", type=float, nargs="*", default=[4.0, 2.0, 1.0], help="of node counts")
    asked = parser.parse_args()
    path = Path(__file__).parent / "reference" / "gamut_oracles.json"
    figures: dict[str, Any] = json.loads(path.read_text()) if path.is_file() else {}
    joints = {n: JointGamut(model_of(*size)) for n, size in MODELS.items()}
    for n, joint in joints.items():
        judged = {exact_sets: -(-asked.probes // 3), product_pairs: asked.pairs}
        for run, count in judged.items():
            name = run.__name__.replace("_", " ")
            if count:
                figures.setdefault(f"n = {n}", {})[name] = run(joint, count)
                print(n, name, figures[f"n = {n}"][name], flush=True)
    if asked.hues:
        figures["hue sets, n = 6"] = hue_sets(joints[6], asked.hues)
    if asked.steps:
        figures["node counts, n = 6"] = node_counts(joints[6], asked.steps)
    path.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
