"""The certificate: checked by a program that knows nothing of the product, and refused when anything is changed."""

import contextlib
import copy
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from schedules.perturbations import Uncertainty
from schedules.proof.certificate import Origin, document_digest, from_document, to_document
from schedules.proof.prove import ProofRequest, prove
from schedules.proof.table_proof import digest
from schedules.schedule import GainSchedule, Provenance
from schedules.study import GridRequest
from schedules.verify import verify

ROOT = Path(__file__).parents[3]
ORIGIN = Origin(design_id="d-1", design_name="tunnel", request_digest="0f" * 32, version="0.1.0")


@pytest.fixture(scope="session")
def proofs(example_a):
    study, envelope = example_a
    return {name: prove(study, envelope.plant, envelope.controller(name)) for name in ("nf", "pf", "lqr")}


@pytest.fixture
def documents(proofs):
    """Fresh copies, as they come out of a file."""
    return {name: json.loads(json.dumps(to_document(proof, ORIGIN), allow_nan=False)) for name, proof in proofs.items()}


def resealed(document):
    """With the digests that the changed document should have: what someone who means it would do."""
    changed = {**document, "table_sha256": digest([document["axes"], document["gains"]])}
    return {**changed, "sha256": document_digest(changed)}


@pytest.mark.parametrize("name", ["nf", "pf", "lqr"])
def test_a_certificate_holds(documents, name):
    assert verify(documents[name]).startswith("proved: 3 of 3 cells")


def test_certificates_of_other_grids_and_plants_hold(envelope_of, only_lqr, airliner, example_a):
    for speed in (("airspeed", (20.0, 45.0)), ("mach", (0.06, 0.14))):
        study, envelope = envelope_of(grid=GridRequest((0.0, 3000.0), *speed), controllers=only_lqr)
        assert verify(to_document(prove(study, envelope.plant, envelope.controllers[0]), ORIGIN)).startswith(
            "proved: 1 of 1"
        )
    study, envelope = airliner
    assert verify(to_document(prove(study, envelope.plant, envelope.controllers[0]), ORIGIN)).startswith(
        "proved: 4 of 4"
    )
    study, envelope = example_a
    request = ProofRequest(changes=(Uncertainty("C_Ha_da", 0.2), Uncertainty("aileron_inertia", 0.2)), together=True)
    document = to_document(prove(study, envelope.plant, envelope.controller("lqr"), request), ORIGIN)
    assert len(document["plants"]) == 4
    assert verify(document).startswith("proved: 3 of 3")


def test_one_breakpoint_an_axis_can_be_certified(envelope_of, only_lqr):
    study, envelope = envelope_of(grid=GridRequest((100.0,), "dynamic_pressure", (600.0,)), controllers=only_lqr)
    assert verify(to_document(prove(study, envelope.plant, envelope.controllers[0]), ORIGIN)).startswith(
        "proved: 1 of 1"
    )


def test_products_of_gains_can_be_certified(wind_tunnel_study, wind_tunnel_envelope, with_gains, envelope_of):
    from dataclasses import replace

    gains = {"K_theta": 200.0, "K_d": 0.02, "K_p": 0.6, "K_i": 15.0}
    nf = replace(wind_tunnel_study.controllers[0], tab_command="rate", specs=(), gains=gains)
    study, envelope = envelope_of(controllers=(nf,))
    varied = {k: v * np.linspace(0.8, 1.2, 8).reshape(2, 4) for k, v in gains.items()}
    designed = with_gains(study, envelope, envelope.controllers[0], varied)
    proof = prove(study, envelope.plant, designed, ProofRequest(fraction=0.3))
    assert proof.proved, proof.summary.words
    assert proof.family.gain_degree == 2
    document = to_document(proof, ORIGIN)
    assert verify(document).startswith("proved: 3 of 3")
    document["gains"][0]["values"][0][0] *= 2.0
    with pytest.raises(ValueError, match="what its matrix proves"):
        verify(resealed(document))


def beyond_the_grid(document):
    """A cell is replaced by one of no width, at the last breakpoint, which hardly says anything."""
    axis, (whole, *_) = document["axes"][1]["values"], document["cells"][-1]["pieces"]
    box = [whole["box"][0], [axis[-1], axis[-1]]]
    document["cells"][1] = {**document["cells"][-1], "index": [0, len(axis) - 1], "pieces": [{**whole, "box": box}]}


MUTATIONS = {
    "gain": lambda d: d["gains"][2]["values"][0].__setitem__(1, d["gains"][2]["values"][0][1] * 1.5),
    "gain of the last point": lambda d: d["gains"][1]["values"][1].__setitem__(3, -d["gains"][1]["values"][1][3]),
    "sign of a gain": lambda d: d["gains"][0]["values"][1].__setitem__(1, -d["gains"][0]["values"][1][1]),
    "alpha of a piece": lambda d: d["cells"][1]["pieces"][0].__setitem__(
        "alpha", 1.05 * d["cells"][1]["pieces"][0]["alpha"]
    ),
    "alpha of a cell": lambda d: d["cells"][1].__setitem__("alpha", 1.5 * d["cells"][1]["alpha"]),
    "alpha of all": lambda d: d.__setitem__("alpha", 1.0001 * d["alpha"]),
    "P, one entry": lambda d: d["cells"][0]["pieces"][0]["P"][2].__setitem__(
        2, 1.3 * d["cells"][0]["pieces"][0]["P"][2][2]
    ),
    "P, not positive": lambda d: d["cells"][0]["pieces"][0]["P"][0].__setitem__(0, -1.0),
    "P of another cell": lambda d: d["cells"][0]["pieces"][0].__setitem__("P", d["cells"][2]["pieces"][0]["P"]),
    "a piece left out": lambda d: d["cells"][0]["pieces"].pop(),
    "all pieces left out": lambda d: d["cells"][0]["pieces"].clear(),
    "a box made smaller": lambda d: d["cells"][0]["pieces"][0]["box"][1].__setitem__(0, 250.0),
    "a box made lower": lambda d: d["cells"][0]["pieces"][0]["box"][0].__setitem__(1, 2999.0),
    "a cell left out": lambda d: d["cells"].pop(),
    "a cell twice, another left out": lambda d: d["cells"].__setitem__(1, d["cells"][0]),
    "a cell beyond the grid": lambda d: beyond_the_grid(d),
    "number of cells": lambda d: d.__setitem__("of", 2),
    "a breakpoint": lambda d: d["axes"][1]["values"].__setitem__(0, 200.0),
    "a plant": lambda d: d["plants"][0][1][3].__setitem__(2, -d["plants"][0][1][3][2]),
    "an injection": lambda d: d["injections"][0][0].__setitem__(0, [3e4] * len(d["injections"][0][0])),
    "the power of a term": lambda d: d["terms"][1].__setitem__(1, 2.0),
    "which gain": lambda d: d["monomials"].reverse(),
    "an interval of the air": lambda d: d["cells"][0]["pieces"][0]["factors"][1].__setitem__("ends", [0.5, 3.0]),
    "a gain left out": lambda d: d["gains"][0]["values"][0].__setitem__(0, None),
}


@pytest.mark.parametrize("kind", MUTATIONS)
def test_a_changed_certificate_is_refused_with_its_old_digest(documents, kind):
    document = documents["nf"]
    MUTATIONS[kind](document)
    with pytest.raises(ValueError, match="digest"):
        verify(document)
    with pytest.raises(ValueError, match="digest"):
        from_document(document)


@pytest.mark.parametrize("kind", MUTATIONS)
def test_a_changed_certificate_is_refused_with_a_digest_of_its_own(documents, kind):
    """The mathematics refuses it too: no number of the document can be changed for the worse."""
    document = documents["nf"]
    MUTATIONS[kind](document)
    with pytest.raises((ValueError, IndexError, np.linalg.LinAlgError)):
        verify(resealed(document))


@pytest.mark.parametrize("name", ["nf", "pf", "lqr"])
def test_it_is_of_one_table_only(documents, name):
    """Asked about another table, verifier and reader refuse it; a digest that is not the table's own is refused too."""
    document, others = documents[name], [d for other, d in documents.items() if other != name]
    assert verify(document, document["table_sha256"]).startswith("proved: 3 of 3")
    for other in others:
        with pytest.raises(ValueError, match="of another table"):
            verify(document, other["table_sha256"])
    claimed = {**document, "table_sha256": others[0]["table_sha256"]}
    claimed["sha256"] = document_digest(claimed)
    with pytest.raises(ValueError, match="of another table"):
        verify(claimed)
    with pytest.raises(ValueError, match="of another table"):
        from_document(claimed)
    assert from_document(document).origin == ORIGIN


@pytest.mark.parametrize("name", ["nf", "pf", "lqr"])
def test_any_gain_changed_beyond_the_slack_is_refused(documents, name):
    """Each in turn, until its own loop is no longer proved: sooner or later the check must notice."""
    for k in range(len(documents[name]["gains"])):
        refused = False
        for factor in (1.5, -2.0, 30.0, -30.0, 1e3, -1e3):
            document = copy.deepcopy(documents[name])
            document["gains"][k]["values"][0][0] *= factor
            with contextlib.suppress(ValueError):
                verify(resealed(document))
                continue
            refused = True
        assert refused, document["gains"][k]["name"]


def test_the_least_change_for_the_worse_is_noticed(documents):
    """alpha is what P proves, less rounding: a millionth more is too much."""
    for name, document in documents.items():
        changed = copy.deepcopy(document)
        for cell in changed["cells"]:
            for piece in cell["pieces"]:
                piece["alpha"] *= 1.0 + 1e-6
        with pytest.raises(ValueError, match="what its matrix proves"):
            verify(resealed(changed))
        assert verify(resealed(document)), name


def test_it_reads_back(proofs, documents):
    for name, document in documents.items():
        proof, found = proofs[name], from_document(document)
        assert found.axes == proof.axes
        assert (found.of, found.alpha, found.covers) == (3, proof.summary.alpha, proof.covers)
        for cell, read in zip(proof.cells, found.cells, strict=True):
            assert read.index == cell.index
            for piece, again in zip(cell.pieces, read.pieces, strict=True):
                assert (again.box, again.alpha, again.margin) == (piece.box, piece.alpha, piece.margin)
                assert again.P.tobytes() == piece.P.tobytes()


def test_it_says_whether_a_schedule_is_the_one_that_was_proved(example_a, documents):
    _, envelope = example_a
    designed = envelope.controller("nf")
    origin = Provenance(design_id="", design_name="", request_digest="", version="", created_at="")
    schedule = GainSchedule(
        "nf", "negative_feedback", envelope.plant.grid.axes, designed.gains, designed.outcomes, "", origin
    )
    found = from_document(documents["nf"])
    assert found.differs(schedule) is None
    from dataclasses import replace

    gain = designed.gains[1]
    other = replace(gain, values=gain.values * (1.0 + 1e-15))
    assert "K_p" in found.differs(replace(schedule, gains=(designed.gains[0], other, designed.gains[2])))
    assert "no gain" in found.differs(replace(schedule, gains=designed.gains[:2]))
    axes = (envelope.plant.grid.axes[0], replace(envelope.plant.grid.axes[1], values=(245.0, 551.25, 980.0, 1531.0)))
    assert "breakpoints" in found.differs(replace(schedule, axes=axes))


def test_nothing_proved_is_nothing_to_certify(example_a):
    study, envelope = example_a
    proof = prove(study, envelope.plant, envelope.controller("lqr"), ProofRequest(decay=50.0))
    with pytest.raises(ValueError, match="nothing to certify"):
        to_document(proof, ORIGIN)


def test_what_is_not_a_certificate_is_refused(documents):
    with pytest.raises(ValueError, match="not a gainfield-proof"):
        from_document({"format": "other"})
    document = documents["nf"]
    del document["cells"]
    with pytest.raises(ValueError, match="not a certificate"):
        from_document(resealed(document))


@pytest.mark.parametrize("case", ["good", "good and asked", "changed", "another table", "not one", "no file"])
def test_the_command(documents, tmp_path, case):
    document, good = documents["lqr"], case.startswith("good")
    if case == "changed":
        document["alpha"] = 100.0
    asked = {"good and asked": [document["table_sha256"]], "another table": [documents["nf"]["table_sha256"]]}
    path = tmp_path / "proof.json"
    if case != "no file":
        path.write_text(json.dumps({} if case == "not one" else document))
    command = [sys.executable, "-m", "schedules.verify", str(path), *asked.get(case, [])]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.returncode == 0) == good
    assert ("proved: 3 of 3" in done.stdout) == good
    assert ("refused" in done.stderr) == (not good)


def test_the_verifier_is_small():
    """Small enough to be read by whoever is to trust it."""
    source = (ROOT / "schedules" / "verify.py").read_text()
    assert len(source.splitlines()) < 60
    assert {line for line in source.splitlines() if line.startswith(("import", "from"))} == {
        "import hashlib", "import json", "import sys", "from typing import Any", "import numpy as np",
    }  # fmt: skip


def test_the_verifier_imports_nothing_of_the_product():
    code = (
        "import sys, schedules.verify; print({m.split('.')[0] for m in sys.modules} & {'model', 'design', 'service'})"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
