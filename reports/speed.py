"""The time of every stage beside a peer that does the same job, in one run: reports/reference/speed.json.

A peer is what one would reach for first: a library that has the job (OpenCV, SciPy, scikit-image, colour-science,
reportlab), or the same mathematics in plain NumPy. Ours and the peer take turns, on the same data, and the agreement of
their results stands beside the ratio, so that nobody is fast at something else. Wall seconds, best of several turns;
the peer uses as many cores as it knows how to. The solver against dlib, gamuts against other programs and the paper's
sampling, and whole 4K frames have benchmarks of their own (inversion_benchmark, gamut_benchmark, frame_plan).

Run from a checkout, on a machine that does nothing else (two minutes; ``--quick``: half a minute, smaller data)::

    python -m reports.speed [--quick] [--only WORD]
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_design.gamut import JointGamut, sampled_gamut, sub_gamut
from paxel_design.patterns import make_pattern
from paxel_design.printing import write_pattern_pdf
from paxel_runtime.assembly import refine
from paxel_runtime.clustering import cluster
from paxel_runtime.gamut_mapping import MappingOptions, map_to_subgamut
from paxel_runtime.inversion import invert
from paxel_runtime.model.colorimetry import D65_XYZ, Lab_to_XYZ, XYZ_to_Lab, sRGB_to_Lab
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.effects import parse_effect
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.observer import eye_blur
from paxel_runtime.pictures import resample
from paxel_runtime.registration import fit_registration, warp_to_nodal
from paxel_runtime.structured_light import LINE_PERIOD, decode, plan_frames
from reports.bench_models import bench_model

RESULT = Path(__file__).parent / "reference" / "speed.json"
Floats = NDArray[np.floating]


@dataclass(frozen=True)
class Race:
    """One job done twice: `agreement` says in words how near both results are."""

    stage: str
    ours: Callable[[], Any]
    peer_name: str
    peer: Callable[[], Any]
    agreement: Callable[[Any, Any], str]
    peer_share: float = 1.0
    """Share of our work that the peer does; its time is told for all of it."""


def run(race: Race, turns: int) -> dict[str, Any]:
    """Ours and the peer in turns; both results compared."""
    race.ours()  # compiles
    seconds: dict[str, list[float]] = {"ours": [], "peer": []}
    results: dict[str, Any] = {}
    for _ in range(turns):
        for name, job in (("ours", race.ours), ("peer", race.peer)):
            if name == "peer" and sum(seconds["peer"]) > 20:
                continue
            start = time.perf_counter()
            results[name] = job()
            seconds[name].append(time.perf_counter() - start)
    ours, peer = min(seconds["ours"]), min(seconds["peer"]) / race.peer_share
    return {
        "peer": race.peer_name,
        "ours_s": ours,
        "peer_s": peer,
        "ratio": peer / ours,
        "agreement": race.agreement(results["ours"], results["peer"]),
    }


def near(unit: str, quantile: float = 1.0) -> Callable[[Any, Any], str]:
    """Words on how far two arrays are apart."""

    def words(a: Any, b: Any) -> str:
        off = np.abs(np.asarray(a, np.float64) - np.asarray(b, np.float64))
        what = "at most" if quantile == 1 else f"{quantile:.0%} of values within"
        return f"{what} {np.nanquantile(off, quantile):.2g} {unit}"

    return words


def print_race(scale: float) -> Race:
    """The print as PDF, against one picture of all printer dots."""
    pattern = make_pattern("checkerboard", ("black", "white"), 0.75, 30.0, (300 * scale, 200 * scale))
    folder = Path(tempfile.mkdtemp())

    def peer() -> Path:
        from PIL import Image
        from reportlab.lib.utils import ImageReader
        from reportlab.pdfgen.canvas import Canvas

        w, h = (round(side / 25.4 * 1440) for side in pattern.size_mm)
        x = (np.arange(w) + 0.5) * 25.4 / 1440 - pattern.size_mm[0] / 2
        y = pattern.size_mm[1] / 2 - (np.arange(h) + 0.5) * 25.4 / 1440
        rows = [pattern.label(x, np.full_like(x, one)) for one in y]
        page = Canvas(str(folder / "peer.pdf"), pagesize=[side / 25.4 * 72 for side in pattern.size_mm])
        picture = Image.fromarray((255 * np.stack(rows)).astype(np.uint8)).convert("1")
        page.drawImage(ImageReader(picture), 0, 0, *(side / 25.4 * 72 for side in pattern.size_mm))
        page.save()
        return folder / "peer.pdf"

    def ours() -> Path:
        write_pattern_pdf(pattern, folder / "ours.pdf")
        return folder / "ours.pdf"

    def sizes(a: Path, b: Path) -> str:
        return f"file of {a.stat().st_size / 1e3:.0f} kB against {b.stat().st_size / 1e3:.0f} kB"

    return Race("print: pattern as PDF, 1440 dpi", ours, "reportlab, one picture of all dots", peer, sizes)


def captures_of(width: int, height: int, scale: float) -> dict[str, NDArray[np.uint16]]:
    """Structured light on a plain sheet, seen straight on with a little blur and noise."""
    from scipy.ndimage import gaussian_filter1d

    h, w = int(height * scale), int(width * scale)
    noise, pictures = np.random.default_rng(0), {}
    for frame in plan_frames(width, height):
        light = gaussian_filter1d(frame.profile.repeat(16).astype(np.float64), 6.0, mode="nearest")
        side = np.arange(w if frame.axis == "x" else h)
        level = np.interp((side + 0.5) / scale - 0.5, (np.arange(light.size) + 0.5) / 16 - 0.5, light)
        level = level[None, :] if frame.axis == "x" else level[:, None]
        picture = 300 + 30000 * level + noise.normal(0, 60, (h, w))
        pictures[frame.name] = picture.astype(np.uint16)
    return pictures


def light_races(scale: float) -> list[Race]:
    """Decoding, lookup table and nodal image."""
    import cv2
    from scipy.interpolate import griddata

    width, height = 4 * int(160 * scale**0.5), 4 * int(90 * scale**0.5)
    pictures = captures_of(width, height, 2.5)
    frames = {frame.name: frame for frame in plan_frames(width, height)}
    decoded = decode(pictures.__getitem__, width, height)

    def numpy_decode() -> Floats:
        """Bits by the sign of complementary pairs, phase of the lines by the first harmonic over time."""
        places = []
        for axis in ("x", "y"):
            bits = sorted(n for n in frames if n.startswith(f"gray-{axis}") and not n.endswith("inverse"))
            lines = [pictures[f"line-{axis}-{k}"].astype(np.float64) for k in range(LINE_PERIOD)]
            turn = np.exp(2j * np.pi * np.arange(LINE_PERIOD) / LINE_PERIOD)
            phase = np.angle(sum(t * line for t, line in zip(turn, lines, strict=True)))
            fine = phase / (2 * np.pi) * LINE_PERIOD
            code = np.stack([pictures[b] > pictures[f"{b}-inverse"] for b in bits])
            truth = np.stack([frames[b].profile > 0.5 for b in bits])
            start = {tuple(column): k for k, column in reversed(list(enumerate(truth.T)))}
            weights = 1 << np.arange(len(bits))
            known = np.full(1 << len(bits), -1)
            for column, k in start.items():
                known[int(np.dot(column, weights))] = k
            coarse = known[np.tensordot(weights, code, 1)] + 1.5
            places.append(coarse + np.mod(fine - coarse + LINE_PERIOD / 2, LINE_PERIOD) - LINE_PERIOD / 2)
        return np.stack(places, axis=-1)

    table = fit_registration(decoded, width, height)
    y, x = np.nonzero(decoded.reason == 0)

    def delaunay() -> Floats:
        """The paper's: every projector pixel between its decoded neighbours."""
        v, u = np.mgrid[0:height, 0:width]
        return griddata(decoded.projector_xy[y, x], np.stack([x, y], -1).astype(float), (u, v), method="linear")

    photograph = np.stack([pictures["white"]] * 3, -1).astype(np.float32)
    xy = table.camera_xy.astype(np.float32)

    def within(a: Any, b: Floats) -> str:
        good = a.reason == 0
        off = np.abs(a.projector_xy[good] - b[good])
        return f"median {np.nanmedian(off):.2g} projector px apart"

    return [
        Race(f"structured light: {len(pictures)} pictures decoded", lambda: decode(pictures.__getitem__, width, height),
             "plain NumPy, without noise model and rejection", numpy_decode, within),
        Race("registration: lookup table", lambda: fit_registration(decoded, width, height),
             "SciPy, Delaunay interpolation", delaunay,
             lambda a, b: near("camera px", 0.95)(a.camera_xy, b)),
        Race("nodal image", lambda: warp_to_nodal(photograph, xy), "OpenCV remap (1/32 pixel)",
             lambda: cv2.remap(photograph, xy[..., 0], xy[..., 1], cv2.INTER_LINEAR),
             near("codes of 65535", 0.99)),
    ]  # fmt: skip


def clustering_race(scale: float) -> Race:
    """Projector pixels sorted by colour, against k-means of all of them."""
    from scipy.cluster.vq import kmeans2

    h, w = int(540 * scale**0.5), int(960 * scale**0.5)
    pattern = Pattern("checkerboard", ("black", "white"), np.array([[0, 1], [1, 0]], np.uint8), 0.75, 30.0, (400, 300))
    sub = (np.arange(4) + 0.5) / 4
    light = np.zeros((h, w))
    for dy in sub:
        for dx in sub:
            u, v = (np.arange(w) + dx - w / 2) * 0.1465, (h / 2 - np.arange(h) - dy) * 0.1465
            light += pattern.label(*np.meshgrid(u, v)) / 16
    noise = 1 + 0.02 * np.random.default_rng(0).standard_normal((h, w, 1))
    XYZ = ((0.05 + 0.9 * light[..., None]) * D65_XYZ * noise).astype(np.float32)
    valid = np.ones((h, w), bool)
    inks = {"black": 0.05 * D65_XYZ, "white": 0.95 * D65_XYZ}
    start = XYZ_to_Lab(np.array([[0.05], [0.3], [0.95]]) * D65_XYZ, D65_XYZ)

    def share(a: Any, b: Any) -> str:
        """Share of pixels in the same group, groups matched by their lightness."""
        ours, theirs = np.asarray(a.labels).ravel(), b[1]
        means = [np.array([XYZ[..., 1].ravel()[groups == k].mean() for k in range(3)]) for groups in (ours, theirs)]
        order = [np.argsort(np.argsort(m)) for m in means]
        return f"{np.mean(order[0][ours] == order[1][theirs]):.2%} of the pixels in the same cluster"

    return Race(
        "clusters: K = 3 in CIELAB", lambda: cluster(XYZ, valid, inks, 3, D65_XYZ), "SciPy kmeans2 on all pixels",
        lambda: kmeans2(XYZ_to_Lab(XYZ, D65_XYZ).reshape(-1, 3), start, minit="matrix"), share,
    )  # fmt: skip


def colour_races(scale: float) -> list[Race]:
    """CIELAB and dE00 of many colours, against colour-science."""
    import colour
    from colour.models import XYZ_to_Lab as colour_XYZ_to_Lab

    rng = np.random.default_rng(0)
    XYZ = rng.random((int(400_000 * scale), 3))
    Lab = [np.array([50, 0, 0]) + np.array([25, 40, 40]) * rng.standard_normal((len(XYZ), 3)) for _ in range(2)]
    xy = colour.XYZ_to_xy(D65_XYZ)
    return [
        Race("CIELAB", lambda: XYZ_to_Lab(XYZ, D65_XYZ), "colour-science", lambda: colour_XYZ_to_Lab(XYZ, xy),
             near("CIELAB units")),
        Race("dE00", lambda: dE00(*Lab), "colour-science", lambda: colour.delta_E(*Lab, method="CIE 2000"),
             near("dE00")),
    ]  # fmt: skip


def gamut_races(scale: float) -> list[Race]:
    """Half-spaces of the joint gamut against Qhull; a sub-gamut against the paper's sampling."""
    from scipy.spatial import ConvexHull

    model, neutral = bench_model("K=2"), parse_effect("neutralize:50,0,0,2")
    nine = bench_model("K=3")
    rows = np.concatenate([nine.pattern.A, nine.white.A])  # type: ignore[union-attr]
    corners = (np.arange(512)[:, None] >> np.arange(9)) & 1
    joint, steps = JointGamut(model), 7 if scale < 1 else 11

    def half_spaces(model: PredictionModel) -> JointGamut:
        """With its rows, which are made when they are first asked for."""
        joint = JointGamut(model)
        joint.contains(model.pattern.black, model.pattern.black)
        return joint

    def volumes(a: Any, b: ConvexHull) -> str:
        drawn_in = nine_black + hull_middle + 0.999 * (hull_points - hull_middle)
        inside = a.contains(*np.split(drawn_in, 2, axis=1))
        return f"{np.mean(inside):.1%} of the hull's vertices, drawn in by 0.1 %, inside ours"

    def held_of_sampled(a: Any, b: Any) -> str:
        x = np.random.default_rng(0).random((20_000, model.n))
        XYZ = x @ model.pattern.A.T + model.pattern.black
        ours, sampled = a.contains(XYZ), b.contains(XYZ)
        return (
            f"of {ours.sum()} random colours that ours holds sampling found {np.sum(ours & sampled)}, and "
            f"{np.sum(sampled & ~ours)} that ours does not hold"
        )

    hull_points = corners @ rows.T
    hull_middle = hull_points.mean(axis=0)
    nine_black = np.concatenate([nine.pattern.black, nine.white.black])  # type: ignore[union-attr]
    return [
        Race("joint gamut: half-spaces, n = 9", lambda: half_spaces(nine), "Qhull on 2^n vertices (SciPy)",
             lambda: ConvexHull(hull_points), volumes),
        Race("sub-gamut: neutralisation within dE00 2, n = 6", lambda: sub_gamut(joint, neutral),
             f"the paper's sampling, {steps}^6 inputs", lambda: sampled_gamut(joint, neutral, steps=steps),
             held_of_sampled),
    ]  # fmt: skip


def picture_races(scale: float) -> list[Race]:
    """From a photograph to intensities: reading size, mapping, inversion, assembly, the eye."""
    import cv2
    from scipy.ndimage import gaussian_filter
    from scipy.optimize import minimize
    from skimage import data

    h, w = int(1080 * scale**0.5) // 2 * 2, int(1920 * scale**0.5) // 2 * 2
    photograph = data.astronaut()
    linear = (photograph / 255.0).astype(np.float32) ** 2.2
    Lab = sRGB_to_Lab(cv2.resize(photograph, (w, h)) / 255.0).astype(np.float32)
    model = bench_model("K=2")
    gamut = sub_gamut(JointGamut(model), "full")

    def mapped_by_numpy() -> Floats:
        """Chroma halved towards the gray of the same lightness, 10 times, against all half-spaces; no knee."""
        mapped = np.array(Lab)
        start = map_to_subgamut(Lab, gamut, clip).Lab[..., :1]
        low, high = np.zeros((h, w, 1)), np.ones((h, w, 1))
        for _ in range(10):
            middle = (low + high) / 2
            mapped = np.concatenate([start, middle * Lab[..., 1:]], axis=-1)
            inside = (gamut.slack(Lab_to_XYZ(mapped, model.white_point)) >= 0)[..., None]
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        return np.concatenate([start, low * Lab[..., 1:]], axis=-1)

    clip = MappingOptions(chroma="clip")
    rng = np.random.default_rng(0)
    pattern, white = np.array([30, 0, 0.0]), np.array([65, 0, 0.0])
    targets = [L + np.array([9, 14, 14]) * rng.standard_normal((20_000, 3)) for L in (pattern, white)]
    few = 20

    def lbfgs() -> Floats:
        """SciPy's L-BFGS-B on Eq. 5 from the middle of the box, differences for derivatives."""
        found = []
        for k in range(few):

            def cost(x: Floats, k: int = k) -> float:
                on_pattern, on_white = model.predict(x)
                return float(dE00(on_pattern, targets[0][k]) ** 2 + dE00(on_white, targets[1][k]) ** 2)

            found.append(minimize(cost, np.full(6, 0.5), method="L-BFGS-B", bounds=[(0, 1)] * 6).fun)
        return np.array(found)

    def costs(a: Any, b: Floats) -> str:
        ours = (a.dE_pattern**2 + a.dE_white**2)[:few]
        return (
            f"dE00^2 of ours is higher by at most {max(0.0, float(np.max(ours - b))):.2g}, "
            f"lower by up to {np.max(b - ours):.2g}"
        )

    x = np.ascontiguousarray(rng.random((h // 20, w // 20, 6)).repeat(20, 0).repeat(20, 1)[:h, :w], np.float32)
    x = np.pad(x, ((0, h - x.shape[0]), (0, w - x.shape[1]), (0, 0)), mode="edge")
    v, u = np.mgrid[0:h, 0:w]
    labels = ((u // 5 + v // 5) % 2).astype(np.uint8)
    share = (255 * np.stack([labels == 0, labels == 1], -1)[:, :, None, :]).astype(np.uint8)
    XYZ = rng.random((h, w, 3)).astype(np.float32)
    both = np.concatenate([model.pattern.A, model.white.A])  # type: ignore[union-attr]

    def seen(p: Floats) -> Floats:
        """Light of both surfaces through the eye."""
        own = 2 * np.stack([both[:, :3], both[:, 3:]])[labels]
        return gaussian_filter(np.einsum("hwij,hwj->hwi", own, p), (4.0, 4.0, 0))[30:-30, 30:-30]

    def refined_by_scipy() -> Floats:
        """Four rounds of the same correction with SciPy's Gaussian at full resolution."""
        A = np.stack(
            [np.concatenate([s.A[:, 3 * i : 3 * i + 3] for s in (model.pattern, model.white)]) for i in (0, 1)]
        )
        own = 2 * A[labels]  # light of a pixel of a cluster, as if all were of it
        B = np.linalg.pinv(np.einsum("hwij,hwkj->ik", own, own) / (h * w))
        wanted = x @ both.T
        p = np.where(labels[..., None] == 0, x[..., :3], x[..., 3:])
        for step in (3.06, 1.94, 1.28, 1.03):
            light = np.einsum("hwij,hwj->hwi", own, p)
            error = gaussian_filter(wanted - light, (4.0, 4.0, 0))
            p = np.clip(p + step * np.einsum("hwji,jk,hwk->hwi", own, B, error), 0, 1)
        return p

    return [
        Race("picture: photograph resampled", lambda: resample(linear, w, h), "OpenCV, cubic",
             lambda: cv2.resize(linear, (w, h), interpolation=cv2.INTER_CUBIC), near("of full light", 0.99)),
        Race("mapping: clipped to the full gamut", lambda: map_to_subgamut(Lab, gamut, clip),
             "NumPy, 10 halvings of chroma", mapped_by_numpy,
             lambda a, b: near("CIELAB units", 0.99)(a.Lab, b)),
        Race("inversion: K = 2, 20 000 pairs", lambda: invert(targets[0], targets[1], model),
             "SciPy L-BFGS-B from the middle", lbfgs, costs, few / 20_000),
        Race("assembly: refine, 4 rounds", lambda: refine(x, labels, model, share, 4.0), "NumPy and SciPy",
             refined_by_scipy, lambda a, b: "through the eye " + near("of full light", 0.99)(seen(a), seen(b))),
        Race("observer: the eye's blur", lambda: eye_blur(XYZ, 4.0), "SciPy gaussian_filter",
             lambda: gaussian_filter(XYZ, (4.0, 4.0, 0), truncate=4.0), near("of full light", 0.99)),
    ]  # fmt: skip


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--quick", action="store_true", help="smaller data, nothing written")
    options.add_argument("--only", default="", help="the stages that hold this word")
    chosen = options.parse_args()
    scale, turns = (0.1, 2) if chosen.quick else (1.0, 3)
    races = [print_race(scale), *light_races(scale), clustering_race(scale), *colour_races(scale), *gamut_races(scale)]
    races += picture_races(scale)
    result: dict[str, Any] = {"cpus": os.cpu_count(), "load": round(os.getloadavg()[0], 1), "stages": {}}
    for race in races:
        if chosen.only not in race.stage:
            continue
        figures = run(race, turns)
        result["stages"][race.stage] = figures
        print(f"{race.stage:52s} {figures['ours_s'] * 1e3:9.1f} ms   {figures['ratio']:9.3g} times as fast as "
              f"{figures['peer']}; {figures['agreement']}", flush=True)  # fmt: skip
    if not chosen.quick and not chosen.only:
        RESULT.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
