"""Designs by request and by id: made once, kept as bytes, made again when more than the bytes is asked for."""

from __future__ import annotations

import copy
import hashlib
import logging
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from functools import partial
from typing import TypeVar

import numpy as np
import orjson

from design.loop import Loop
from design.lqr.coded_loop import CodedLoop
from design.lqr.output_weights import OutputWeights
from design.lqr.power_weights import NetWorkWeights, PowerBalancedWeights, Weights
from design.lqr.synthesis import LqrController
from design.lqr.weights import ExplicitWeights, WeightName
from model.arrays import FloatArray
from schedules.analysis import PlantEnvelope, analyse
from schedules.designed import ControllerRefused, DesignedController, DesignedEnvelope
from schedules.parts import Part, Synthesised, parts, synthesise
from schedules.run import run
from schedules.schedule import Provenance
from schedules.study import PlantStudy, Study
from service.access.principals import OPERATOR, Principal
from service.envelopes import Envelopes
from service.jobs.frames import cut, joined
from service.limits import check_envelope
from service.presenters.design import design_document
from service.presenters.grid import grid_index
from service.schemas.requests import DesignRequest, LinearModelsRequest
from service.store.designs import DesignStore, ListedDesign, StoredDesign
from service.to_domain import study_of
from service.version import code_version
from service.wire.answering import encode
from service.wire.refusals import FieldRefusal, InvalidRequest, NoDesignAtPoint, NotFound, StaleDesign, StudyNotPossible

#: Largest relative change of a gain between a stored design and the same design made again.
SAME_GAINS = 1e-9

#: What weights must be to define a regulator: of states and inputs, of outputs, with a price of work on top.
WORKING_WEIGHTS = (
    "R symmetric positive definite; Q and Q - N R^-1 N' symmetric positive semidefinite, and Q sees every mode "
    "that does not decay by itself"
)
WORKING_OUTPUT_WEIGHTS = (
    "W_u symmetric positive definite; W_y symmetric positive semidefinite, and the outputs show every mode that does "
    "not decay by itself"
)
WORKING_PRICES = (
    "prices of work so small that the whole cost stays positive semidefinite, of actuators whose rate has a weight "
    "in the base"
)

StudyKind = TypeVar("StudyKind", bound=PlantStudy)
Result = TypeVar("Result")

log = logging.getLogger("gainfield")


def canonical(request: DesignRequest) -> bytes:
    """The normalised request as bytes: the same for every spelling of the same request."""
    return orjson.dumps(request.normalised(), option=orjson.OPT_SORT_KEYS)


def design_id(request: DesignRequest) -> str:
    """Id of the design: hash of the canonical request and of the code that answers it."""
    return hashlib.sha256(canonical(request) + b"\0" + code_version().encode()).hexdigest()[:32]


class Designs:
    """The designs of one server, all of them, or as one who asks sees them (`of`)."""

    def __init__(
        self,
        store: DesignStore,
        envelopes: Envelopes,
        check: Callable[[DesignRequest], None] = lambda request: None,
    ) -> None:
        """Designs of a store; `check` raises of a request that is not to be designed again in this process."""
        self._store, self._envelopes, self._check = store, envelopes, check
        self._asking = OPERATOR
        self._check_room: Callable[[], None] = _boundless

    def of(self, asking: Principal, check_room: Callable[[], None]) -> Designs:
        """The same designs as this one sees them; `check_room` raises when there is no room for another of theirs."""
        seen = copy.copy(self)
        seen._asking, seen._check_room = asking, check_room
        return seen

    def create(self, request: DesignRequest) -> tuple[StoredDesign, bool]:
        """The design of this request, and whether it is new; it is on the disk when this returns.

        Raises
        ------
        InvalidRequest : no point of the grid lies inside the model, or the model refuses the numbers
        InvalidRequest : the weights of a controller cannot work
        QuotaExceeded : it would be new to this owner, who has stored as much as may be
        """
        ident, owner = design_id(request), self._asking.owner
        found = self._store.get(ident, owner)
        if found is not None:
            return found, False
        self._check_room()
        found = self._store.own(ident, owner)
        if found is not None:
            return found, False
        made: list[tuple[StoredDesign, bool]] = []

        def make() -> DesignedEnvelope:
            done = [synthesised(request, part) for part in parts_of(request)]
            new, envelope = stored_design(ident, request, done, time.time())
            kept = self._store.add(new, owner)
            made.append((kept, kept is new))
            return envelope

        self._envelopes.get(ident, make)
        if not made and (found := self._store.own(ident, owner)) is not None:
            return found, False
        if not made:  # the envelope outlived its design
            make()
        return made[0]

    def known(self, ident: str) -> StoredDesign | None:
        """The stored design, be it whose it may; None when there is none."""
        return self._store.get(ident)

    def find(self, ident: str) -> StoredDesign:
        """The stored design.

        Raises
        ------
        NotFound
        """
        found = self._store.get(ident, self._asking.sees)
        if found is None:
            raise NotFound(f"there is no design {ident[:80]!a}")
        return found

    def delete(self, ident: str) -> None:
        """Let go of a stored design; one who sees everything takes it from all its owners.

        Raises
        ------
        NotFound
        """
        if not self._store.delete(ident, self._asking.sees):
            raise NotFound(f"there is no design {ident[:80]!a}")

    def page(self, limit: int, before: int | None) -> list[ListedDesign]:
        """Designs newest first, made before the one whose `seq` is given."""
        return self._store.page(limit, before, self._asking.sees)

    def ready(self, ident: str) -> bool:
        """Whether the envelope of this design is in memory."""
        return ident in self._envelopes

    def envelope(self, ident: str) -> DesignedEnvelope:
        """The designed envelope behind a stored design, from memory or made again from its request.

        Raises
        ------
        NotFound : there is no such design
        LimitExceeded : it is not in memory, and larger than what is designed in line
        StaleDesign : made again by this code, its gains differ from those that were answered
        """
        stored = self.find(ident)
        return self._envelopes.get(ident, lambda: self._made_again(stored))

    def _made_again(self, stored: StoredDesign) -> DesignedEnvelope:
        request = DesignRequest.model_validate_json(stored.request)
        self._check(request)
        return _made_again(stored, request)

    def provenance(self, ident: str) -> Provenance:
        """Where the schedules of this design come from."""
        stored = self.find(ident)
        digest = hashlib.sha256(stored.request).hexdigest()
        return Provenance(stored.id, stored.name, digest, stored.version, stored.created_at)


def _boundless() -> None:
    """There is room for everything."""


def _asked(study: StudyKind, function: Callable[[StudyKind], Result]) -> Result:
    """Ask the domain about a study; what it refuses is a refused request, not a fault of the server."""
    check_envelope(study)
    try:
        return function(study)
    except ControllerRefused as error:
        raise _weights_refusal(study, error) from error
    except (ValueError, ArithmeticError) as error:
        log.warning("a study was refused by the model", exc_info=error)
        raise InvalidRequest(f"the model cannot answer for these numbers: {error}") from error


def _weights_refusal(study: PlantStudy, error: ControllerRefused) -> InvalidRequest:
    """The refusal of weights that cannot work, pointing at the matrix of the controller that has them."""
    controllers = study.controllers if isinstance(study, Study) else ()
    place = [wanted.name for wanted in controllers].index(error.controller)
    wanted, refused = controllers[place], error.refused
    field, allowed = _at_fault(wanted.weights, refused.matrix) if isinstance(wanted, LqrController) else ("", "")
    pointer = f"/controllers/{place}/weights{field}"
    refusal = FieldRefusal(pointer, f"{refused.matrix}: {refused.reason}", "SI", allowed)
    return InvalidRequest(f"{pointer}: {refusal.detail}", refusal)


def _at_fault(weights: Weights, matrix: WeightName) -> tuple[str, str]:
    """Pointer below the weights to the field that a matrix of the cost comes from, and what it must be."""
    if isinstance(weights, NetWorkWeights) and matrix == "N":
        # The cross term is of the price and of the base together, and the refusal does not tell them apart.
        return "", f"{WORKING_PRICES}; of the base: {WORKING_WEIGHTS}"
    if isinstance(weights, NetWorkWeights | PowerBalancedWeights):
        field, allowed = _at_fault(weights.base, matrix)
        return f"/base{field}", allowed
    if isinstance(weights, OutputWeights):
        return "/W_u" if matrix in ("R", "W_u") else "/W_y", WORKING_OUTPUT_WEIGHTS
    return f"/{matrix}" if isinstance(weights, ExplicitWeights) else "", WORKING_WEIGHTS


def parts_of(request: DesignRequest) -> tuple[Part, ...]:
    """What the making of a design takes long for, piece by piece.

    Raises
    ------
    InvalidRequest : no point of the grid lies inside the model, or the model refuses the numbers
    """
    return _asked(study_of.study(request), parts)


def synthesised(request: DesignRequest, part: Part) -> bytes:
    """One of these pieces: the same bytes wherever it is made.

    Raises
    ------
    InvalidRequest : the model refuses the numbers, or weights that cannot work
    """
    return _asked(study_of.study(request), lambda study: synthesise(study, part).to_bytes())


def stored_design(
    ident: str, request: DesignRequest, done: Sequence[bytes], created_at: float
) -> tuple[StoredDesign, DesignedEnvelope]:
    """The design of a request from all its pieces, in any order; `created_at` in seconds since 1970.

    Raises
    ------
    InvalidRequest : the model refuses the numbers, or weights that cannot work
    """
    made = [Synthesised.from_bytes(piece) for piece in done]
    envelope = _asked(study_of.study(request), partial(run, done=made) if made else run)
    moment = datetime.fromtimestamp(created_at, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    answered = encode(design_document(ident, request.normalised(), moment, envelope))
    kept = joined(done) if done else None
    return StoredDesign(ident, request.name, moment, code_version(), canonical(request), answered, kept), envelope


def _made_again(stored: StoredDesign, request: DesignRequest) -> DesignedEnvelope:
    envelope = _from_parts(request, stored) or designed(request)
    answered = orjson.loads(stored.answer)["controllers"]
    for controller, before in zip(envelope.controllers, answered, strict=True):
        if not _same_gains(controller, before["gains"]):
            raise StaleDesign(
                f"the design was made by version {stored.version}; made again by {code_version()}, the gains of "
                f"controller {controller.request.name} differ. Post its request again for a design of this version"
            )
    return envelope


def _from_parts(request: DesignRequest, stored: StoredDesign) -> DesignedEnvelope | None:
    """The envelope from the pieces it was made of; None where they are not kept, or are of other code.

    Pieces hold figures as well as gains: those of other code would pass for this code's, and its gains for found again.
    """
    if stored.parts is None or stored.version != code_version():
        return None
    try:
        return run(study_of.study(request), [Synthesised.from_bytes(piece) for piece in cut(stored.parts)])
    except ValueError as error:
        log.warning("the parts of design %s are of no use", stored.id, exc_info=error)
        return None


def _same_gains(controller: DesignedController, answered: list[dict[str, object]]) -> bool:
    """Whether the gains are those of the stored answer, missing ones included."""
    if [gain.name for gain in controller.gains] != [gain["name"] for gain in answered]:
        return False
    return all(
        _same(gain.values, np.array(before["values"], dtype=float))
        for gain, before in zip(controller.gains, answered, strict=True)
    )


def _same(now: FloatArray, before: FloatArray) -> bool:
    return now.shape == before.shape and np.allclose(now, before, rtol=SAME_GAINS, atol=0.0, equal_nan=True)


def designed(request: DesignRequest) -> DesignedEnvelope:
    """The designed envelope of a request, which nobody keeps.

    Raises
    ------
    InvalidRequest : as `Designs.create`
    """
    return _asked(study_of.study(request), run)


def analysed(request: LinearModelsRequest) -> PlantEnvelope:
    """The plant over the grid of a request, no controllers.

    Raises
    ------
    InvalidRequest : no point of the grid lies inside the model, or the model refuses the numbers
    """
    return _asked(study_of.plant_study(request), analyse)


def controller_of(envelope: DesignedEnvelope, name: str) -> DesignedController:
    """The controller of this name.

    Raises
    ------
    NotFound
    """
    try:
        return envelope.controller(name)
    except KeyError:
        names = ", ".join(controller.request.name for controller in envelope.controllers)
        raise NotFound(f"there is no controller {name[:80]!a}; there are {names}") from None


def continuous_loop(controller: DesignedController) -> Loop:
    """The controller's loop in continuous time.

    Raises
    ------
    StudyNotPossible : a sampled state feedback, which has none
    """
    if isinstance(controller.loop, CodedLoop):
        raise StudyNotPossible(
            f"the controller {controller.request.name} is a sampled state feedback, which runs as code"
        )
    return controller.loop


def measuring_all(controller: DesignedController) -> None:
    """Refuse a state feedback that runs as code, or works out its states from the angles.

    Raises
    ------
    StudyNotPossible
    """
    continuous_loop(controller)
    request = controller.request
    if isinstance(request, LqrController) and request.measurement is not None:
        raise StudyNotPossible(f"the controller {request.name} does not measure all its states")


def point_with_gains(envelope: DesignedEnvelope, controller: DesignedController, point: int) -> tuple[int, ...]:
    """Index into grid arrays of a flat point at which the controller has gains.

    Raises
    ------
    InvalidRequest : the grid has no such point
    NoDesignAtPoint : the controller carries no gains there
    """
    size = envelope.plant.outcomes.codes.size
    if not 0 <= point < size:
        detail = f"the grid has no point {point}"
        raise InvalidRequest(f"/point: {detail}", FieldRefusal("/point", detail, None, f">= 0 and <= {size - 1}"))
    index = grid_index(envelope.plant.grid, point)
    if not controller.outcomes.ok[index]:
        outcome, reason = controller.outcomes.codes[index], controller.outcomes.reasons[index]
        raise NoDesignAtPoint(
            f"the controller {controller.request.name} has no gains at point {point}: {outcome}; {reason}"
        )
    return index
