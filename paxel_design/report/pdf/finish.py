"""A set document finished with pikepdf: its objects, its metadata, and reproducible bytes."""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Set

import pikepdf
from pikepdf import Array, Dictionary, Name, String

from paxel_design.report.pdf.objects import Objects

__all__ = ["finished"]

_ISO_DATE = re.compile(r"(\d{4})-(\d\d)-(\d\d)")


def finished(
    content: bytes,
    objects: Objects,
    names: Mapping[int, Set[str]],
    *,
    title: str,
    subject: str,
    writer: str,
    date: str,
) -> bytes:
    """Give a document its objects, page labels, language and metadata.

    Parameters
    ----------
    content : bytes
        The file that reportlab wrote.
    objects : Objects
    names : mapping of int to set of str
        Objects that pages refer to; pages count from 1.
    title, subject, writer : str
    date : str
        Stated as the date of creation if it begins with an ISO date; else the file states none.
    """
    with pikepdf.open(io.BytesIO(content)) as pdf:
        objects.embed(pdf, names)
        _state_metadata(pdf, title, subject, writer, date)
        pdf.Root.Lang = String("en")
        pdf.Root.PageMode = Name.UseOutlines
        pdf.Root.ViewerPreferences = Dictionary(DisplayDocTitle=True)
        pdf.Root.PageLabels = Dictionary(Nums=Array([0, Dictionary(S=Name.D)]))
        for page in pdf.pages:
            if Name.Trans in page.obj:
                del page.obj[Name.Trans]
        pdf.remove_unreferenced_resources()
        buffer = io.BytesIO()
        pdf.save(
            buffer,
            force_version="1.6",
            deterministic_id=True,
            object_stream_mode=pikepdf.ObjectStreamMode.generate,
            stream_decode_level=pikepdf.StreamDecodeLevel.generalized,
            compress_streams=True,
        )
        return buffer.getvalue()


def _state_metadata(pdf: pikepdf.Pdf, title: str, subject: str, writer: str, date: str) -> None:
    """The same facts twice: the information dictionary and the XMP packet."""
    information = Dictionary(Title=title, Subject=subject, Author=writer, Creator=writer)
    information.Producer = f"{writer} (reportlab, pikepdf)"
    match = _ISO_DATE.match(date)
    if match:
        information.CreationDate = f"D:{''.join(match.groups())}000000Z"
        information.ModDate = information.CreationDate
    pdf.trailer.Info = pdf.make_indirect(information)
    with pdf.open_metadata(set_pikepdf_as_editor=False, update_docinfo=False) as metadata:
        metadata["dc:title"] = title
        metadata["dc:description"] = subject
        metadata["dc:creator"] = [writer]
        metadata["dc:language"] = {"en"}
        metadata["xmp:CreatorTool"] = writer
        metadata["pdf:Producer"] = str(information.Producer)
        if match:
            metadata["xmp:CreateDate"] = metadata["xmp:ModifyDate"] = "-".join(match.groups()) + "T00:00:00Z"
