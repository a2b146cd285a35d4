"""The Python of README.md and docs/*.md, as a reader would run it.

A block that opens with ```python runs. Blocks of one page run in order and share their names. If
the next thing after it is a ```text block, that is what it must print: words exactly, numbers to
six digits, `...` stands for anything. `<!-- not run: reason -->` on the line before a block keeps
it from running.

`python tests/documents.py README.md docs/start.md` writes what blocks print into their pages.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]

FENCE = re.compile(r"^```(\w*)[^\n]*\n(.*?)^```\s*$", re.MULTILINE | re.DOTALL)
NOT_RUN = re.compile(r"<!--\s*not run: (?:(?!-->).)+-->\s*\Z", re.DOTALL)
TOKEN = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[A-Za-z_]+|\.\.\.|\S")


@dataclass(frozen=True)
class Block:
    """Code of a page, the line it starts on, and what it must print (None: anything)."""

    code: str
    line: int
    output: str | None
    span: tuple[int, int] = (0, 0)  # where the output stands in the page


def python_blocks(text: str) -> list[Block]:
    """The blocks of a page that run."""
    found = list(FENCE.finditer(text))
    blocks = []
    for here, after in zip(found, [*found[1:], None], strict=False):
        if here[1] != "python" or NOT_RUN.search(text[: here.start()]):
            continue
        follows = after and after[1] == "text" and not text[here.end() : after.start()].strip()
        line = text.count("\n", 0, here.start()) + 2
        if after and follows:
            blocks.append(Block(here[2], line, after[2], after.span(2)))
        else:
            blocks.append(Block(here[2], line, None))
    return blocks


def run(page: Path, blocks: list[Block]) -> list[str]:
    """What each block prints. Errors name the page and its line."""
    names: dict = {"__name__": "__main__"}
    printed = []
    for block in blocks:
        out = io.StringIO()
        code = compile("\n" * (block.line - 1) + block.code, str(page), "exec")
        with contextlib.redirect_stdout(out):
            exec(code, names)
        printed.append(out.getvalue())
    return printed


def with_outputs(page: Path) -> str:
    """The page with each output replaced by what its block prints here."""
    text = page.read_text("utf-8")
    blocks = python_blocks(text)
    for block, printed in reversed(list(zip(blocks, run(page, blocks), strict=True))):
        if block.output is not None and not same_output(printed, block.output):
            text = text[: block.span[0]] + printed + text[block.span[1] :]
    return text


def same_output(printed: str, expected: str) -> bool:
    """Word for word, numbers to six digits; `...` in what is expected stands for anything."""
    return _match(TOKEN.findall(printed), TOKEN.findall(expected))


def _match(printed: list[str], expected: list[str]) -> bool:
    if "..." in expected:
        cut = expected.index("...")
        head, rest = expected[:cut], expected[cut + 1 :]
        return _match(printed[:cut], head) and any(
            _match(printed[i:], rest) for i in range(cut, len(printed) + 1)
        )
    return len(printed) == len(expected) and all(map(_same_word, printed, expected))


def _same_word(a: str, b: str) -> bool:
    if a == b:
        return True
    try:
        x, y = float(a), float(b)
    except ValueError:
        return False
    return abs(x - y) <= 1e-6 * max(abs(x), abs(y)) + 1e-12


@contextlib.contextmanager
def playground() -> Iterator[Path]:
    """A folder with a copy of examples/, to run a page in; it is gone afterwards."""
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        if (ROOT / "examples").is_dir():
            shutil.copytree(ROOT / "examples", Path(folder, "examples"))
        os.chdir(folder)
        try:
            yield Path(folder)
        finally:
            os.chdir(before)


if __name__ == "__main__":
    for name in sys.argv[1:]:
        page = Path(name).resolve()
        with playground():
            page.write_text(with_outputs(page), "utf-8")
