"""Elements of XML whose numbers are read as the same numbers."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from typing import Any

import numpy as np

import gough


def add(parent: ET.Element, tag: str, text: Any = None, **attributes: Any) -> ET.Element:
    """Add an element with a text and attributes; numbers and arrays are written in full."""
    element = ET.SubElement(parent, tag, {key: as_text(v) for key, v in attributes.items()})
    element.text = None if text is None else as_text(text)
    return element


def as_text(value: Any) -> str:
    """Text as it is, numbers with all their digits."""
    if isinstance(value, str):
        return value
    return " ".join(f"{number!r}" for number in np.ravel(value).astype(float).tolist())


def written(root: ET.Element, facts: str) -> str:
    """The text of a file, with a comment in front of its elements."""
    text = f" Written by gough {gough.__version__} {facts} "
    root.insert(0, ET.Comment(text.replace("--", "- -")))  # which a comment must not hold
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"
