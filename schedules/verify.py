"""Check a proof's certificate, its plant and air taken as given: ``python -m schedules.verify FILE`` (numpy only)."""

import hashlib
import json
import sys
from typing import Any

import numpy as np

NODES, BERNSTEIN = np.array([0.0, 0.5, 1.0]), np.array([[1.0, 0.0, 0.0], [-0.5, 2.0, -0.5], [0.0, 0.0, 1.0]])


def verify(document: dict[str, Any]) -> str:
    """What is proved, in one line; a ValueError says what does not hold."""
    rest = json.dumps({name: document[name] for name in document if name != "sha256"}, sort_keys=True)
    if hashlib.sha256(rest.encode()).hexdigest() != document["sha256"]:
        raise ValueError("the certificate was changed: its digest is another")
    axes, cells = [np.array(axis["values"]) for axis in document["axes"]], document["cells"]
    for cell in cells:
        corner = [[k, min(k + 1, len(axis) - 1)] for axis, k in zip(axes, cell["index"], strict=True)]
        ends, boxes = [x[at] for x, at in zip(axes, corner, strict=True)], np.array([p["box"] for p in cell["pieces"]])
        lines = [np.unique([*boxes.reshape(-1, 2, 2)[:, k].ravel(), *ends[k]]) for k in (0, 1)]
        middles = np.meshgrid(*(0.5 * (x[1:] + x[:-1]) if len(x) > 1 else x for x in lines))
        inside = [[(x >= low) & (x <= high) for x, (low, high) in zip(middles, box, strict=True)] for box in boxes]
        if not np.all(np.any(np.all(inside, axis=1), axis=0)):
            raise ValueError(f"cell {cell['index']}: its pieces do not cover it")
        gains = np.array([gain["values"] for gain in document["gains"]], dtype=float)[:, *np.ix_(*corner)]
        for piece in cell["pieces"]:
            if not (rate := proved_rate(document, gains, ends, piece)) >= max(piece["alpha"], cell["alpha"], 0.0):
                raise ValueError(f"cell {cell['index']}, {piece['box']}: {rate:.9g} 1/s is what its matrix proves")
    found = len({tuple(cell["index"]) for cell in cells if min(cell["index"]) >= 0}), min(c["alpha"] for c in cells)
    if found != (document["proved"], document["alpha"]):
        raise ValueError("cells are missing, or decay slower than the certificate says")
    return f"proved: {found[0]} of {document['of']} cells, decay at {found[1]:.6g} 1/s or faster"


def proved_rate(document: dict[str, Any], gains: np.ndarray, ends: list[np.ndarray], piece: dict[str, Any]) -> float:
    """Rate [1/s] that a piece's matrix proves of all its loops, less the rounding; gains (g, 2, 2) at the corners."""
    h, s = (low + NODES * (high - low) for low, high in piece["box"])
    u, v = ((x - low) / ((high - low) or 1.0) for x, (low, high) in zip((h, s), ends, strict=True))
    read = np.stack([1.0 - u, u], axis=1) @ gains @ np.stack([1.0 - v, v])
    products = BERNSTEIN @ np.array([np.prod(read[m], axis=0) for m in document["monomials"]]) @ BERNSTEIN.T
    tangent = 0.5 * ((middle := np.sqrt(np.sqrt(s[0] * s[2]))) + s / middle)  # of the square root, which lies below
    roots, weights = (np.sqrt(s[0]) * (1.0 - NODES) + np.sqrt(s[2]) * NODES, tangent), []  # and above its chord
    for choice in np.ndindex((2,) * len(piece["factors"])):
        for name, exponent in document["terms"]:
            own = [(f["ends"][k], k) for f, k in zip(piece["factors"], choice, strict=True) if name in f["terms"]]
            power = BERNSTEIN @ (roots[own[0][1] if own else 0] if exponent == 0.5 else s**exponent)
            weights.append(power * np.prod([end for end, _ in own]) * np.ones((3, 1)))
        weights.extend(products)
    every, L = np.reshape(weights, (2 ** len(piece["factors"]), -1, 9)), np.linalg.cholesky(np.array(piece["P"]))
    parts, R = np.concatenate([np.array(document[m]) for m in ("plants", "injections")], axis=1), np.linalg.inv(L).T
    A, sizes = (np.einsum("cpk,wpab->wckab", *both) for both in ((every, parts), (np.abs(every), np.abs(parts))))
    rates = -np.linalg.eigvalsh(0.5 * (L.T @ A @ R + np.swapaxes(L.T @ A @ R, -1, -2)))[..., -1]
    units = 2.0 * np.finfo(float).eps * (3 * len(L) + every.shape[1] + 8) * np.max(np.abs(L.T) @ np.abs(R).sum(axis=1))
    return float(np.min(rates - units * np.linalg.norm(np.abs(L.T) @ sizes @ np.abs(R), axis=(-2, -1))))


if __name__ == "__main__":
    with open(sys.argv[1], encoding="utf-8") as file:
        try:
            print(verify(json.load(file)))
        except (ValueError, KeyError, TypeError, IndexError) as wrong:
            sys.exit(f"refused: {wrong}")
