"""Formulas as MathML, which browsers draw by themselves: no script from the network is needed."""

from __future__ import annotations

import re
from itertools import cycle

from docutils.nodes import SkipNode
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.errors import ExtensionError

# LaTeX that docutils does not know, and what it does know in its place
INSTEAD = (
    (re.compile(r"\\[bB]igg?[lrm]?(?![a-zA-Z])\s*"), ""),
    (re.compile(r"\\dots(?![a-z])"), r"\\ldots"),
    (re.compile(r"\\([td]?frac)\s*(\d)\s*(\d)"), r"\\\1{\2}{\3}"),
)
BAR = re.compile(r"<mo[^>]*>([|‖])</mo>")


def inline(self, node):
    """Write a formula within a line; `self` is Sphinx's translator."""
    self.body.append(_converted(node, False))
    raise SkipNode


def block(self, node):
    """Write a formula of its own; where it is too wide, it scrolls."""
    self.body.append(f'<div style="overflow-x: auto">{_converted(node, True)}</div>\n')
    raise SkipNode


def _converted(node, as_block: bool) -> str:
    tex = node.astext()
    for pattern, known in INSTEAD:
        tex = pattern.sub(known, tex)
    try:
        formula = str(tex2mathml(tex, as_block=as_block))
    except MathError as error:
        raise ExtensionError(f"{node.source}: formula {node.astext()!r}: {error}") from error
    sides = cycle(("prefix", "postfix"))  # bars come in pairs, as tall as a letter
    return BAR.sub(
        lambda bar: (
            f'<mo form="{next(sides)}" stretchy="false" lspace="0" rspace="0">{bar[1]}</mo>'
        ),
        formula,
    )


def setup(app):
    """Make it the renderer that `html_math_renderer` can name."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True}
