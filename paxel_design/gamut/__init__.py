"""The gamut side: which pairs of colours a model can show, which colours an effect can use, and their meshes."""

from paxel_design.gamut.joint import JointGamut
from paxel_design.gamut.lightness import LightnessArea, lightness_area, lightness_figures
from paxel_design.gamut.mesh_files import MESH_FORMATS, write_mesh
from paxel_design.gamut.meshes import GamutMesh, gamut_mesh, subgamut_arrays, subgamut_figures
from paxel_design.gamut.subgamuts import product_pair, sub_gamut

__all__ = [
    "MESH_FORMATS",
    "GamutMesh",
    "JointGamut",
    "LightnessArea",
    "gamut_mesh",
    "lightness_area",
    "lightness_figures",
    "product_pair",
    "sub_gamut",
    "subgamut_arrays",
    "subgamut_figures",
    "write_mesh",
]
