r"""Texts and numbers inside files of other languages: comments that cannot end early, strings that cannot break.

A schedule carries texts that people wrote (the design's name, reasons with quotes and brackets). In comments they
stand in ASCII, one line each, what is not printable as an escape of Python (``\xfc``, ``\n``, and ``\\`` for the
backslash itself); what would end or open a comment has one of its characters escaped in the same way.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator


def plain(text: str) -> str:
    r"""One line of printable ASCII; everything else, and the backslash, as escapes: ``Fl\xfcgel\n``."""
    return text.encode("unicode_escape").decode("ascii")


def in_c_comment(text: str) -> str:
    r"""`plain`, with ``*/`` and ``/*`` as ``*\x2f`` and ``/\x2a``, and ``??`` as ``?\x3f`` (a trigraph's beginning)."""
    return plain(text).replace("??", "?\\x3f").replace("*/", "*\\x2f").replace("/*", "/\\x2a")


def in_xml_comment(text: str) -> str:
    r"""`plain`, with the hyphens of ``--`` as ``\x2d``; what follows in the comment must not be a hyphen."""
    return plain(text).replace("--", "\\x2d\\x2d")


def c_string(text: str) -> str:
    r"""A C string literal of the text in UTF-8; what is not a plain character stands as three octal digits."""
    safe = set(range(0x20, 0x7F)) - set(b'"\\?')
    return '"' + "".join(chr(b) if b in safe else f"\\{b:03o}" for b in text.encode("utf-8", "backslashreplace")) + '"'


def m_string(text: str) -> str:
    """A MATLAB character vector of the `plain` text in single quotes, in which only the quote is special."""
    return "'" + plain(text).replace("'", "''") + "'"


def number(value: float) -> str:
    """The shortest decimal that reads back to the same double; valid in C, MATLAB, XML and DAVE-ML alike."""
    return repr(float(value))


def wrapped(items: Iterable[str], separator: str, indent: str, width: int = 110) -> Iterator[str]:
    """Lines of `items`, each line indented and at most `width` wide where the items allow it.

    Every line but the last ends in the separator without its trailing blanks.
    """
    line = ""
    for item in items:
        if line and len(indent) + len(line) + len(separator) + len(item) > width:
            yield indent + line + separator.rstrip()
            line = item
        else:
            line = f"{line}{separator}{item}" if line else item
    yield indent + line
