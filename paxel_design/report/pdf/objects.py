"""Pictures and charts as objects of the PDF: named while pages are set, embedded once afterwards with pikepdf.

reportlab would decode pictures and knows no vector graphics of others; so a page's operators name an object
(``/P0 Do``), and `Objects.embed` gives the page that name. Equal pictures are one object; all charts share their fonts.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Set
from typing import TYPE_CHECKING

import matplotlib
import pikepdf
from matplotlib.backends.backend_pdf import FigureCanvasPdf, PdfPages
from pikepdf import Array, Dictionary, Name

from paxel_design.report.charts import style
from paxel_design.report.content import Picture
from paxel_design.report.pdf.encoding import Raster, raster_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Objects"]


class Objects:
    """The pictures and charts of one document."""

    def __init__(self) -> None:
        self._charts: list[Figure] = []
        self._rasters: dict[Raster, str] = {}
        self._encoded: dict[tuple[int, int], tuple[str, Picture]] = {}

    def chart(self, figure: Figure) -> str:
        """The name under which a page draws a chart."""
        if not any(figure is known for known in self._charts):
            self._charts.append(figure)
        return f"C{next(i for i, known in enumerate(self._charts) if known is figure)}"

    def picture(self, picture: Picture, width_mm: float) -> str:
        """The name under which a page draws a picture that is set `width_mm` wide."""
        key = (id(picture.picture), round(100 * width_mm))
        if key not in self._encoded:
            raster = raster_of(picture.picture, width_mm, pixelated=picture.pixelated)
            name = self._rasters.setdefault(raster, f"P{len(self._rasters)}")
            self._encoded[key] = name, picture  # kept: an id is one array's only as long as that lives
        return self._encoded[key][0]

    def embed(self, pdf: pikepdf.Pdf, names: Mapping[int, Set[str]]) -> None:
        """Give pages, counted from 1, the objects that they name."""
        charts, rasters = self._embedded_charts(pdf), {}
        used = set().union(*names.values())
        for raster, name in self._rasters.items():
            if name in used:
                rasters[name] = _embedded(pdf, raster)
        objects = charts | rasters
        for page, wanted in sorted(names.items()):
            resources = pdf.pages[page - 1].resources
            if Name.XObject not in resources:
                resources.XObject = Dictionary()
            for name in sorted(wanted):
                resources.XObject[f"/{name}"] = objects[name]

    def _embedded_charts(self, pdf: pikepdf.Pdf) -> dict[str, pikepdf.Object]:
        """Every chart as a form whose unit square is the whole chart, as a picture's is."""
        if not self._charts:
            return {}
        buffer = io.BytesIO()
        with matplotlib.rc_context(style()), PdfPages(buffer, metadata={"CreationDate": None}) as pages:
            for figure in self._charts:  # one file for all: a font is embedded once
                FigureCanvasPdf(figure).print_pdf(pages)  # savefig would arrange and draw every figure twice
        with pikepdf.open(buffer) as charts:
            forms = {}
            for i, page in enumerate(charts.pages):
                width, height = (float(v) for v in page.mediabox[2:])
                form = pdf.copy_foreign(page.as_form_xobject())
                form.Matrix = Array([1 / width, 0, 0, 1 / height, 0, 0])
                forms[f"C{i}"] = form
        return forms


def _embedded(pdf: pikepdf.Pdf, raster: Raster) -> pikepdf.Object:
    image = pikepdf.Stream(
        pdf,
        raster.data,
        Type=Name.XObject,
        Subtype=Name.Image,
        Width=raster.width,
        Height=raster.height,
        BitsPerComponent=8,
        ColorSpace=Name.DeviceRGB,
        Interpolate=False,
    )
    if raster.palette:
        last = len(raster.palette) // 3 - 1
        image.ColorSpace = Array([Name.Indexed, Name.DeviceRGB, last, pikepdf.String(raster.palette)])
    if raster.jpeg:
        image.write(raster.data, filter=Name.DCTDecode)
    else:
        colors = 1 if raster.palette else 3
        predictor = Dictionary(Predictor=15, Colors=colors, BitsPerComponent=8, Columns=raster.width)
        image.write(raster.data, filter=Name.FlateDecode, decode_parms=predictor)
    return pdf.make_indirect(image)
