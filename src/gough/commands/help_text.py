"""Help texts: the list of commands, and tyro's text of one command made to fit a screen."""

from __future__ import annotations

import inspect
import io
import re
import shutil
import textwrap
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout

from gough.commands import COMMANDS

# defaults that say nothing, and words that only Python's types explain
NO_DEFAULT = re.compile(r"\s*\(default: (None|False|)\)")
WORDS = {
    "show this help message and exit": "Show this help and exit.",
    "{None}|": "",
    "[STR INT [STR INT ...]]": "NAME N ...",
}


def overview() -> str:
    """The list of commands."""
    lines = [f"  {name:<11} {text}" for name, (_, _, text) in COMMANDS.items()]
    return "\n".join(
        [
            "usage: gough COMMAND [OPTIONS]",
            "",
            "Forward kinematics of hexapods: poses from the lengths of their legs, and back.",
            "",
            "commands:",
            *lines,
            "",
            "gough COMMAND --help lists the options; gough --version prints the version.",
            "gough --print-completion SHELL prints the completions of bash, zsh or fish.",
        ]
    )


def laid_out(docstring: str) -> str:
    """A docstring with one line for each paragraph and option, which tyro keeps as they are."""
    text, head, options = inspect.cleandoc(docstring).partition("\nArgs:")
    paragraphs = [" ".join(paragraph.split()) for paragraph in text.split("\n\n")]
    return "\n\n".join(paragraphs) + "\n" * bool(head) + head + re.sub(r"\n {8}", " ", options)


@contextmanager
def tidied() -> Iterator[None]:
    """Print tyro's help text with `tidy` applied to it."""
    text = io.StringIO()  # which makes tyro print neither colours nor boxes
    try:
        with redirect_stdout(text):
            yield
    finally:
        if text.getvalue():
            print(tidy(text.getvalue(), shutil.get_terminal_size().columns))


def tidy(text: str, width: int) -> str:
    """Help text without empty defaults and lines within sections, its paragraphs wrapped."""
    for word, better in WORDS.items():
        text = text.replace(word, better)
    lines = []
    for line in NO_DEFAULT.sub("", text).split("\n"):
        if line.startswith("  "):  # an option, which tyro has wrapped, or a second rule
            lines += [line] * (not line.startswith("  ---"))
        else:
            indent = "  " if line.startswith(("usage: ", "gough ")) else ""
            lines += textwrap.wrap(line, width, subsequent_indent=indent) or [""]
    text = "\n".join(line.rstrip() for line in lines)
    return re.sub(r"\n\n+(?=  )", "\n", re.sub(r"\n{3,}", "\n\n", text)).strip("\n")
