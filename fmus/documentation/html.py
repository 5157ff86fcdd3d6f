"""Small pieces of HTML."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ufffe\uffff]")
_CODE = re.compile(r"`([^`]+)`")


@dataclass(frozen=True)
class Column:
    """A table's column: its heading, its cells (HTML) and its CSS class (which sets its width)."""

    heading: str
    cells: Sequence[str]
    style: str = ""


def text(content: str) -> str:
    """Return text as HTML, without control characters."""
    return escape(_CONTROL.sub("�", content))


def code(content: str) -> str:
    """Return text as HTML code."""
    return f"<code>{text(content)}</code>"


def prose(content: str) -> str:
    """Return paragraphs of text, in which `backticks` mark code."""
    paragraphs = [" ".join(part.split()) for part in content.split("\n\n") if part.strip()]
    marked = (_CODE.sub(r"<code>\1</code>", text(p)) for p in paragraphs)
    return "".join(f"<p>{p}</p>\n" for p in marked)


def section(identity: str, heading: str, content: str) -> str:
    """Return a section that the page's navigation can point to."""
    return f'<section id="{identity}">\n<h2>{text(heading)}</h2>\n{content}</section>\n'


def table(columns: Sequence[Column]) -> str:
    """Return a table."""
    head = "".join(f"<th{_class(c)}>{text(c.heading)}</th>" for c in columns)
    body = ""
    for cells in zip(*(c.cells for c in columns), strict=True):
        pairs = zip(columns, cells, strict=True)
        body += "<tr>" + "".join(f"<td{_class(c)}>{cell}</td>" for c, cell in pairs) + "</tr>\n"
    return (
        f'<div class="table"><table>\n<thead><tr>{head}</tr></thead>\n'
        f"<tbody>\n{body}</tbody>\n</table></div>\n"
    )


def _class(column: Column) -> str:
    return f' class="{column.style}"' if column.style else ""
