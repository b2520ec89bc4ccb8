"""The DAVE-ML document: its structure by the content models of the DTD, its numbers by an evaluator of the subset."""

import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from schedules.files import write_schedule
from schedules.files.dave_ml_file import dave_unit
from schedules.fill import filled
from schedules.interpolate import interpolate
from tests.schedules.hostile_schedules import NAMES, TEXT, hostile, points_around

NS = "{http://daveml.org/2010/DAVEML}"

#: Element: its children in order, as a pattern over their names; and its attributes, those with ! are required.
MODELS = {
    "DAVEfunc": (
        "(fileHeader )(variableDef )+(breakpointDef )*(griddedTableDef )*(ungriddedTableDef )*(function )*"
        "(checkData )?",
        "",
    ),
    "fileHeader": (
        "(author )+(creationDate )(fileVersion )?(description )?(reference )*(modificationRecord )*(provenance )*",
        "name",
    ),
    "author": ("", "name! org! email"),
    "creationDate": ("", "date!"),
    "description": ("", ""),
    "variableDef": (
        "(description )?(provenance )?(calculation )?(isInput |isControl |isDisturbance )?(isState )?(isStateDeriv )?"
        "(isOutput )?(isStdAIAA )?(uncertainty )?",
        "name! varID! units! axisSystem sign alias symbol initialValue minValue maxValue",
    ),
    "isInput": ("", ""),
    "isOutput": ("", ""),
    "breakpointDef": ("(description )?(bpVals )", "bpID! name units"),
    "bpVals": ("", ""),
    "griddedTableDef": (
        "(description )?(provenance )?(breakpointRefs )(uncertainty )?(dataTable )", "gtID! name units"
    ),
    "breakpointRefs": ("(bpRef )+", ""),
    "bpRef": ("", "bpID!"),
    "dataTable": ("", ""),
    "function": ("(description )?(provenance )?(independentVarRef )+(dependentVarRef )(functionDefn )", "name!"),
    "independentVarRef": ("", "varID! min max extrapolate interpolate"),
    "dependentVarRef": ("", "varID!"),
    "functionDefn": ("(griddedTableRef )", "name"),
    "griddedTableRef": ("", "gtID!"),
    "checkData": ("(staticShot )+", ""),
    "staticShot": ("(description )?(provenance )?(checkInputs )?(internalValues )?(checkOutputs )", "name! refID"),
    "checkInputs": ("(signal )+", ""),
    "checkOutputs": ("(signal )+", ""),
    "signal": ("(signalName )(signalUnits )(signalValue )(tol )?", ""),
    "signalName": ("", ""),
    "signalUnits": ("", ""),
    "signalValue": ("", ""),
    "tol": ("", ""),
}  # fmt: skip
#: Elements that may hold text.
TEXTS = {"description", "bpVals", "dataTable", "signalName", "signalUnits", "signalValue", "tol"}


def tag(element):
    assert element.tag.startswith(NS)
    return element.tag.removeprefix(NS)


def validate(root):
    """Assert what the DTD says, and what it cannot say: identifiers once, references that lead somewhere, counts."""
    seen = []
    for element in root.iter():
        children, attributes = MODELS[tag(element)]
        assert re.fullmatch(children, "".join(f"{tag(child)} " for child in element)), (tag(element), list(element))
        allowed = attributes.replace("!", "").split()
        assert set(element.attrib) <= set(allowed), element.attrib
        assert {name[:-1] for name in attributes.split() if name.endswith("!")} <= set(element.attrib)
        assert tag(element) in TEXTS or not (element.text or "").strip()
        assert not (element.tail or "").strip()
        kind = {"variableDef": "varID", "breakpointDef": "bpID", "griddedTableDef": "gtID"}.get(tag(element))
        seen += [element.get(kind)] if kind else []
    assert len(set(seen)) == len(seen)
    for name in seen:
        assert re.fullmatch(r"[A-Za-z_][\w.-]*", name)
        assert not name.lower().startswith("xml")
    for reference, kind in (("independentVarRef", "varID"), ("dependentVarRef", "varID"), ("bpRef", "bpID")):
        for element in root.iter(NS + reference):
            assert element.get(kind) in seen
    document = Document(root)
    for table, values in document.tables.items():
        assert values.size == np.prod([document.points[bp].size for bp in document.breakpoints[table]])
    for signal in root.iter(NS + "signal"):
        name, unit = signal.findtext(NS + "signalName"), signal.findtext(NS + "signalUnits")
        assert root.find(f"{NS}variableDef[@name='{name}']").get("units") == unit
    for output in root.iter(NS + "checkOutputs"):
        assert all(signal.find(NS + "tol") is not None for signal in output)


def numbers(text):
    return np.array([float(word) for word in re.split(r"[,\s]+", text.strip())])


class Document:
    """What an evaluator needs of the document."""

    def __init__(self, root):
        self.points = {e.get("bpID"): numbers(e.findtext(NS + "bpVals")) for e in root.iter(NS + "breakpointDef")}
        gridded = list(root.iter(NS + "griddedTableDef"))
        self.breakpoints = {e.get("gtID"): [r.get("bpID") for r in e.iter(NS + "bpRef")] for e in gridded}
        self.tables = {e.get("gtID"): numbers(e.findtext(NS + "dataTable")) for e in gridded}
        self.functions = list(root.iter(NS + "function"))

    def evaluate(self, inputs):
        """Outputs by varID at inputs by varID: linear along one axis after the other, the end value held."""
        outputs = {}
        for function in self.functions:
            (reference,) = function.iter(NS + "griddedTableRef")
            table = reference.get("gtID")
            points = [self.points[bp] for bp in self.breakpoints[table]]
            values = self.tables[table].reshape([x.size for x in points])
            names = [e.get("varID") for e in function.iter(NS + "independentVarRef")]
            assert len(names) == values.ndim
            for name, x in zip(names, points, strict=True):
                flat = values.reshape(x.size, -1).T
                rest = values.shape[1:]
                values = np.array([np.interp(inputs[name], x, row) for row in flat]).reshape(rest)
            outputs[function.find(NS + "dependentVarRef").get("varID")] = float(values)
        return outputs


def run_checks(root):
    """Number of static shots; asserts that each is met within its tolerances."""
    document = Document(root)
    variables = {e.get("name"): e.get("varID") for e in root.iter(NS + "variableDef")}
    shots = list(root.iter(NS + "staticShot"))
    for shot in shots:
        signals = {
            part: {
                variables[s.findtext(NS + "signalName")]: (
                    float(s.findtext(NS + "signalValue")),
                    float(s.findtext(NS + "tol") or 0.0),
                )
                for s in shot.find(NS + part)
            }
            for part in ("checkInputs", "checkOutputs")
        }
        found = document.evaluate({name: value for name, (value, _) in signals["checkInputs"].items()})
        for name, (value, tolerance) in signals["checkOutputs"].items():
            assert abs(found[name] - value) <= tolerance, (shot.get("name"), name)
    return len(shots)


SHAPES = [(4, 6), (5,), (1, 6), (4, 1), (1, 1), (2, 3, 4)]


@pytest.mark.parametrize("shape", SHAPES)
def test_valid_and_every_check_case_is_met(make_schedule, shape):
    root = ET.fromstring(write_schedule(make_schedule(shape, kind="lqr"), "dml"))
    validate(root)
    nodes = min(int(np.prod(shape)), 16)
    centres = min(int(np.prod([max(n - 1, 1) for n in shape])), 16)
    assert run_checks(root) == nodes + centres + 2 * len(shape)


@pytest.mark.parametrize("shape", SHAPES)
def test_evaluated_elsewhere_it_is_the_schedule(make_schedule, shape):
    schedule = make_schedule(shape)
    document = Document(ET.fromstring(write_schedule(schedule, "dml")))
    names = ("altitude_m", "dynamic_pressure_pa", "mach")
    points = points_around(schedule, 20)
    expected = interpolate(schedule, tuple(points.T))
    for n, point in enumerate(points):
        found = document.evaluate(dict(zip(names, point, strict=False)))
        for gain, original in zip(expected.gains, schedule.gains, strict=True):
            scale = np.max(np.abs(original.values))
            assert found[gain.name] == pytest.approx(gain.values[n], rel=1e-12, abs=1e-13 * scale)


def test_check_cases_find_a_wrong_table(make_schedule):
    schedule = make_schedule((3, 4))
    text = write_schedule(schedule, "dml").decode()
    value = repr(float(schedule.gains[0].values[1, 1]))
    head, tail = text.split("<checkData>")
    assert head.count(value) == 1
    wrong = head.replace(value, repr(float(value) * (1 + 1e-9))) + "<checkData>" + tail
    with pytest.raises(AssertionError, match="K_p"):
        run_checks(ET.fromstring(wrong))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("  <description>gain [1]</description>\n  <isOutput/>", "  <isOutput/>\n  <isInput/>"),
        ('gtID="gt_K_p" units', 'gtID="K_p" units'),
        ('bpID="bp_altitude_m" units="m"', 'bpID="bp_altitude"'),
        ("<signalUnits>m</signalUnits>", "<signalUnits>ft</signalUnits>"),
        ("<isInput/>", "<isInput>1</isInput>"),
    ],
)
def test_the_validator_is_not_asleep(make_schedule, old, new):
    text = write_schedule(make_schedule((2, 3)), "dml").decode()
    assert old in text
    with pytest.raises((AssertionError, KeyError)):
        validate(ET.fromstring(text.replace(old, new, 1)))


def test_hostile_texts_and_filled_points(make_schedule):
    schedule = hostile(make_schedule((3, 4), failed=[(1, 2)]))
    content = write_schedule(schedule, "dml", "hold_neighbour")
    assert content.isascii()
    root = ET.fromstring(content)
    validate(root)
    assert run_checks(root) > 0
    header = root.find(NS + "fileHeader")
    assert header.get("name").encode().decode("unicode_escape") == TEXT
    assert header.find(NS + "creationDate").get("date") == "2026-01-02"
    description = header.findtext(NS + "description")
    law = next(line for line in description.splitlines() if line.strip().startswith("law: "))
    assert law.strip().removeprefix("law: ").encode().decode("unicode_escape") == TEXT
    units = {e.get("varID"): e.get("units") for e in root.iter(NS + "variableDef")}
    assert units == {
        "altitude_m": "m", "dynamic_pressure_pa": "Pa", "K_T_t_T_t_1": "nd", "L_dt_rate_da": "1_s",
        "A_dt_rate_dt": "1_s2", "B_da_rate_T_a": "rad_Nms2", "K_T_a_int_a": "Nm_rads", "filled": "nd",
    }  # fmt: skip
    assert set(NAMES) < set(units)
    document = Document(root)
    mark = type(schedule.gains[0])("filled", "1", filled(schedule, "hold_neighbour").filled.astype(float))
    marked = replace(filled(schedule, "hold_neighbour").complete, gains=(mark,))
    middle = [0.4 * a.values[1] + 0.6 * a.values[2] for a in schedule.axes]
    weight = document.evaluate(dict(zip(("altitude_m", "dynamic_pressure_pa"), middle, strict=True)))["filled"]
    assert weight == pytest.approx(float(interpolate(marked, middle).gains[0].values))
    assert 0 < weight < 1


def test_a_complete_schedule_has_no_output_filled(make_schedule):
    assert b'"filled"' not in write_schedule(make_schedule((2, 3)), "dml")


def test_unknown_date_is_no_date(make_schedule):
    schedule = make_schedule((2, 3))
    schedule = replace(schedule, provenance=replace(schedule.provenance, created_at=""))
    assert b'<creationDate date=""/>' in write_schedule(schedule, "dml")


def test_units_are_spelt_apart():
    """No two units of gains that occur side by side are spelt the same."""
    units = [f"{a}{b}" for a, b in product(("1", "s", "N m", "N m s"), ("", "/s", "/rad", "/(rad s)", "/s^2"))]
    assert len({dave_unit(unit) for unit in units}) == len(units)


@pytest.mark.parametrize("name", ["bp_altitude_m", "xmlGain"])
def test_refuses_names_that_are_no_identifiers(make_schedule, name):
    schedule = make_schedule((2, 3))
    gains = (replace(schedule.gains[0], name=name), *schedule.gains[1:])
    with pytest.raises(ValueError, match=f"'{name}' cannot be an identifier"):
        write_schedule(replace(schedule, gains=gains), "dml")
    with pytest.raises(ValueError, match="is no table"):
        write_schedule(make_schedule(()), "dml")
