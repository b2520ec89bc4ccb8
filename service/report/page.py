"""The page: a heading, the inputs, the envelope, a section for each controller, and where it all comes from."""

from __future__ import annotations

from typing import Any

from service.report.html import document, element
from service.report.sections import controller, envelope, inputs

Document = dict[str, Any]

STYLE = """
:root { color-scheme: light; }
body { font: 10pt/1.4 system-ui, sans-serif; color: #1a1d21; background: #fff; margin: 0; }
main { max-width: 60rem; margin: 0 auto; padding: 1.5rem; }
h1 { font-size: 1.5rem; margin: 0 0 .25rem; }
h2 { font-size: 1.1rem; border-bottom: 1px solid #7b8189; margin: 1.75rem 0 .75rem; }
h3 { font-size: 1rem; margin: 1rem 0 .25rem; }
table { border-collapse: collapse; margin: .75rem 0; width: 100%; font-variant-numeric: tabular-nums; }
caption { text-align: left; font-weight: 600; padding: .2rem 0; }
th, td { text-align: left; vertical-align: top; padding: .12rem .6rem .12rem 0; border-bottom: 1px solid #d8dbdf; }
tbody th { font-weight: normal; }
.columns { columns: 2; column-gap: 2rem; }
.columns table { break-inside: avoid; }
.charts { display: grid; grid-template-columns: repeat(auto-fill, minmax(15rem, 1fr)); gap: .5rem 1rem; }
figure { margin: 0; break-inside: avoid; }
figcaption { text-align: center; font-size: .85rem; }
.line { fill: none; stroke: #0b4f8a; stroke-width: 1.2; }
.chart circle { fill: #0b4f8a; }
.frame path { fill: none; stroke: #7b8189; stroke-width: .6; }
.frame text { font-size: 8px; fill: #454b52; }
.met { color: #14532d; }
.missed { color: #9b1c1c; font-weight: 600; }
.small { font-size: .85rem; color: #454b52; overflow-wrap: anywhere; }
@media print { main { max-width: none; padding: 0; } h2 { break-after: avoid; } tr { break-inside: avoid; } }
"""


def report_page(
    design: Document, figures: dict[str, Document], demands: dict[str, Document], proofs: dict[str, Document] | None
) -> bytes:
    """The report of a design, the same bytes for the same documents.

    Parameters
    ----------
    design : as ``GET /v1/designs/{id}`` answers it
    figures, demands : of each controller, by name, as ``figures`` and ``actuator-requirements`` answer them
    proofs : of each controller, by name, as ``verification`` answers them; None: not asked for
    """
    made = design["provenance"]
    sections = [
        controller(
            design,
            wanted,
            figures[wanted["name"]],
            demands[wanted["name"]],
            None if proofs is None else proofs[wanted["name"]],
        )
        for wanted in design["controllers"]
    ]
    return document(
        f"{design['name']}: gain schedule report",
        STYLE,
        element("h1", design["name"]),
        element("p", f"Gain-scheduled design made {made['created_at']} by Gainfield {made['version']}."),
        envelope(design),
        *sections,
        inputs(design["request"]),
        element(
            "section",
            element("h2", "Provenance"),
            element("p", f"Design {design['id']}; code {made['version']}; {made['solver']}.", class_="small"),
            element(
                "p",
                "Deflections are positive trailing edge up, the tab's angle is relative to the aileron. "
                "Gains are in SI and radians, with u = -K x.",
                class_="small",
            ),
        ),
    )
