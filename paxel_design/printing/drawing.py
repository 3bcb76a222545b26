"""A finished PDF page, taken apart so that other pages can show parts of it without the blocks that lie elsewhere.

A block is an image or a form that the page places by a matrix. Knows the operators of a content stream that do so
(PDF 32000-1, 8.4 and 8.10), and nothing of what is drawn.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pikepdf
from numpy.typing import NDArray

__all__ = ["Drawing"]

Instruction = pikepdf.ContentStreamInstruction | pikepdf.ContentStreamInlineImage
Box = tuple[float, float, float, float]


@dataclass(frozen=True, eq=False)
class Drawing:
    """One page as operators.

    Attributes
    ----------
    head : list of content stream instructions
        Up to the last block, every ``q`` closed.
    boxes : dict of (first, stop) -> box
        Runs of `head` that do nothing but place one block: where it lies, (left, bottom, right, top) in points.
    resources : pikepdf.Dictionary
        The page's, and ``/PaxelTail``: what follows the head, as a form.
    """

    head: list[Instruction]
    boxes: dict[tuple[int, int], Box]
    resources: pikepdf.Object

    @staticmethod
    def of(pdf: pikepdf.Pdf) -> Drawing:
        """Take the first page of a PDF apart."""
        page = pdf.pages[0]
        instructions = list(pikepdf.parse_content_stream(page))
        resources = page.obj.Resources
        xobjects = pikepdf.Dictionary()
        for name, xobject in resources.XObject.items() if "/XObject" in resources else ():
            xobjects[name] = xobject
        corners = {name: _corners(xobject) for name, xobject in xobjects.items()}
        boxes, stop = _block_boxes(instructions, corners)
        tail = pdf.make_stream(pikepdf.unparse_content_stream(instructions[stop:]))
        tail.Type, tail.Subtype = pikepdf.Name.XObject, pikepdf.Name.Form
        # it is drawn with whatever matrix the head leaves, so its box is as large as numbers may be
        tail.BBox = pikepdf.Array([-32767, -32767, 32767, 32767])
        tail.Resources = pdf.make_indirect(resources)
        own = pikepdf.Dictionary()
        for name, resource in resources.items():
            own[name] = resource
        own.XObject = xobjects
        own.XObject.PaxelTail = tail
        return Drawing(instructions[:stop], boxes, pdf.make_indirect(own))

    def part(self, pdf: pikepdf.Pdf, box: Box) -> pikepdf.Object:
        """The part of the page within a box in points, as a form XObject in the page's own coordinates."""
        dropped = np.zeros(len(self.head), bool)
        for (first, stop), (left, bottom, right, top) in self.boxes.items():
            if left >= box[2] or right <= box[0] or bottom >= box[3] or top <= box[1]:
                dropped[first:stop] = True
        kept = [instruction for instruction, drop in zip(self.head, dropped, strict=True) if not drop]
        form = pdf.make_stream(pikepdf.unparse_content_stream(kept) + b"\n/PaxelTail Do\n")
        form.Type, form.Subtype = pikepdf.Name.XObject, pikepdf.Name.Form
        form.BBox = pikepdf.Array([round(v, 5) for v in box])
        form.Resources = self.resources
        return form


def _block_boxes(
    instructions: list[Instruction], corners: dict[str, NDArray[np.float64]]
) -> tuple[dict[tuple[int, int], Box], int]:
    """Where each block lies whose ``q .. Q`` holds nothing else, and where the outermost ``q .. Q`` of the last ends.

    `corners` (4, 3) of each XObject in its own space.
    """
    matrix = np.eye(3)
    matrices, starts = list[NDArray[np.float64]](), list[int]()
    placed: dict[int, tuple[int, Box]] = {}  # start of a group -> (its block, where that lies)
    boxes: dict[tuple[int, int], Box] = {}
    last, stop = -1, 0
    for i, instruction in enumerate(instructions):
        operator = str(instruction.operator)
        if operator == "q":
            matrices.append(matrix)
            starts.append(i)
        elif operator == "Q":
            matrix, first = matrices.pop(), starts.pop()
            if first in placed and placed[first][0] == i - 1:
                boxes[first, i + 1] = placed[first][1]
            if last > first and not starts:
                last, stop = -1, i + 1
        elif operator == "cm":
            matrix = _matrix(instruction) @ matrix
        elif operator == "Do" and str(instruction.operands[0]) in corners:
            last = i
            if starts and all(str(before.operator) == "cm" for before in instructions[starts[-1] + 1 : i]):
                placed[starts[-1]] = (i, _box(corners[str(instruction.operands[0])] @ matrix))
    return boxes, stop if last < 0 else len(instructions)


def _matrix(instruction: Instruction) -> NDArray[np.float64]:
    """The matrix of a ``cm``, for rows [x, y, 1]."""
    a, b, c, d, e, f = (float(str(v)) for v in instruction.operands)
    return np.array([[a, b, 0.0], [c, d, 0.0], [e, f, 1.0]])


def _corners(xobject: pikepdf.Object) -> NDArray[np.float64]:
    """Corners [x, y, 1] of an XObject: an image fills the unit square, a form its box, by a matrix of its own."""
    if xobject.Subtype == pikepdf.Name.Image:
        return np.array([[0.0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1]])
    left, bottom, right, top = (float(v) for v in xobject.BBox)
    corners = np.array([[left, bottom, 1], [right, bottom, 1], [left, top, 1], [right, top, 1]])
    if "/Matrix" in xobject:
        a, b, c, d, e, f = (float(v) for v in xobject.Matrix)
        corners = corners @ np.array([[a, b, 0.0], [c, d, 0.0], [e, f, 1.0]])
    return corners


def _box(corners: NDArray[np.float64]) -> Box:
    (left, bottom), (right, top) = corners[:, :2].min(axis=0), corners[:, :2].max(axis=0)
    return float(left), float(bottom), float(right), float(top)
