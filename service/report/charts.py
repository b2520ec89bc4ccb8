"""Line charts as SVG elements: one line a breakpoint of the first axis, over the second."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree.ElementTree import Element

from service.report.html import element
from service.report.quantities import number

_WIDTH, _HEIGHT, _LEFT, _BOTTOM, _TOP, _RIGHT = 300.0, 150.0, 52.0, 30.0, 8.0, 8.0
#: Told apart without colour.
_DASHES = ("", "6 3", "2 2", "8 3 2 3", "1 3", "12 3")


def line_chart(
    title: str, across: Sequence[float], lines: Sequence[tuple[str, Sequence[float | None]]], axes: tuple[str, str]
) -> Element:
    """A chart of lines over common breakpoints; where a value does not exist a line is interrupted.

    Parameters
    ----------
    title : what is shown, for those who do not see it
    across : breakpoints, rising
    lines : name of each line and its values
    axes : what is across and what is up, with units
    """
    values = [value for _, line in lines for value in line if value is not None]
    low, high = (min([*values, 0.0]), max([*values, 0.0])) if values else (0.0, 1.0)
    high = high if high > low else low + 1.0
    first, last = across[0], across[-1] if across[-1] > across[0] else across[0] + 1.0

    def x(value: float) -> float:
        return _LEFT + (value - first) / (last - first) * (_WIDTH - _LEFT - _RIGHT)

    def y(value: float) -> float:
        return _HEIGHT - _BOTTOM - (value - low) / (high - low) * (_HEIGHT - _BOTTOM - _TOP)

    drawn = [_frame(low, high, first, last, y(0.0), axes)]
    for (name, line), dash in zip(lines, _DASHES * (len(lines) // len(_DASHES) + 1), strict=False):
        for stretch in _stretches(across, line):
            points = " ".join(f"{x(a):.2f},{y(b):.2f}" for a, b in stretch)
            drawn.append(
                element("polyline", element("title", name), points=points, stroke_dasharray=dash, class_="line")
            )
        drawn += [
            element("circle", cx=f"{x(a):.2f}", cy=f"{y(b):.2f}", r="1.8")
            for a, b in zip(across, line, strict=True)
            if b is not None
        ]
    return element(
        "svg", element("title", title), *drawn, viewBox=f"0 0 {_WIDTH:g} {_HEIGHT:g}", role="img", class_="chart"
    )


def _stretches(across: Sequence[float], line: Sequence[float | None]) -> list[list[tuple[float, float]]]:
    """The points of a line, parted where values do not exist."""
    found: list[list[tuple[float, float]]] = [[]]
    for place, value in zip(across, line, strict=True):
        if value is None:
            found.append([])
        else:
            found[-1].append((place, value))
    return [stretch for stretch in found if len(stretch) > 1]


def _frame(low: float, high: float, first: float, last: float, zero: float, axes: tuple[str, str]) -> Element:
    """Axes with their ends written at them."""
    right, bottom = _WIDTH - _RIGHT, _HEIGHT - _BOTTOM

    def at(text: str, x: float, y: float, anchor: str) -> Element:
        return element("text", text, x=f"{x:g}", y=f"{y:g}", text_anchor=anchor)

    return element(
        "g",
        element("path", d=f"M{_LEFT:g} {_TOP:g}V{bottom:g}H{right:g}M{_LEFT:g} {zero:.2f}H{right:g}"),
        at(number(high), _LEFT - 4, _TOP + 6, "end"),
        at(number(low), _LEFT - 4, bottom, "end"),
        at(number(first), _LEFT, bottom + 11, "start"),
        at(number(last), right, bottom + 11, "end"),
        at(axes[0], (_LEFT + right) / 2, bottom + 24, "middle"),
        at(axes[1], 2, (_TOP + bottom) / 2, "start"),
        class_="frame",
    )
