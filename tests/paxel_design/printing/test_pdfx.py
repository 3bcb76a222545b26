"""Our own assertions of PDF/X-4 (ISO 15930-7) and of the colour spaces, on finished sheets."""

import shutil
import struct
import subprocess
import xml.etree.ElementTree as ET
from dataclasses import replace
from importlib.resources import files

import pikepdf
import pytest
from pikepdf import Name

from paxel_design.patterns import make_pattern
from paxel_design.printing import write_pattern_pdf
from paxel_runtime.model.pattern import colorant_library

SPOT = "UV grün 365"


@pytest.fixture(scope="module", params=["process", "spot", "tiled"])
def sheet(request, tmp_path_factory):
    """A sheet of process inks, one with a spot ink, and one on several pages."""
    library = dict(colorant_library())
    library["glow"] = replace(library["white"], name="glow", cmyk=(0.5, 0.0, 0.7, 0.0), spot=SPOT)
    names = ("black", "white", "glow")[: 3 if request.param == "spot" else 2]
    pattern = make_pattern("tiles", names, 0.75, 30, (60, 40), library=library)
    path = tmp_path_factory.mktemp("sheet") / "pattern.pdf"
    page = (150.0, 150.0) if request.param == "tiled" else "auto"
    write_pattern_pdf(pattern, path, caption="Hall 3 <left> & right", page=page)
    with pikepdf.open(path) as pdf:
        yield path, pdf


def information(pdf):
    return {str(key): str(value) for key, value in pdf.trailer.Info.items()}


def metadata(pdf):
    """The XMP packet's properties by local name."""
    root = ET.fromstring(pdf.Root.Metadata.read_bytes())
    return {element.tag.split("}")[1]: "".join(element.itertext()).strip() for element in root.iter()}


def test_the_file_is_sound(sheet):
    path, pdf = sheet
    assert pdf.check_pdf_syntax() == []
    if shutil.which("qpdf"):
        assert subprocess.run(["qpdf", "--check", str(path)], capture_output=True, check=True).stderr == b""


def test_version_and_header(sheet):
    path, pdf = sheet
    assert pdf.pdf_version == "1.6"
    assert path.read_bytes()[9:15].startswith(b"%")  # a line of bytes above 127 tells transfer programs: binary
    assert not pdf.is_encrypted


def test_identification_stands_in_the_metadata(sheet):
    _, pdf = sheet
    assert pdf.Root.Metadata.Type == Name.Metadata
    assert pdf.Root.Metadata.Subtype == Name.XML
    assert "/Filter" not in pdf.Root.Metadata  # to be found without unpacking
    found = metadata(pdf)
    assert found["GTS_PDFXVersion"] == "PDF/X-4"
    assert found["DocumentID"].startswith("uuid:")
    assert found["VersionID"]
    assert found["RenditionClass"]
    assert information(pdf)["/GTS_PDFXVersion"] == "PDF/X-4"


def test_information_and_metadata_agree(sheet):
    _, pdf = sheet
    info, xmp = information(pdf), metadata(pdf)
    assert info["/Title"] == xmp["title"] == "Hall 3 <left> & right"
    assert info["/Subject"] == xmp["description"]
    assert info["/Creator"] == xmp["CreatorTool"]
    assert info["/Producer"] == xmp["Producer"]
    assert xmp["CreateDate"] == xmp["ModifyDate"] == xmp["MetadataDate"] == "2000-01-01T00:00:00Z"
    assert info["/CreationDate"] == info["/ModDate"] == "D:20000101000000Z"


def test_trapping_is_stated_and_false(sheet):
    _, pdf = sheet
    assert pdf.trailer.Info.Trapped == Name("/False")
    assert metadata(pdf)["Trapped"] == "False"


def test_one_output_intent_with_an_embedded_press_profile(sheet):
    _, pdf = sheet
    (intent,) = pdf.Root.OutputIntents
    assert intent.S == Name.GTS_PDFX
    assert str(intent.OutputConditionIdentifier) == "FOGRA39"
    assert str(intent.RegistryName) == "http://www.color.org"
    profile = intent.DestOutputProfile.read_bytes()
    assert int(intent.DestOutputProfile.N) == 4
    size, _, version, device, space, connection = struct.unpack(">I4sI4s4s4s", profile[:24])  # ICC.1, 7.2
    assert (size, device, space, connection) == (len(profile), b"prtr", b"CMYK", b"Lab ")
    assert version >> 24 in (2, 4)
    assert profile[36:40] == b"acsp"
    assert len(profile) <= 250_000


def test_the_profile_comes_with_its_licence():
    data = files("paxel_runtime") / "data"
    assert "zlib" in (data / "LICENSE.fogra39-coated-profile").read_text(encoding="utf-8")
    assert b"Behrmann" in (data / "fogra39_coated.icc").read_bytes()


def test_every_page_has_nested_boxes(sheet):
    _, pdf = sheet
    for page in pdf.pages:
        media, bleed, trim = ([float(v) for v in page.obj[f"/{name}Box"]] for name in ("Media", "Bleed", "Trim"))
        for outer, inner in ((media, bleed), (bleed, trim)):
            assert outer[0] <= inner[0] < inner[2] <= outer[2]
            assert outer[1] <= inner[1] < inner[3] <= outer[3]
        assert "/ArtBox" not in page.obj


def test_every_font_is_embedded(sheet):
    _, pdf = sheet
    fonts = [o for o in pdf.objects if isinstance(o, pikepdf.Dictionary) and o.get("/Type") == Name.Font]
    assert fonts
    for font in fonts:
        assert font.Subtype == Name.TrueType
        assert len(font.FontDescriptor.FontFile2.read_bytes()) > 1000


def test_only_inks_no_device_colours_of_a_screen(sheet):
    path, pdf = sheet
    packed = b"".join(o.read_bytes() for o in pdf.objects if isinstance(o, pikepdf.Stream) and "/BBox" in o)
    for page in pdf.pages:
        operators = {str(i.operator) for i in pikepdf.parse_content_stream(page)}
        assert not operators & {"rg", "RG", "g", "G"}
    for name in (b"DeviceRGB", b"DeviceGray", b"CalRGB", b"ICCBased"):
        assert name not in path.read_bytes() + packed


def test_nothing_that_changes_or_acts(sheet):
    _, pdf = sheet
    for key in ("/OpenAction", "/AA", "/AcroForm", "/Names", "/Perms"):
        assert key not in pdf.Root
    for page in pdf.pages:
        for key in ("/Annots", "/AA", "/Trans"):
            assert key not in page.obj
    for thing in pdf.objects:
        if isinstance(thing, pikepdf.Stream):
            assert thing.get("/Filter") != Name.LZWDecode
            assert "/OPI" not in thing
        if isinstance(thing, pikepdf.Dictionary) and thing.get("/Type") == Name.ExtGState:
            assert not {"/TR", "/TR2", "/HTP", "/HT"} & set(thing.keys())


def test_the_file_has_an_identifier(sheet):
    _, pdf = sheet
    assert [len(bytes(part)) for part in pdf.trailer.ID] == [16, 16]


def test_a_spot_ink_means_the_same_wherever_it_is_used(sheet):
    _, pdf = sheet
    spaces = [o for o in pdf.objects if isinstance(o, pikepdf.Array) and len(o) and o[0] == Name.Separation]
    if not spaces:
        assert not any(isinstance(o, pikepdf.Array) and len(o) and o[0] == Name.DeviceN for o in pdf.objects)
        return
    (separation,) = spaces  # one object for patch and pattern
    assert str(separation[1]) == f"/{SPOT}"
    (device_n,) = [o for o in pdf.objects if isinstance(o, pikepdf.Array) and len(o) and o[0] == Name.DeviceN]
    assert [str(name) for name in device_n[1]] == ["/Black", f"/{SPOT}"]
    assert device_n[2] == Name.DeviceCMYK
    assert device_n[4].Colorants[f"/{SPOT}"] == separation
    assert device_n[4].Process.ColorSpace == Name.DeviceCMYK
