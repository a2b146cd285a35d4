"""Sphinx settings: MyST pages, the API from docstrings, warnings are errors (`make docs`)."""

import re
import sys
from importlib.util import find_spec
from pathlib import Path

from gough import __version__

project = "gough"
author = "the gough authors"
copyright = "the gough authors, Apache-2.0"
version = release = __version__

sys.path.insert(0, str(Path(__file__).parent))  # for mathml

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "mathml",
]
html_math_renderer = "mathml"
myst_enable_extensions = ["dollarmath", "deflist", "colon_fence"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "results/discussion.md", "results/runs"]

html_theme = "furo"
html_title = f"gough {__version__}"

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_type_aliases = {"ArrayLike": "ArrayLike", "Array": "Array"}  # not what they stand for
autodoc_preserve_defaults = True
# a page may describe a part of the library whose own libraries are not installed here
autodoc_mock_imports = [
    name
    for name in (
        *("torch", "roma", "onnx", "onnxscript", "safetensors"),
        *("matplotlib", "mpl_toolkits", "viser"),
    )
    if find_spec(name) is None
]
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_attr_annotations = False  # attributes are described by their shapes


def name_every_page(app, page, source):
    """Add a last group to the index, of the pages that none of its own groups names."""
    if page != "index":
        return
    named = set(re.findall(r"^[\w/]+$", source[0], re.MULTILINE))
    others = sorted(app.env.found_docs - named - {"index"})
    if others:
        entries = "\n".join(others)
        source[0] += f"\n```{{toctree}}\n:caption: More\n:hidden:\n\n{entries}\n```\n"


LONG = re.compile(r"~?(?:numpy\.)?ndarray\[[^\]]*\], ~?(?:numpy\.)?dtype\[~?(?:numpy\.)?(\w+)\]\]")
ALIAS = re.compile(r"TypeAliasForwardRef\('(\w+)'\)")


def shorten_signature(app, what, name, thing, options, *texts):
    """Say NDArray[bool] where autodoc spells out what that stands for."""
    return tuple(text and ALIAS.sub(r"\1", LONG.sub(r"NDArray[\1]", text)) for text in texts)


def setup(app):
    app.connect("autodoc-process-signature", shorten_signature)
    app.connect("source-read", name_every_page)
