"""The gamut side: which pairs of colours a model can show, which colours an effect can use, and their meshes.

Pictures stand in `scenes` (pyvista) and `figures` (matplotlib), which are not loaded here.
"""

from paxel_design.gamut.comparison import RGB_SPACES, coverage, intersection, mesh_of_arrays, rgb_space
from paxel_design.gamut.hue_area import HueArea, hue_change_area, hue_figures
from paxel_design.gamut.joint import JointGamut
from paxel_design.gamut.lightness import LightnessArea, lightness_area, lightness_figures, lightness_rectangle
from paxel_design.gamut.mesh_files import MESH_FORMATS, write_mesh
from paxel_design.gamut.meshes import GamutMesh, gamut_mesh, subgamut_arrays, subgamut_figures
from paxel_design.gamut.products import product_pair
from paxel_design.gamut.sampling import sampled_figures, sampled_gamut
from paxel_design.gamut.subgamuts import sub_gamut, subgamut_and_mesh

__all__ = [
    "MESH_FORMATS",
    "RGB_SPACES",
    "GamutMesh",
    "HueArea",
    "JointGamut",
    "LightnessArea",
    "coverage",
    "gamut_mesh",
    "hue_change_area",
    "hue_figures",
    "intersection",
    "lightness_area",
    "lightness_figures",
    "lightness_rectangle",
    "mesh_of_arrays",
    "product_pair",
    "rgb_space",
    "sampled_figures",
    "sampled_gamut",
    "sub_gamut",
    "subgamut_and_mesh",
    "subgamut_arrays",
    "subgamut_figures",
    "write_mesh",
]
