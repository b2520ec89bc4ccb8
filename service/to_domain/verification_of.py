"""From the wire to a proof: what is to be proved, how much work that is, and the table that a request uploads."""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import ceil, prod, tau
from typing import TypeVar

import numpy as np
import orjson

from design.classical.controller import ClassicalController
from design.lqr.controller import LqrController
from design.lqr.measurement import KalmanMeasurement, RateFilters
from design.outcome import Outcome, Outcomes
from model.flight import GridAxis
from schedules.analysis import PlantEnvelope, analyse
from schedules.designed import DesignedController, DesignedEnvelope
from schedules.files.header import object_array
from schedules.perturbations import MOST_CORNER_PARAMETERS, Parameter, Uncertainty
from schedules.perturbations import PARAMETERS as UNCERTAIN
from schedules.proof.certificate import Origin, to_document
from schedules.proof.prove import ProofRequest, prove
from schedules.proof.reading_error import reading_margins
from schedules.proof.scheduling_rates import scheduling_rates
from schedules.proof.table_proof import TableProof, table_proof
from schedules.study import Controller, GridRequest, Reference, Study
from schedules.uploaded_schedule import gain_units, needed_gains, on_axes, state_feedback_of, uploaded_schedule
from schedules.wire_names import inner_name
from service.designs import Designs, controller_of
from service.limits import check_envelope, check_size, check_table
from service.presenters.verification import NOT_ASKED, Verified
from service.schemas.requests import MOST_UNDER_WAY
from service.schemas.verification_requests import (
    FlownController,
    FlownPlant,
    GainTable,
    VerificationRequest,
    WantedProof,
    WantedSummary,
)
from service.settings import Settings
from service.to_domain import study_of
from service.version import code_version
from service.wire.refusals import FieldRefusal, InvalidRequest, LimitExceeded, StudyNotPossible

#: Work of reading errors and of rates of flight, in pieces of a cell.
MARGIN_PIECES, RATE_PIECES = 26, 150
#: Largest gain of a classical controller, as in a design request.
LARGEST_GIVEN = 1e6

Result = TypeVar("Result")

log = logging.getLogger("gainfield")


def proof_request(wanted: WantedProof, at: str = "") -> ProofRequest:
    """What is to be proved; `at` is the pointer to where it is asked.

    Raises
    ------
    InvalidRequest : too many parameters off together
    """
    changes = tuple(
        Uncertainty(parameter, change) for parameter in UNCERTAIN if (change := _change(wanted, parameter)) > 0.0
    )
    if wanted.together and len(changes) > MOST_CORNER_PARAMETERS:
        detail = f"{len(changes)} parameters have too many corners together"
        allowed = f"false, or at most {MOST_CORNER_PARAMETERS} parameters with a change above 0"
        raise InvalidRequest(f"{at}/together: {detail}", FieldRefusal(f"{at}/together", detail, None, allowed))
    return ProofRequest(
        fraction=wanted.fraction, decay=wanted.decay_rate_1_s, changes=changes, together=wanted.together,
        most_pieces=wanted.pieces,
    )  # fmt: skip


def _change(wanted: WantedProof, parameter: Parameter) -> float:
    """Largest relative change of a parameter: its own, or that of its group."""
    own: float | None = getattr(wanted, f"{parameter}_percent")
    group = "hinge_moment" if parameter.startswith("C_") else parameter.partition("_")[2]
    of_group: float = getattr(wanted, f"{group}_percent")
    return (of_group if own is None else own) / 100.0


def check_work(
    shape: tuple[int, ...], controllers: int, wanted: WantedProof, request: ProofRequest, settings: Settings, at: str
) -> None:
    """Refuse a proof of too many pieces; `at` is the pointer to what decides how many.

    Raises
    ------
    LimitExceeded
    """
    cells = controllers * prod(max(count - 1, 1) for count in shape)
    off = len(request.changes)
    plants = (2**off if request.together else 2 * off) or 1
    each = wanted.pieces
    if isinstance(wanted, WantedSummary):
        each += MARGIN_PIECES * wanted.margins + RATE_PIECES * wanted.rates
    what = (
        f"pieces: cells times plants times the pieces a cell may be cut into, {MARGIN_PIECES} more with margins and "
        f"{RATE_PIECES} more with rates"
    )
    check_size(at, what, cells * plants * each, "max_proof_pieces", settings)


def verified(
    study: Study, plant: PlantEnvelope, designed: DesignedController, wanted: WantedSummary, request: ProofRequest
) -> Verified:
    """The proof, and what else is asked for.

    Raises
    ------
    InvalidRequest : the model refuses the numbers
    """
    proof = answerable(lambda: prove(study, plant, designed, request))
    decay = wanted.decay_rate_1_s or 0.0
    return Verified(
        kind=designed.request.kind,
        proof=proof,
        margins=_or_why(lambda: reading_margins(proof, decay)) if wanted.margins else NOT_ASKED,
        rates=_or_why(lambda: scheduling_rates(proof, wanted.altitude_rate_m_s, decay)) if wanted.rates else NOT_ASKED,
    )


def origin_of(designs: Designs, ident: str) -> Origin:
    """Where the table of a stored design comes from."""
    known = designs.provenance(ident)
    return Origin(known.design_id, known.design_name, known.request_digest, code_version())


def uploaded_origin(body: VerificationRequest) -> Origin:
    """Where a table comes from that a request holds."""
    canonical = orjson.dumps(body.model_dump(mode="json"), option=orjson.OPT_SORT_KEYS)
    return Origin(None, None, hashlib.sha256(canonical).hexdigest(), code_version())


def summary_of(
    envelope: DesignedEnvelope, designed: DesignedController, origin: Origin, settings: Settings, at: str
) -> TableProof:
    """What a schedule file says of the proof of its table: of the model, at the rates that are proved by default.

    The digest is that of the certificate as it is answered without a query. `at` is the pointer to where it is asked.

    Raises
    ------
    LimitExceeded : too many pieces
    InvalidRequest : the model refuses the numbers
    """
    wanted = WantedSummary(rates=True)
    asked = proof_request(wanted)
    check_work(envelope.plant.grid.shape, 1, wanted, asked, settings, at)
    found = verified(envelope.study, envelope.plant, designed, wanted, asked)
    certified = to_document(found.proof, origin)["sha256"] if found.proof.summary.proved else None
    return table_proof(found.proof, designed, found.rates, certified)


def _or_why(function: Callable[[], Result]) -> Result | str:
    try:
        return function()
    except ValueError as error:
        return str(error)


def answerable(function: Callable[[], Result]) -> Result:
    """What the domain answers; what it refuses is a refused request, not a fault of the server.

    A table may hold any gains. Loops beyond what doubles hold end in a refusal or a cell that is not proved.

    Raises
    ------
    InvalidRequest
    """
    try:
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            return function()
    except (ValueError, ArithmeticError) as error:
        log.warning("a proof was refused by the model", exc_info=error)
        raise InvalidRequest(f"the model cannot answer for these numbers: {error}") from error


@dataclass(frozen=True, eq=False)
class Uploaded:
    """A table with the plant and the law that fly it."""

    study: Study
    plant: PlantEnvelope
    designed: DesignedController


def uploaded_of(body: VerificationRequest, designs: Designs, settings: Settings) -> Uploaded:
    """The table of a request, flown by its law around its plant.

    Raises
    ------
    NotFound : no such design or controller
    StudyNotPossible : a state feedback that runs as code, or a model of the plant
    LimitExceeded : too many points
    InvalidRequest : gains that do not fit the law, or numbers that the model refuses
    """
    check_size("/schedule/axes", "grid points", prod(body.schedule.shape), "max_grid_points", settings)
    study, request = _study_and_law(body, designs, settings)
    if body.schedule.kind not in (None, request.kind):
        raise _refusal("/schedule/kind", f"the table is of the kind {body.schedule.kind}", f"{request.kind}, or null")
    study = on_axes(study, _axes(body.schedule))
    _check_delays(study, request, body.schedule, settings)
    with _pointing_into({"/grid": "/schedule/axes"}, "/design"):
        check_envelope(study)
    plant = answerable(lambda: analyse(study))
    units = answerable(lambda: gain_units(study, plant.model.states, request))
    _check_gains(body.schedule, units, isinstance(request, ClassicalController))
    gains = {gain.name: np.array(gain.values, dtype=float) for gain in body.schedule.gains}
    outcomes = _outcomes(body.schedule)
    return Uploaded(study, plant, answerable(lambda: uploaded_schedule(study, plant, request, gains, outcomes)))


def _study_and_law(body: VerificationRequest, designs: Designs, settings: Settings) -> tuple[Study, Controller]:
    if body.design_id is None:
        assert body.design is not None
        assert isinstance(body.controller, FlownController)
        with _pointing_into({}, "/design"):
            check_table(body.design.aerodynamics, settings)
            return _study(body.design), _law(body.controller)
    envelope = designs.envelope(body.design_id)
    if isinstance(body.controller, FlownController):
        return envelope.study, _law(body.controller)
    request = controller_of(envelope, body.controller).request
    if isinstance(request, LqrController) and (
        request.sampling is not None or isinstance(request.measurement, KalmanMeasurement)
    ):
        raise StudyNotPossible(
            f"the controller {request.name} runs as code, or a model of the plant: no table flies it"
        )
    return envelope.study, request


def _study(wire: FlownPlant) -> Study:
    """A study of the plant alone, on no grid yet; no manoeuvre has part in a proof."""
    about = study_of.expansion_point(wire.trim)
    return Study(
        name="uploaded",
        geometry=study_of.geometry(wire.geometry),
        inertia=study_of.inertia(wire.inertia),
        aerodynamics=study_of.aerodynamic_model(wire.aerodynamics, wire.geometry, about),
        trim=study_of.trim(wire.trim),
        grid=GridRequest((), "dynamic_pressure", (), wire.atmosphere.temperature_offset_k),
        tab_actuator=study_of.tab_actuator(wire.actuators.tab),
        aileron_actuator=study_of.aileron_actuator(wire.actuators.aileron),
        reference=Reference(0.0, 1.0),
        controllers=(),
        spec_pack=(),
    )


def _law(wire: FlownController) -> Controller:
    if wire.kind == "lqr":
        filters = None if wire.measurement is None else RateFilters(tau * wire.measurement.cutoff_hz)
        return state_feedback_of(wire.name, wire.reference, filters, wire.delay_states)
    cutoff = None if wire.rate_filter_hz is None else tau * wire.rate_filter_hz
    return ClassicalController(
        wire.name, wire.kind, rate_filter=cutoff, tab_command=wire.tab_command, sampling=study_of.sampling(wire)
    )


def _axes(table: GainTable) -> tuple[GridAxis, GridAxis]:
    altitude, speed = (GridAxis(inner_name(a.name, a.unit), a.unit, tuple(a.values)) for a in table.axes)
    return altitude, speed


def _outcomes(table: GainTable) -> Outcomes | None:
    """What the table says of its points; None where it says nothing."""
    if table.outcomes is None:
        return None
    said = [Outcome(code) for row in table.outcomes for code in row]
    given = [None] * len(said) if table.reasons is None else [reason for row in table.reasons for reason in row]
    reasons = [
        None if code is Outcome.OK else reason or "the table has no gains there"
        for code, reason in zip(said, given, strict=True)
    ]
    return Outcomes(object_array(said, table.shape), object_array(reasons, table.shape))


def _lags(study: Study, request: Controller) -> list[float]:
    """Delays of what the law moves [s]."""
    moved = [study.tab_actuator] + ([study.aileron_actuator] if isinstance(request, LqrController) else [])
    computation = 0.0 if request.sampling is None else request.sampling.mean_delay
    return [actuator.delay + computation for actuator in moved]


def _check_delays(study: Study, request: Controller, table: GainTable, settings: Settings) -> None:
    """Refuse too many points of loops with delays, and more commands under way than can be followed."""
    if max(_lags(study, request)) > 0.0:
        check_size("/schedule/axes", "grid points, with delays", prod(table.shape), "max_delayed_loops", settings)
    sampling = request.sampling
    if sampling is not None:
        under_way = ceil((study.tab_actuator.delay + sampling.delay) / sampling.time - 1e-9)
        if under_way > MOST_UNDER_WAY:
            detail = f"{under_way} commands would be on their way at a time"
            raise _refusal("/controller/sample_time_s", detail, f"one at which at most {MOST_UNDER_WAY} are")


def _check_gains(table: GainTable, units: dict[str, str], at_least_zero: bool) -> None:
    """Refuse gains that the law has not, that are in another unit or missing, or negative where the law has the sign.

    Raises
    ------
    InvalidRequest
    """
    found: list[FieldRefusal] = []
    for place, gain in enumerate(table.gains):
        at = f"/schedule/gains/{place}"
        if gain.name not in units:
            detail = f"the controller has no gain {gain.name}"
            found.append(FieldRefusal(f"{at}/name", detail, None, f"one of {', '.join(units)}"))
        elif gain.unit != units[gain.name]:
            detail = f"{gain.name} is not in {gain.unit[:40]!a}"
            found.append(FieldRefusal(f"{at}/unit", detail, None, f"only {units[gain.name]}"))
        elif at_least_zero:
            found.extend(_negative(gain.name, gain.values, f"{at}/values", units[gain.name]))
    names = [gain.name for gain in table.gains]
    if missing := [name for name in needed_gains(units) if name not in names]:
        allowed = f"{', '.join(needed_gains(units))}, each once"
        found.append(FieldRefusal("/schedule/gains", f"the table has no gain {', '.join(missing)}", None, allowed))
    if found:
        rest = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        raise InvalidRequest(f"{found[0].pointer}: {found[0].detail}{rest}", *found)


def _negative(name: str, values: list[list[float | None]], at: str, unit: str) -> Iterator[FieldRefusal]:
    """The first gain that no classical controller can be given."""
    for i, row in enumerate(values):
        for j, value in enumerate(row):
            if value is not None and not 0.0 <= value <= LARGEST_GIVEN:
                detail = f"{name} must be at least 0, as the law has its sign, and at most {LARGEST_GIVEN:g}"
                yield FieldRefusal(f"{at}/{i}/{j}", detail, unit, f">= 0 and <= {LARGEST_GIVEN:g}")
                return


def _refusal(pointer: str, detail: str, allowed: str) -> InvalidRequest:
    return InvalidRequest(f"{pointer}: {detail}", FieldRefusal(pointer, detail, None, allowed))


@contextmanager
def _pointing_into(moved: dict[str, str], prefix: str) -> Iterator[None]:
    """Refusals of a part of the body, pointing at where it stands: below `prefix`, or as `moved` says."""
    try:
        yield
    except (InvalidRequest, LimitExceeded) as refusal:
        fields = [replace(f, pointer=moved.get(f.pointer, prefix + f.pointer)) for f in refusal.fields]
        detail = refusal.detail
        for before, after in zip(refusal.fields, fields, strict=True):
            detail = detail.replace(f"{before.pointer}:", f"{after.pointer}:", 1)
        raise type(refusal)(detail, *fields) from refusal
