"""Markdown tables and numbers, and a page of HTML that needs no other file."""

from __future__ import annotations

import html
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

NOTHING = "n/a"  # the paper has no such number

_PAGE = """<!doctype html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
body {{ font: 16px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem;
       color: #222; background: #fff; }}
.scroll {{ overflow-x: auto; }}
table {{ border-collapse: collapse; margin: 1rem 0; font-size: 0.85rem; }}
th, td {{ padding: 0.25rem 0.6rem; border-bottom: 1px solid #ddd; text-align: right; }}
th {{ border-bottom: 2px solid #888; vertical-align: bottom; }}
th:first-child, td:first-child {{ text-align: left; }}
svg {{ width: 100%; height: auto; }}
code {{ background: #f3f3f3; padding: 0.1em 0.3em; }}
h1, h2 {{ line-height: 1.2; }}
</style>
{body}
</html>
"""


def table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Write a Markdown table; the first column is text, the others are numbers.

    Raises:
        ValueError: a row with another number of cells, or an empty cell.
    """
    lines = [f"| {' | '.join(head)} |", "|---" + "|---:" * (len(head) - 1) + "|"]
    for row in rows:
        cells = [str(cell) for cell in row]
        if len(cells) != len(head) or not all(cell.strip() for cell in cells):
            raise ValueError(f"table: {len(head)} filled cells are needed, found {cells}")
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def number(value: float | None, digits: int = 3) -> str:
    """Write a number to some significant digits, without exponent where that is short."""
    if value is None:
        return NOTHING
    if value == 0:
        return "0"
    if abs(value) >= 10**digits:
        return f"{value:,.0f}"
    return f"{value:#.{digits}g}".rstrip(".")


def percent(share: float, places: int = 1) -> str:
    """Write a share as per cent."""
    return f"{100 * share:.{places}f}"


def milliseconds(seconds: float) -> str:
    """Write a time [s] in ms to three digits."""
    return number(1e3 * seconds)


def page(markdown: str, title: str, folder: Path) -> str:
    """Convert Markdown to one HTML page with its SVG figures inside."""
    from markdown_it import MarkdownIt

    body = MarkdownIt("commonmark").enable("table").render(markdown)
    body = body.replace("<table>", '<div class="scroll"><table>')
    body = body.replace("</table>", "</table></div>")
    body = re.sub(
        r'<img src="([^"]+\.svg)" alt="([^"]*)"[^>]*>',
        lambda found: _inline(folder / found[1], found[2], Path(found[1]).stem),
        body,
    )
    return _PAGE.format(title=html.escape(title), body=body)


def _inline(path: Path, words: str, name: str) -> str:
    """An SVG picture as part of the page, its ids prefixed, since several share a page."""
    text = path.read_text(encoding="utf-8")
    text = text[text.index("<svg") :]
    text = re.sub(r'(\bid="|href="#|url\(#)', rf"\g<1>{name}-", text)
    return text.replace("<svg", f'<svg role="img" aria-label="{words}"', 1)
