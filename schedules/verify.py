"""Check a proof's certificate, its plant and air taken as given: ``python -m schedules.verify FILE [TABLE_SHA256]``."""

import hashlib
import json
import sys
from typing import Any

import numpy as np

BERNSTEIN = np.array([[1.0, 0.0, 0.0], [-0.5, 2.0, -0.5], [0.0, 0.0, 1.0]])  # coefficients of values at ends and middle


def verify(document: dict[str, Any], table: str | None = None) -> str:
    """What is proved, of the table with this digest, in one line; a ValueError says what does not hold."""
    sealed = {name: document[name] for name in document if name != "sha256"}, [document["axes"], document["gains"]]
    digests = tuple(hashlib.sha256(json.dumps(part, sort_keys=True).encode()).hexdigest() for part in sealed)
    if digests != (document["sha256"], table or document["table_sha256"]):
        raise ValueError("the certificate was changed, or is of another table: its digest is another")
    axes, cells = [np.array(axis["values"]) for axis in document["axes"]], document["cells"]
    for cell in cells:
        corner = [[k, min(k + 1, len(axis) - 1)] for axis, k in zip(axes, cell["index"], strict=True)]
        ends, boxes = [x[at] for x, at in zip(axes, corner, strict=True)], np.array([p["box"] for p in cell["pieces"]])
        lines = map(np.unique, map(np.append, boxes.swapaxes(0, 1), ends))
        points = np.meshgrid(*(np.add.outer(x, x) / 2.0 for x in lines))  # on the lines of the pieces and between them
        inside = [[(x >= low) & (x <= high) for x, (low, high) in zip(points, box, strict=True)] for box in boxes]
        gains = np.array([gain["values"] for gain in document["gains"]], dtype=float)[:, *np.ix_(*corner)]
        slack = [proved_rate(document, gains, ends, p) - max(p["alpha"], cell["alpha"], 0.0) for p in cell["pieces"]]
        if not (np.all(np.any(np.all(inside, axis=1), axis=0)) and min(slack) >= 0.0):
            raise ValueError(f"cell {cell['index']}: no piece covers it all, or less is what its matrix proves")
    whole, found = {*np.ndindex(*(len(axis) - 1 or 1 for axis in axes))}, {tuple(cell["index"]) for cell in cells}
    said = tuple(document[name] for name in ("proved", "of", "alpha"))
    if not found <= whole or said != (len(found), len(whole), min(cell["alpha"] for cell in cells)):
        raise ValueError("cells are missing, or decay slower than the certificate says")
    return "proved: {} of {} cells, decay at {:.6g} 1/s or faster".format(*said)


def proved_rate(document: dict[str, Any], gains: np.ndarray, ends: list[np.ndarray], piece: dict[str, Any]) -> float:
    """Rate [1/s] that a piece's matrix proves of all its loops, less the rounding; gains (g, 2, 2) at the corners."""
    weights, (h, s) = [], (np.linspace(low, high, 3) for low, high in piece["box"])
    u, v = ((x - low) / ((high - low) or 1.0) for x, (low, high) in zip((h, s), ends, strict=True))
    read = np.stack([1.0 - u, u], axis=1) @ gains @ np.stack([1.0 - v, v])
    root = np.interp(s, s[::2], np.sqrt(s[::2])), 0.5 * ((m := np.sqrt(np.sqrt(s[0] * s[2]))) + s / m)  # chord, tangent
    for choice in np.ndindex((2,) * len(piece["factors"])):
        for name, n in document["terms"]:
            own = [(f["ends"][k], k) for f, k in zip(piece["factors"], choice, strict=True) if name in f["terms"]]
            weights.append([BERNSTEIN @ (root[own[0][1]] if n == 0.5 else s**n) * np.prod([e for e, _ in own])] * 3)
        weights.extend(BERNSTEIN @ np.array([np.prod(read[m], axis=0) for m in document["monomials"]]) @ BERNSTEIN.T)
    every, L = np.reshape(weights, (2 ** len(piece["factors"]), -1, 9)), np.linalg.cholesky(np.array(piece["P"]))
    parts, R = np.concatenate([document["plants"], document["injections"]], axis=1), np.linalg.inv(L).T
    each = (L.T, every, parts, R), map(np.abs, (L.T, every, parts, R))
    A, sizes = (left @ np.einsum("cpk,wpab->wckab", c, p) @ right for left, c, p, right in each)
    units = 2.0 * np.finfo(float).eps * (3 * len(L) + every.shape[1] + 8) * np.max(np.abs(L.T) @ np.abs(R).sum(axis=1))
    return float(np.min(-np.linalg.eigvalsh(0.5 * (A + A.mT))[..., -1] - units * np.linalg.norm(sizes, axis=(-2, -1))))


if __name__ == "__main__":
    sys.excepthook = lambda kind, wrong, _: print(f"refused: {kind.__name__}: {wrong}", file=sys.stderr)
    with open(sys.argv[1], encoding="utf-8") as file:
        print(verify(json.load(file), *sys.argv[2:]))
