"""The portable certificate of a proof: all that `schedules.verify` needs to check it, as JSON.

================  =======================================================================================
member            holds
================  =======================================================================================
``provenance``    ``design_id``, ``design_name``, ``request_digest`` and ``version`` of the code; null where not known
``axes``          altitude and speed with their breakpoints, names and units
``gains``         the tables that were proved, by name, ``values[i][j]``; null where a point has no gain
``terms``         name and power of the speed coordinate of each of the plant's terms
``monomials``     indices of the gain, or of the two gains, that multiply each of the ``injections``
``plants``        ``[variant][term]`` n by n matrices; ``variants`` names what is off in each
``injections``    ``[variant][monomial]`` n by n matrices
``cells``         proved ones: index of the lower corner, alpha, pieces with box, factors, alpha and P
``table_sha256``  digest of axes and gains, by `schedules.proof.table_proof.table_digest`: which table was proved
``sha256``        digest of the other members, as `document_digest` makes it
================  =======================================================================================

``Acl = sum of terms times plants + sum of monomials times injections``. A term is the power of the speed coordinate
times those ``factors`` of the piece that name it, each anywhere between its two ``ends``.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from model.arrays import FloatArray
from model.flight import GridAxis
from schedules.proof.flight_box import EXPONENTS, Box
from schedules.proof.result import CellStatus, Piece, ScheduleProof
from schedules.proof.table_proof import digest, table_digest, table_members
from schedules.schedule import GainSchedule

FORMAT = "gainfield-proof"
#: Version of the layout; raised when a reader of the old one would misread the new.
CERTIFICATE_VERSION = 2
_STATEMENT = (
    "for every course of altitude and speed inside a piece, however fast, x' P x of the closed loop x' = Acl x decays "
    "at least like exp(-2 alpha t), with gains multilinear between the grid points"
)


@dataclass(frozen=True)
class Origin:
    """Where the table of a certificate comes from, as far as it is known.

    Attributes
    ----------
    design_id, design_name : of the design; None where it is of no stored one
    request_digest : SHA-256 of the request: for the design, or for the proof of a table that was sent; None of neither
    version : of the code that proved; None where nobody said
    """

    design_id: str | None = None
    design_name: str | None = None
    request_digest: str | None = None
    version: str | None = None


#: Of a table that was made and proved without a service.
UNKNOWN = Origin()


@dataclass(frozen=True, eq=False)
class ProvedCell:
    """A cell of a certificate: index of its lower corner, the rate proved in all of it [1/s], and its pieces."""

    index: tuple[int, int]
    alpha: float
    pieces: tuple[Piece, ...]


@dataclass(frozen=True, eq=False)
class Certificate:
    """What a certificate says, read back.

    Attributes
    ----------
    controller : name
    origin : the design it is of, and the code
    table_digest : of the axes and the gains
    axes : of the grid
    gains : (nh, ns) tables by name, nan where a point has no gain
    covers : which plants, in words
    cells : those that are proved
    of : number of cells of the grid
    alpha : least rate of the proved cells [1/s]
    """

    controller: str
    origin: Origin
    table_digest: str
    axes: tuple[GridAxis, GridAxis]
    gains: dict[str, FloatArray]
    covers: str
    cells: tuple[ProvedCell, ...]
    of: int
    alpha: float

    def differs(self, schedule: GainSchedule) -> str | None:
        """Where a schedule is not the one that was proved, in words; None where it is, to the last bit."""
        rules = schedule.rules
        if rules.interpolation != "multilinear" or rules.integrator_placement != "before_gain":
            return "it is not multilinear with integrators before their gains"
        if schedule.axes != self.axes:
            return "the breakpoints are others"
        tables = {gain.name: gain.values for gain in schedule.gains}
        for name, values in self.gains.items():
            if name not in tables:
                return f"the schedule has no gain {name}"
            if not np.array_equal(tables[name], values, equal_nan=True):
                return f"{name} has other values"
        return None


def to_document(proof: ScheduleProof, origin: Origin = UNKNOWN) -> dict[str, Any]:
    """The certificate of a proof, ready for `json.dumps`.

    Parameters
    ----------
    origin : where the table comes from

    Raises
    ------
    ValueError : nothing was proved
    """
    made, proved = proof.family, [cell for cell in proof.cells if cell.status is CellStatus.PROVED]
    if made is None or not proved:
        raise ValueError(f"controller {proof.controller}: no cell is proved, there is nothing to certify")
    axes, gains = table_members(proof.axes, {name: made.tables[..., k] for k, name in enumerate(made.gains)})
    exponents, corners = EXPONENTS[proof.flight.speed_axis], made.variants.corners
    document: dict[str, Any] = {
        "format": FORMAT,
        "certificate_version": CERTIFICATE_VERSION,
        "statement": _STATEMENT,
        "controller": proof.controller,
        "provenance": asdict(origin),
        "covers": proof.covers,
        "axes": axes,
        "gains": gains,
        "table_sha256": digest([axes, gains]),
        "terms": [[name, exponents[name]] for name in made.terms],
        "monomials": [list(monomial) for monomial in made.monomials],
        "variants": {
            "parameters": list(made.variants.parameters),
            "factors": made.variants.factors[corners].tolist(),
        },
        "plants": made.plants[corners].tolist(),
        "injections": made.injections[corners].tolist(),
        "cells": [
            {
                "index": list(cell.index),
                "alpha": cell.alpha,
                "pieces": [_piece(proof, piece) for piece in cell.pieces],
            }
            for cell in proved
        ],
        "proved": len(proved),
        "of": len(proof.cells),
        "alpha": min(cell.alpha for cell in proved),
    }
    return {**document, "sha256": document_digest(document)}


def document_digest(document: dict[str, Any]) -> str:
    """Digest of all members but ``sha256``."""
    return digest({name: value for name, value in document.items() if name != "sha256"})


def from_document(document: dict[str, Any]) -> Certificate:
    """Read a certificate back. What it claims is not checked here: `schedules.verify.verify` does that.

    Raises
    ------
    ValueError : not a certificate of a known version, a changed one, or parts that do not fit together
    """
    if document.get("format") != FORMAT or document.get("certificate_version") != CERTIFICATE_VERSION:
        raise ValueError(f"not a {FORMAT} of version {CERTIFICATE_VERSION}")
    if document.get("sha256") != document_digest(document):
        raise ValueError("the certificate was changed: its digest is another")
    try:
        axes = tuple(GridAxis(item["name"], item["unit"], tuple(item["values"])) for item in document["axes"])
        gains = {item["name"]: np.array(item["values"], dtype=float) for item in document["gains"]}
        cells = tuple(_cell(item) for item in document["cells"])
        altitude, speed = axes
        if any(values.shape != (len(altitude.values), len(speed.values)) for values in gains.values()):
            raise ValueError("the gains are not of the grid's shape")
        if table_digest(axes, gains) != document["table_sha256"]:
            raise ValueError("the certificate is of another table: its table_sha256 is not that of its axes and gains")
        return Certificate(
            document["controller"],
            Origin(**document["provenance"]),
            document["table_sha256"],
            (altitude, speed),
            gains,
            document["covers"],
            cells,
            document["of"],
            document["alpha"],
        )
    except (KeyError, TypeError) as wrong:
        raise ValueError(f"not a certificate: {wrong!r}") from None


def _piece(proof: ScheduleProof, piece: Piece) -> dict[str, Any]:
    assert proof.family is not None
    factors = proof.flight.factors(piece.box, proof.family.terms)
    return {
        "box": [list(piece.box.altitude), list(piece.box.speed)],
        "factors": [{"terms": list(factor.terms), "ends": [factor.low, factor.high]} for factor in factors],
        "alpha": piece.alpha,
        "margin": piece.margin,
        "P": piece.P.tolist(),
    }


def _cell(item: dict[str, Any]) -> ProvedCell:
    row, column = item["index"]
    return ProvedCell((row, column), item["alpha"], tuple(_read_piece(piece) for piece in item["pieces"]))


def _read_piece(item: dict[str, Any]) -> Piece:
    (low, high), (slow, fast) = item["box"]
    return Piece(Box((low, high), (slow, fast)), item["alpha"], np.array(item["P"], dtype=float), item["margin"])
