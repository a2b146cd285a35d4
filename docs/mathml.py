"""Formulas as MathML, which browsers draw by themselves: pages need no script from the network."""

from __future__ import annotations

from docutils.nodes import SkipNode
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.errors import ExtensionError


def inline(self, node):
    self.body.append(_converted(node, False))
    raise SkipNode


def block(self, node):
    self.body.append(f'<div class="formula">{_converted(node, True)}</div>\n')
    raise SkipNode


def _converted(node, as_block: bool) -> str:
    try:
        return str(tex2mathml(node.astext(), as_block=as_block))
    except MathError as error:
        raise ExtensionError(f"{node.source}: formula {node.astext()!r}: {error}") from error


def setup(app):
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True}
