"""What makes a PDF a PDF/X-4 (ISO 15930-7): the print condition, the metadata, the boxes, and reproducible bytes.

Knows nothing of patterns: any finished PDF with CMYK and spot colours and embedded fonts will do.
"""

from __future__ import annotations

import hashlib
import io
import uuid
from importlib.resources import files
from xml.sax.saxutils import escape

import pikepdf
from pikepdf import Array, Dictionary, Name

from paxel_runtime.version import WRITER

__all__ = ["DATE", "OUTPUT_CONDITION", "pdfx4_bytes"]

OUTPUT_CONDITION = "FOGRA39"
"""Identifier of the print condition in the registry of the ICC: offset on coated paper, ISO 12647-2:2004."""

DATE = "2000-01-01T00:00:00Z"
"""Stands in every file: equal input gives equal bytes."""

_PDF_DATE = "D:20000101000000Z"
_VERSION = "PDF/X-4"
_PRODUCER = f"{WRITER} (reportlab, pikepdf)"
_XMP = """\
<?xpacket begin="\ufeff" id="W5M0MpCehiHzreSzNTczkc9d"?>
<x:xmpmeta xmlns:x="adobe:ns:meta/">
 <rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">
  <rdf:Description rdf:about=""
    xmlns:dc="http://purl.org/dc/elements/1.1/"
    xmlns:pdf="http://ns.adobe.com/pdf/1.3/"
    xmlns:pdfxid="http://www.npes.org/pdfx/ns/id/"
    xmlns:xmp="http://ns.adobe.com/xap/1.0/"
    xmlns:xmpMM="http://ns.adobe.com/xap/1.0/mm/">
   <dc:format>application/pdf</dc:format>
   <dc:title><rdf:Alt><rdf:li xml:lang="x-default">{title}</rdf:li></rdf:Alt></dc:title>
   <dc:description><rdf:Alt><rdf:li xml:lang="x-default">{subject}</rdf:li></rdf:Alt></dc:description>
   <xmp:CreatorTool>{creator}</xmp:CreatorTool>
   <xmp:CreateDate>{date}</xmp:CreateDate>
   <xmp:ModifyDate>{date}</xmp:ModifyDate>
   <xmp:MetadataDate>{date}</xmp:MetadataDate>
   <xmpMM:DocumentID>uuid:{document}</xmpMM:DocumentID>
   <xmpMM:InstanceID>uuid:{instance}</xmpMM:InstanceID>
   <xmpMM:VersionID>1</xmpMM:VersionID>
   <xmpMM:RenditionClass>default</xmpMM:RenditionClass>
   <pdf:Producer>{producer}</pdf:Producer>
   <pdf:Trapped>False</pdf:Trapped>
   <pdfxid:GTS_PDFXVersion>{version}</pdfxid:GTS_PDFXVersion>
  </rdf:Description>
 </rdf:RDF>
</x:xmpmeta>
<?xpacket end="r"?>
"""


def pdfx4_bytes(pdf: pikepdf.Pdf, *, title: str, subject: str) -> bytes:
    """Give a PDF the keys of PDF/X-4 and return its bytes, the same for the same input.

    Parameters
    ----------
    pdf : pikepdf.Pdf
        Changed in place. A page without a TrimBox gets its MediaBox as one.
    title, subject : str
        For the document's information; the title must not be empty.
    """
    content = hashlib.sha256(_page_contents(pdf)).hexdigest()
    document = uuid.uuid5(uuid.NAMESPACE_URL, f"{WRITER}/{title}/{subject}")
    instance = uuid.uuid5(document, content)
    _state_condition(pdf)
    _state_information(pdf, title, subject, str(document), str(instance))
    for page in pdf.pages:
        _state_boxes(page)
    buffer = io.BytesIO()
    pdf.save(
        buffer,
        force_version="1.6",
        deterministic_id=True,
        object_stream_mode=pikepdf.ObjectStreamMode.generate,
        compress_streams=True,
    )
    return buffer.getvalue()


def _page_contents(pdf: pikepdf.Pdf) -> bytes:
    """What tells one document from another: its drawing operators and its images' packed bytes."""
    return b"".join(stream.read_raw_bytes() for stream in pdf.objects if isinstance(stream, pikepdf.Stream))


def _state_condition(pdf: pikepdf.Pdf) -> None:
    profile = pikepdf.Stream(pdf, (files("paxel_runtime") / "data" / "fogra39_coated.icc").read_bytes())
    profile.N = 4
    profile.Alternate = Name.DeviceCMYK
    pdf.Root.OutputIntents = Array(
        [
            Dictionary(
                Type=Name.OutputIntent,
                S=Name.GTS_PDFX,
                OutputConditionIdentifier=OUTPUT_CONDITION,
                OutputCondition="Offset printing on coated paper, ISO 12647-2:2004",
                RegistryName="http://www.color.org",
                Info="Profile fitted by ArgyllCMS to FOGRA39L; the numbers of the file are amounts of ink, not colours",
                DestOutputProfile=pdf.make_indirect(profile),
            )
        ]
    )


def _state_information(pdf: pikepdf.Pdf, title: str, subject: str, document: str, instance: str) -> None:
    """The same facts twice, as PDF/X-4 wants them: the information dictionary and the XMP packet."""
    pdf.trailer.Info = pdf.make_indirect(
        Dictionary(
            Title=title,
            Subject=subject,
            Creator=WRITER,
            Producer=_PRODUCER,
            CreationDate=_PDF_DATE,
            ModDate=_PDF_DATE,
            Trapped=Name("/False"),
            GTS_PDFXVersion=_VERSION,
        )
    )
    packet = _XMP.format(
        title=escape(title),
        subject=escape(subject),
        creator=escape(WRITER),
        producer=escape(_PRODUCER),
        date=DATE,
        document=document,
        instance=instance,
        version=_VERSION,
    )
    metadata = pikepdf.Stream(pdf, packet.encode("utf-8"), Type=Name.Metadata, Subtype=Name.XML)
    pdf.Root.Metadata = pdf.make_indirect(metadata)
    for key in ("/Outlines", "/PageMode"):  # reportlab's, empty
        if key in pdf.Root:
            del pdf.Root[key]


def _state_boxes(page: pikepdf.Page) -> None:
    """Media, bleed and trim, nested; nothing of a presentation."""
    if "/TrimBox" not in page.obj:
        page.obj.TrimBox = Array(list(page.mediabox))
    if "/BleedBox" not in page.obj:
        page.obj.BleedBox = Array(list(page.obj.TrimBox))
    for key in ("/ArtBox", "/Trans", "/Annots"):
        if key in page.obj:
            del page.obj[key]
