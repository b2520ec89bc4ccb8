"""HTML by its elements: text is escaped by the writer, never by hand."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from xml.etree.ElementTree import Element, tostring

#: What stands in an element: text or other elements.
Content = str | Element


def element(tag: str, *content: Content, **attributes: str) -> Element:
    """An element; of an attribute that Python has taken, the name ends in an underscore (``class_``)."""
    made = Element(tag, {name.rstrip("_").replace("_", "-"): value for name, value in attributes.items()})
    for part in content:
        if isinstance(part, Element):
            made.append(part)
        elif len(made):
            made[-1].tail = (made[-1].tail or "") + part
        else:
            made.text = (made.text or "") + part
    return made


def table(caption: str, head: Sequence[Content], rows: Iterable[Sequence[Content]]) -> Element:
    """A table whose first column names its rows."""
    body = [
        element("tr", element("th", row[0], scope="row"), *(element("td", cell) for cell in row[1:])) for row in rows
    ]
    return element(
        "table",
        element("caption", caption),
        element("thead", element("tr", *(element("th", name, scope="col") for name in head))),
        element("tbody", *body),
    )


def document(title: str, style: str, *content: Content) -> bytes:
    """A whole page."""
    head = element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", name="viewport", content="width=device-width, initial-scale=1"),
        element("title", title),
        element("style", style),
    )
    page = element("html", head, element("body", element("main", *content)), lang="en")
    written: bytes = tostring(page, encoding="utf-8", method="html")
    return b"<!doctype html>\n" + written + b"\n"
