"""The sections of a report, each made of one document of the API."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any
from xml.etree.ElementTree import Element

from service.report.charts import line_chart
from service.report.html import Content, element, table
from service.report.quantities import NONE, number, place, quantity, unit_in, words

Document = dict[str, Any]

#: A table with a row for each point of a larger grid would fill pages.
_MOST_POINTS = 60
#: Parts of a request, under their headings; the controllers follow by themselves.
_PARTS = ("geometry", "inertia", "aerodynamics", "atmosphere", "trim", "grid", "actuators", "reference")
#: Margins whose least is the worst; of the others the largest is.
_LARGEST_IS_WORST = {"sensitivity_peak", "settling_time_s", "overshoot_percent", "undershoot_percent", "rise_time_s"}
_MARGINS = ("gain_margin_up_db", "gain_margin_down_db", "phase_margin_deg", "delay_margin_s", "disk_margin")
_STEP = ("rise_time_s", "settling_time_s", "overshoot_percent", "bandwidth_rad_s")


def inputs(request: Document) -> Element:
    """What was asked for, every field."""
    tables = [
        table(words(part), ("field", "value"), [(name, value) for name, value in _leaves(request[part])])
        for part in _PARTS
        if isinstance(request.get(part), dict)
    ]
    tables += [
        table(f"controller {wanted['name']}", ("field", "value"), [(name, value) for name, value in _leaves(wanted)])
        for wanted in request["controllers"]
    ]
    return element("section", element("h2", "Inputs"), element("div", *tables, class_="columns"))


def envelope(design: Document) -> Element:
    """The grid with its air, and what to know about its points."""
    axes, air = design["grid"]["axes"], design["air"]
    figures = ("airspeed_m_s", "dynamic_pressure_pa", "mach", "density_kg_m3", "temperature_k")
    rows = [(words(name), _span(air[name], unit_in(name))) for name in figures]
    warnings = [
        element(
            "li",
            element("strong", warning["code"].replace("_", " ")),
            f": {warning['detail']} ({_points(warning['points'], axes)})",
        )
        for warning in design["warnings"]
    ]
    return element(
        "section",
        element("h2", "Envelope"),
        table("air over the grid", ("quantity", "from ... to"), rows),
        element("h3", "Warnings"),
        element("ul", *warnings) if warnings else element("p", "None."),
    )


def controller(
    design: Document, wanted: Document, figures: Document, demand: Document, proof: Document | None
) -> Element:
    """Everything about one controller."""
    axes = design["grid"]["axes"]
    return element(
        "section",
        element("h2", f"Controller {wanted['name']} ({words(wanted['kind'])})"),
        _outcomes(wanted, axes),
        *_gains(wanted, axes),
        _verdicts(wanted, axes),
        _worst_figures(figures, axes),
        _demand(demand, axes),
        _proof(proof),
    )


def _outcomes(wanted: Document, axes: list[Document]) -> Element:
    codes = [code for row in wanted["outcomes"] for code in row]
    reasons = [reason for row in wanted["reasons"] for reason in row]
    good = codes.count("ok")
    said = element("p", f"{good} of {len(codes)} grid points carry gains.")
    bad = [(point, code, reasons[point]) for point, code in enumerate(codes) if code != "ok"]
    listed = [element("li", f"{place(point, axes)}: {words(code)}; {why}") for point, code, why in bad[:_MOST_POINTS]]
    rest = [element("li", f"and {len(bad) - _MOST_POINTS} more")] if len(bad) > _MOST_POINTS else []
    return element("div", said, *([element("ul", *listed, *rest)] if bad else []))


def _gains(wanted: Document, axes: list[Document]) -> Iterator[Content]:
    """A chart of each gain, and its numbers where they have room."""
    rows, columns = (axis["values"] for axis in axes)
    across = f"{words(axes[1]['name'])} [{unit_in(axes[1]['name'])}]"
    charts = []
    for gain in wanted["gains"]:
        unit = "" if gain["unit"] == "1" else f" [{gain['unit']}]"
        lines = [
            (f"{words(axes[0]['name'])} {row:g}", values) for row, values in zip(rows, gain["values"], strict=True)
        ]
        title = f"{gain['name']}{unit} over {across}, a line for each {words(axes[0]['name'])}"
        charts.append(
            element(
                "figure", line_chart(title, columns, lines, (across, "")), element("figcaption", gain["name"] + unit)
            )
        )
    yield element("h3", "Gains")
    yield element("div", *charts, class_="charts")
    if len(rows) * len(columns) <= _MOST_POINTS:
        head = [place_name(axes), *(gain["name"] for gain in wanted["gains"])]
        lines_of = [
            [place(i * len(columns) + j, axes), *(number(gain["values"][i][j]) for gain in wanted["gains"])]
            for i in range(len(rows))
            for j in range(len(columns))
        ]
        yield table("gains, SI and radians, u = -K x", head, lines_of)


def place_name(axes: list[Document]) -> str:
    """Heading of a column of grid points."""
    return " and ".join(words(axis["name"]) for axis in axes)


def _verdicts(wanted: Document, axes: list[Document]) -> Element:
    rows = [
        (
            words(verdict["spec"]),
            words(verdict["source"]),
            quantity(verdict["limit"], verdict["unit"]),
            quantity(verdict["worst_value"], verdict["unit"]) if verdict["reason"] is None else verdict["reason"],
            place(verdict["worst_point"], axes),
            element("span", "met" if verdict["passed"] else "missed", class_="met" if verdict["passed"] else "missed"),
        )
        for verdict in wanted["verdicts"]
    ]
    return table("specs, each at its worst point", ("spec", "of", "limit", "worst", "at", "verdict"), rows)


def _worst_figures(figures: Document, axes: list[Document]) -> Element:
    rows: list[tuple[Content, ...]] = [
        (words(name), *_worst(name, figures[name], axes, figures)) for name in ("decay_rate_1_s", "damping_ratio")
    ]
    for loop, margins in figures["margins"].items():
        rows += [(f"{words(name)}, loop cut at the {loop}", *_worst(name, margins[name], axes)) for name in _MARGINS]
    if figures["step"] is not None:
        rows += [(words(name), *_worst(name, figures["step"][name], axes, figures)) for name in _STEP]
    return table(
        "margins and step, worst over the envelope (a dash: no limit at any point)", ("figure", "worst", "at"), rows
    )


def _demand(demand: Document, axes: list[Document]) -> Element:
    rows = []
    for surface, figures in demand["envelope"].items():
        limits = demand["limits"][surface]
        for name, worst in figures.items():
            limit = limits.get(name.removeprefix("peak_")) if name.startswith("peak_") else None
            value = None if worst is None else worst["value"]
            over = value is not None and limit is not None and value > limit
            said = [number(value), " ", unit_in(name)]
            rows.append(
                (
                    f"{surface}: {words(name)}",
                    element("span", *said, class_="missed") if over else "".join(said),
                    place(None if worst is None else worst["point"], axes),
                    NONE if limit is None else f"{number(limit)} {unit_in(name)}" + (": exceeded" if over else ""),
                )
            )
    return table("what the reference asks of the actuators, linear", ("figure", "worst", "at", "limit"), rows)


def _proof(proof: Document | None) -> Element:
    said = "Not asked for (`proof=true`)." if proof is None else (proof["reason"] or proof["summary"]["words"])
    lines = [element("p", said)]
    for cell in [] if proof is None else proof["cells"]:
        if cell["counterexample"] is not None:
            at = cell["counterexample"]
            where = ", ".join(
                f"{words(name)} {number(value)} {unit_in(name)}"
                for name, value in at.items()
                if isinstance(value, float)
            )
            lines.append(element("p", f"Refuted in cell {cell['index']}: {where}.", class_="missed"))
    return element("div", element("h3", "Between the grid points"), *lines)


def _worst(
    name: str, values: list[list[float | None]], axes: list[Document], figures: Document | None = None
) -> tuple[str, str]:
    """The worst of a figure over the grid, and where.

    With `figures`, a point that carries gains and has no such figure is worse than any that has: it is said instead.
    """
    flat = [(value, point) for point, value in enumerate(one for row in values for one in row) if value is not None]
    if figures is not None:
        codes = [code for row in figures["outcomes"] for code in row]
        without = sorted({point for point, code in enumerate(codes) if code == "ok"} - {point for _, point in flat})
        if without:
            more = f" and {len(without) - 1} more" if len(without) > 1 else ""
            return figures["null_means"][name], place(without[0], axes) + more
    if not flat:
        return NONE, NONE
    # Downward gain margins are negative, and the one nearest to zero is the worst.
    value, point = (max if name in _LARGEST_IS_WORST | {"gain_margin_down_db"} else min)(flat)
    return f"{number(value)} {unit_in(name)}".rstrip(), place(point, axes)


def _leaves(part: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """Fields of a request that hold no other fields, by their path."""
    if isinstance(part, dict):
        for key, value in part.items():
            yield from _leaves(value, f"{name}.{key}" if name else key)
    elif isinstance(part, list):
        yield (
            name,
            ", ".join(_written(item) for item in part[:_MOST_POINTS]) + (" ..." if len(part) > _MOST_POINTS else ""),
        )
    else:
        yield name, _written(part)


def _written(value: Any) -> str:
    if value is None:
        return NONE
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list):
        return "[" + ", ".join(map(_written, value)) + "]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _span(values: list[list[float | None]], unit: str) -> str:
    flat = [value for row in values for value in row if value is not None]
    return f"{number(min(flat))} ... {number(max(flat))} {unit}".rstrip() if flat else NONE


def _points(points: list[int], axes: list[Document]) -> str:
    """Few points by their places, many by their number."""
    if len(points) > 3:
        return f"{len(points)} points"
    return "; ".join(place(point, axes) for point in points)
