"""The stage behind `paxel project`: source pictures and a sub-gamut -> a projection image; writes ``projection/``."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from paxel_runtime.assembly import METHODS, AssemblyOptions
from paxel_runtime.captures.exposures import guide_channel
from paxel_runtime.errors import InputError
from paxel_runtime.frame_files import write_frame
from paxel_runtime.gamut_mapping import AdaptiveOptions, MappingOptions, moved_picture
from paxel_runtime.installation import Installation
from paxel_runtime.model.effects import Effect
from paxel_runtime.model.subgamut import PairGamut, SubGamut, subgamut_from_arrays
from paxel_runtime.model_image import load_image_model
from paxel_runtime.observer import Viewer, eye_sigma_mm
from paxel_runtime.pictures import Frame, place_picture, read_picture, wall_homography
from paxel_runtime.projection import Projection, make_projection, picture_surfaces
from paxel_runtime.registration.print_start import homography_from_corners
from paxel_runtime.settings import Settings
from paxel_runtime.storage import load_model, read_image, read_npz, write_image, write_json, write_npz
from paxel_runtime.test_frame import one_to_one_frame

__all__ = [
    "TEST_FRAME",
    "assembly_options",
    "load_pair_gamut",
    "load_sub_gamut",
    "mapping_options",
    "picture_frame",
    "project",
    "projection_inputs",
    "write_projection",
]

TEST_FRAME = "test-frame.png"
"""Shows whether the projector shows frames pixel for pixel; see `one_to_one_frame`."""

Progress = Callable[[str, int, int], None]

MAPPINGS = ("adaptive", "static")
"""How two pictures are mapped: together, spending the room on their contrast where that gains, or each for itself."""


def load_sub_gamut(folder: Path, effect: Effect, surface: str) -> SubGamut:
    """A sub-gamut that the design side wrote into ``gamut/``."""
    return subgamut_from_arrays(read_npz(folder / f"{effect.name}.on-{surface}.npz"))


def load_pair_gamut(folder: Path) -> PairGamut | None:
    """The joint gamut that the design side wrote into ``gamut/``; None for a model of one surface."""
    arrays = read_npz(folder / "joint.npz")
    if arrays["normals"].shape[1] != 6:
        return None
    return PairGamut(arrays["normals"], arrays["offsets"], arrays["white_point"])


def projection_inputs(installation: Installation, pictures: Mapping[str, Path]) -> dict[str, Any]:
    """What a projection of these source pictures is made from.

    Raises
    ------
    InputError
        If a picture is not there.
    """
    for name, path in pictures.items():
        if not path.is_file():
            raise InputError(f"--{name.replace('_', '-')}: there is no picture {path}")
    return installation.inputs("projection", extra_files={f"picture {name}": p for name, p in pictures.items()})


def project(
    installation: Installation,
    effect: Effect,
    pictures: Mapping[str, Path],
    *,
    name: str = "",
    shown_on: str = "pattern",
    mapping: str = "",
    assembly: str = "",
    progress: Progress = lambda message, done, total: None,
) -> dict[str, Any]:
    """Make one projection image; writes ``projection/<name>.png`` and its record, and returns the record.

    Parameters
    ----------
    mapping : str
        ``"adaptive"`` or ``"static"``; as ``[mapping] method`` says if empty.
    assembly : str
        A key of `METHODS`; as ``[assembly] method`` says if empty.
    """
    if mapping and mapping not in MAPPINGS:
        raise InputError(f"--mapping must be one of {', '.join(MAPPINGS)}; got {mapping!r}")
    if assembly and assembly not in METHODS:
        raise InputError(f"--assembly must be one of {', '.join(METHODS)}; got {assembly!r}")
    name = name or effect.key
    if Path(name).name != name or name.startswith("."):
        raise InputError(f"--name must be a plain file name without folders, got {name!r}; write for example evening-2")
    settings, calibration, gamut = (
        installation.settings,
        installation.folder("calibration"),
        installation.folder("gamut"),
    )
    inputs = projection_inputs(installation, {key: pictures[key] for key in effect.pictures})
    progress("read pictures", 0, 1)
    frame = picture_frame(installation)
    sources = {key: read_picture(pictures[key], (frame.width, frame.height)) for key in effect.pictures}
    placed = {key: place_picture(source, frame) for key, source in sources.items()}
    spaces = {key: source.description for key, source in sources.items()}
    del sources
    surfaces = picture_surfaces(effect, shown_on)
    image_based = settings.model.kind == "image"
    projection = make_projection(
        effect,
        placed,
        {surface: load_sub_gamut(gamut, effect, surface) for surface in surfaces.values() if effect.in_sub_gamut},
        load_model(calibration / "model.json"),
        read_image(calibration / "clusters.png"),
        pairs=load_pair_gamut(gamut),
        shown_on=shown_on,
        bits=settings.projector.bits,
        local=load_image_model(calibration / "model.json") if image_based else None,
        mapping=mapping_options(settings),
        adaptive=_adaptive_options(installation, mapping or settings.mapping.method),
        assembly=assembly_options(installation, assembly or settings.assembly.method),
        progress=lambda done, total: progress("solve", done, total),
    )
    record = {
        "name": name,
        "effect": effect.text,
        "shown_on": shown_on,
        "asked": {"mapping": mapping, "assembly": assembly},
        "pictures": {key: str(pictures[key]) for key in effect.pictures},
        "colours": spaces,
        **projection.figures,
        "inputs": inputs,
    }
    with installation.writing("projection", keep=True) as folder:
        write_projection(folder, name, projection, settings.projector.bits, record)
        for key, surface in surfaces.items():
            write_image(folder / f"{name}.moved-{surface}.png", moved_picture(placed[key], projection.Lab[surface]))
        channels = len(settings.projector.channels)
        test_frame = one_to_one_frame(frame.width, frame.height, channels, settings.projector.bits)
        write_frame(folder / TEST_FRAME, test_frame, settings.projector.bits)
    return record


def write_projection(folder: Path, name: str, projection: Projection, bits: int, record: Mapping[str, Any]) -> None:
    """Write the projection image, its targets and its record."""
    write_frame(folder / f"{name}.png", projection.codes, bits)
    write_npz(folder / f"{name}.npz", **{f"Lab_{surface}": Lab for surface, Lab in projection.Lab.items()})
    write_json(folder / f"{name}.json", record)


def picture_frame(installation: Installation) -> Frame:
    """Where source pictures go: the projector's raster, and its place on the wall if they are to be straight there.

    Raises
    ------
    InputError
        If there are too few registered pixels to tell.
    """
    settings = installation.settings
    to_wall = None
    if settings.mapping.geometry == "wall":
        tables = read_npz(installation.folder("calibration") / "registration.npz")
        corners_px = settings.clusters.corners_px
        to_mm = homography_from_corners(corners_px, settings.pattern.size_mm) if corners_px else None
        to_wall = wall_homography(
            tables[f"camera_xy_{guide_channel(settings.projector.channels)}"], tables["valid"], to_mm
        )
    return Frame(*settings.projector.resolution, settings.mapping.placement, settings.mapping.align, to_wall)


def mapping_options(settings: Settings) -> MappingOptions:
    """Gamut mapping as the settings say."""
    wanted = settings.mapping
    return MappingOptions(wanted.chroma, wanted.lightness, wanted.black_percent, wanted.white_percent)


def _adaptive_options(installation: Installation, method: str) -> AdaptiveOptions | None:
    """How two pictures are mapped together; None where each is mapped for itself."""
    projector, distance_mm = installation.settings.projector, installation.settings.viewing.distance_mm
    viewer = Viewer(distance_mm, projector.width_mm / projector.resolution[0])
    return AdaptiveOptions(viewer.px_per_degree) if method == "adaptive" else None


def assembly_options(installation: Installation, method: str) -> AssemblyOptions:
    """How to assemble: from the settings, and from what calibration found out about every pixel."""
    settings = installation.settings
    px_per_mm = settings.projector.resolution[0] / settings.projector.width_mm
    file = installation.folder("calibration") / "coverages.npz"
    at_one_spot = settings.meter.positions == 1 and settings.model.kind == "spectral"
    pixels = read_npz(file) if method == "refine" and file.is_file() else {}
    return AssemblyOptions(
        method=method,
        outside=settings.assembly.outside,
        dot_px=settings.pattern.dot_size_mm * px_per_mm,
        eye_px=eye_sigma_mm(settings.viewing.distance_mm) * px_per_mm,
        coverage=pixels.get("coverage"),
        point_spread=None if settings.model.kind == "image" else pixels.get("point_spread"),
        spot_px=settings.meter.aperture_mm * px_per_mm if at_one_spot else math.inf,
    )
