"""The request as a form and as JSON: both ways, problems at their fields, nothing typed is lost, the section drawn."""

from __future__ import annotations

import json
from typing import Any

import pytest

from service.examples import NAMES, example

pytestmark = pytest.mark.browser


@pytest.fixture
def define(tab: Any, address: str) -> Any:
    tab.goto(f"{address}/#/define")
    tab.locator(".form .group").first.wait_for()
    return tab


def field(tab: Any, pointer: str) -> Any:
    return tab.locator(f'[id="field{pointer}"]')


def choice(tab: Any, pointer: str) -> Any:
    return tab.locator(f'[id="choice{pointer}"]')


def problem(tab: Any, pointer: str) -> str:
    text: str = tab.locator(f'[id="error{pointer}"]').inner_text()
    return text


def request_of(tab: Any) -> Any:
    return json.loads(tab.locator("#json").input_value())


def write_json(tab: Any, text: str) -> None:
    tab.locator("#json").fill(text)
    tab.wait_for_timeout(400)


def test_the_form_fills_in_the_json(define: Any) -> None:
    assert request_of(define) == example(NAMES[0])
    field(define, "/geometry/chord_m").fill("0.75")
    field(define, "/grid/altitude_m").fill("0, 1500 3000")
    field(define, "/name").fill("mine")
    choice(define, "/trim/tab_deg").select_option(label="zero aileron torque")
    define.locator('[id="field/aerodynamics/virtual_inertia"]').check()
    expected = example(NAMES[0])
    expected["geometry"]["chord_m"] = 0.75
    expected["grid"]["altitude_m"] = [0, 1500, 3000]
    expected["name"] = "mine"
    expected["trim"]["tab_deg"] = "zero_aileron_torque"
    expected["aerodynamics"]["virtual_inertia"] = True
    assert request_of(define) == expected


def test_the_json_fills_in_the_form(define: Any) -> None:
    document = example("airliner_aileron")
    document["trim"] = {"alpha_deg": 2.5, "tab_deg": {"surface": "tab", "torque_n_m": 12.5}}
    document["controllers"][0]["weights"] = {"rule": "explicit", "Q": [[1, 0], [0, 2]], "R": [[3, 0], [0, 4]]}
    write_json(define, json.dumps(document))
    assert float(field(define, "/geometry/chord_m").input_value()) == document["geometry"]["chord_m"]
    assert field(define, "/trim/alpha_deg").input_value() == "2.5"
    assert choice(define, "/trim/tab_deg").locator("option:checked").inner_text() == "held torque"
    assert field(define, "/trim/tab_deg/torque_n_m").input_value() == "12.5"
    assert field(define, "/controllers/0/weights/Q").input_value() == "1, 0\n0, 2"
    field(define, "/controllers/0/weights/Q").fill("1 0\n0 5")
    assert request_of(define)["controllers"][0]["weights"]["Q"] == [[1, 0], [0, 5]]


@pytest.mark.parametrize("name", NAMES)
def test_every_example_goes_through_the_form_unchanged(define: Any, name: str) -> None:
    """Every control is told of its own value as if it had been typed, and the request stays what it was."""
    write_json(define, json.dumps(example(name)))
    define.evaluate("""() => {
        for (const group of document.querySelectorAll('.form details')) group.open = true;
        for (const control of document.querySelectorAll('.form input[type=text], .form textarea')) {
            if (control.value) control.dispatchEvent(new Event('input', { bubbles: true }));
        }
        const boxes = document.querySelectorAll('.form input[type=checkbox]');
        for (const box of boxes) box.dispatchEvent(new Event('change'));
    }""")
    sent = request_of(define)
    assert sent.pop("aerodynamics").pop("virtual_inertia", False) is False
    expected = example(name)
    expected.pop("aerodynamics")
    assert sent == expected
    assert define.locator('.form [aria-invalid="true"]').count() == 0


def test_another_kind_and_back_keeps_what_was_typed(define: Any) -> None:
    field(define, "/aerodynamics/section").fill("NACA 2412")
    choice(define, "/aerodynamics").select_option(label="derivatives")
    assert request_of(define)["aerodynamics"]["source"] == "derivatives"
    assert request_of(define)["aerodynamics"]["damping"] == "thesis"
    field(define, "/aerodynamics/C_Ha_da").fill("-0.5")
    choice(define, "/aerodynamics").select_option(label="thin aerofoil")
    assert request_of(define)["aerodynamics"]["section"] == "NACA 2412"
    choice(define, "/aerodynamics").select_option(label="derivatives")
    assert request_of(define)["aerodynamics"]["C_Ha_da"] == -0.5


def test_controllers_are_added_doubled_and_removed(define: Any) -> None:
    define.get_by_role("button", name="Add lqr").click()
    added = request_of(define)["controllers"][3]
    assert (added["name"], added["kind"], added["weights"]["rule"]) == ("lqr_2", "lqr", "bryson")
    define.get_by_role("button", name="Double controller nf").click()
    controllers = request_of(define)["controllers"]
    assert controllers[4] == {**controllers[0], "name": "nf_2"}
    define.get_by_role("button", name="Remove controller pf").click()
    assert [one["name"] for one in request_of(define)["controllers"]] == ["nf", "lqr", "lqr_2", "nf_2"]
    define.get_by_role("button", name="Remove controller lqr_2").click()
    choice(define, "/controllers/2").select_option(label="positive feedback")
    last = request_of(define)["controllers"][2]
    assert (last["name"], last["kind"]) == ("nf_2", "positive_feedback")
    assert last["specs"] == example(NAMES[0])["controllers"][0]["specs"]
    assert "rate_filter_hz" not in last


def test_wrong_values_show_their_message_at_their_field(define: Any, watch: Any) -> None:
    watch.refused.add(422)
    field(define, "/geometry/tab_hinge").fill("1.5")
    assert "between 0 and 1" in problem(define, "/geometry/tab_hinge")
    field(define, "/controllers/1/specs/damping_ratio_min").fill("half")
    assert "not a number" in problem(define, "/controllers/1/specs/damping_ratio_min")
    field(define, "/grid/altitude_m").fill("0, 99000")
    define.get_by_role("button", name="Design", exact=True).click()
    define.get_by_text("fields are refused; each says why").wait_for()
    assert "less than 1" in problem(define, "/geometry/tab_hinge")
    assert "allowed: >= 0 and <= 1" in problem(define, "/controllers/1/specs/damping_ratio_min")
    assert "32000" in problem(define, "/grid/altitude_m")
    assert define.evaluate("document.activeElement.id") == "field/geometry/tab_hinge"
    assert field(define, "/geometry/tab_hinge").get_attribute("aria-invalid") == "true"
    described = field(define, "/geometry/tab_hinge").get_attribute("aria-describedby").split()
    assert "error/geometry/tab_hinge" in described
    assert field(define, "/controllers/1/specs/damping_ratio_min").input_value() == "half"
    field(define, "/geometry/tab_hinge").fill("0.9")
    assert problem(define, "/geometry/tab_hinge") == ""
    assert field(define, "/geometry/tab_hinge").get_attribute("aria-invalid") is None


def test_problems_without_a_field_of_their_own_are_said_around_it(define: Any, watch: Any) -> None:
    watch.refused.add(422)
    document = example(NAMES[0])
    document["geometry"]["wings"] = 2
    del document["reference"]["duration_s"]
    write_json(define, json.dumps(document))
    define.locator('.form > details[data-pointer="/reference"] > summary').click()
    define.get_by_role("button", name="Design", exact=True).click()
    define.get_by_text("fields are refused").wait_for()
    assert "wings: unknown field" in problem(define, "/geometry")
    assert "required" in problem(define, "/reference/duration_s")
    assert field(define, "/reference/duration_s").is_visible()


def test_json_that_is_none_says_where_and_is_kept(define: Any) -> None:
    broken = '{\n  "name": "x",\n  "geometry": {oops}\n}'
    write_json(define, broken)
    assert "line 3, column 16" in define.locator("#json-problem").inner_text()
    assert define.locator("#json").get_attribute("aria-invalid") == "true"
    define.get_by_role("button", name="Design", exact=True).click()
    assert define.evaluate("document.activeElement.id") == "json"
    define.reload()
    define.locator(".form .group").first.wait_for()
    assert define.locator("#json").input_value() == broken
    assert "line 3" in define.locator("#json-problem").inner_text()
    assert define.locator(".form").evaluate("form => form.inert")  # a change there would write over the text
    define.get_by_role("button", name="Back to the last valid request").click()
    assert request_of(define) == example(NAMES[0])
    assert not define.locator(".form").evaluate("form => form.inert")


def test_the_form_takes_over_what_the_text_said_last(define: Any) -> None:
    """Text typed less than a pause before the form is used is not lost."""
    document = example(NAMES[0])
    document["trim"]["alpha_deg"] = 1.25
    define.locator("#json").fill(json.dumps(document))
    field(define, "/name").focus()
    field(define, "/name").fill("at once")
    assert (request_of(define)["trim"]["alpha_deg"], request_of(define)["name"]) == (1.25, "at once")


def test_nothing_typed_is_lost(define: Any) -> None:
    field(define, "/name").fill("kept over panels")
    define.get_by_role("link", name="Explore").click()
    define.get_by_role("heading", name="Open a design").wait_for()
    define.get_by_role("link", name="Define").click()
    field(define, "/name").wait_for()
    assert field(define, "/name").input_value() == "kept over panels"
    define.reload()
    field(define, "/name").wait_for()
    assert field(define, "/name").input_value() == "kept over panels"
    define.get_by_label("Start from").select_option("example airliner_aileron")
    assert field(define, "/name").input_value() == "airliner_aileron"
    define.get_by_role("button", name="Bring back what was there").click()
    assert field(define, "/name").input_value() == "kept over panels"


def test_a_changed_request_becomes_a_design(define: Any, address: str) -> None:
    field(define, "/name").fill("changed")
    field(define, "/grid/dynamic_pressure_pa").fill("400, 900")
    define.get_by_role("button", name="Design", exact=True).click()
    define.locator(".plot-canvas .main-svg").first.wait_for()
    assert define.get_by_role("heading", name="changed").is_visible()
    stored = define.request.get(f"{address}/v1/designs").json()["items"]
    assert "changed" in [item["name"] for item in stored]
    define.get_by_role("link", name="Define").click()
    chosen = next(item for item in stored if item["name"] == "changed")
    define.get_by_label("Start from").locator(f'option[value="design {chosen["id"]}"]').wait_for(state="attached")
    define.get_by_label("Start from").select_option(f"design {chosen['id']}")
    define.get_by_role("button", name="Bring back what was there").wait_for()
    assert request_of(define)["atmosphere"] == {"temperature_offset_k": 0.0}
    assert field(define, "/grid/dynamic_pressure_pa").input_value() == "400, 900"


def test_copied_programs_hold_the_request(define: Any) -> None:
    define.evaluate(
        "Object.defineProperty(navigator, 'clipboard', {value: {writeText: async (t) => { window.copied = t; }}})"
    )
    field(define, "/name").fill('it\'s "quoted" \\ and {true: null}')
    define.get_by_role("button", name="Copy as Python").click()
    define.wait_for_function("window.copied !== undefined")
    program = define.evaluate("window.copied")
    body = program.partition("body = ")[2].partition("\nrequest = ")[0]
    assert eval(body, {"__builtins__": {}}) == request_of(define)
    compile(program, "copied.py", "exec")
    define.get_by_role("button", name="Copy as curl").click()
    define.wait_for_function("window.copied.startsWith('curl')")
    lines = define.evaluate("window.copied").split("\n")
    assert json.loads("\n".join(lines[1:-2])) == request_of(define)
    assert lines[0].endswith("<<'JSON'")
    assert lines[-2] == "JSON"


def test_the_section_is_drawn_to_scale_and_follows_the_form(define: Any) -> None:
    def corners(kind: str) -> list[tuple[float, float]]:
        path = define.locator(f".section .section-{kind}").first.get_attribute("d").strip("MZ")
        return [(float(x), float(y)) for x, y in (pair.split() for pair in path.split("L"))]

    wing, tab = corners("wing"), corners("tab")
    left = min(x for x, _ in wing)
    chord = max(x for x, _ in tab) - left
    assert (max(x for x, _ in wing) - left) / chord == pytest.approx(0.72, abs=0.003)
    assert (min(x for x, _ in tab) - left) / chord == pytest.approx(0.96, abs=0.003)
    before = min(y for _, y in tab)
    field(define, "/trim/aileron_deg").fill("10")
    define.wait_for_timeout(400)
    assert min(y for _, y in corners("tab")) < before  # up on the screen: trailing edge up is positive
    assert "aileron 10 deg" in define.locator('[role="img"][aria-label^="Section"]').get_attribute("aria-label")
    field(define, "/geometry/tab_hinge").fill("0.5")
    define.get_by_text("The section is drawn when the hinges").wait_for()
