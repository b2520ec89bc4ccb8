"""Gain schedules as files to download."""

from __future__ import annotations

from typing import Annotated, Any, Literal, get_args

from fastapi import APIRouter, Path, Query, Request, Response
from pydantic import BaseModel, Field

from schedules.files import (
    FILE_FORMATS,
    FileFormat,
    FillRule,
    LibraryMissing,
    MissingGains,
    file_name_parts,
    write_schedule,
)
from schedules.proof.table_proof import proved_schedule
from schedules.rules import IntegratorPlacement, Interpolation, OutOfRange, ScheduleRules
from schedules.schedule_of import schedule_of
from service.designs import controller_of
from service.documentation.openapi import problems
from service.routes.designs import DesignId
from service.schemas.wire import PARAMETERS
from service.state import HEAVY, DesignsHere, SettingsHere
from service.to_domain.verification_of import origin_of, summary_of
from service.wire.answering import answer, download_headers
from service.wire.refusals import FieldRefusal, InvalidRequest, NoDesignAtPoint, NotFound

router = APIRouter(prefix="/v1/designs/{id}/schedules", tags=["schedules"])

_FILE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The file, as an attachment",
        "content": {f.media_type.partition(";")[0]: {} for f in FILE_FORMATS.values()},
    }
}

_WITH_MISSING = ", ".join(f.suffix for f in FILE_FORMATS.values() if f.says_missing)
_WITHOUT_MISSING = ", ".join(f.suffix for f in FILE_FORMATS.values() if not f.says_missing)


class Options(BaseModel):
    """What the file is to hold."""

    model_config = PARAMETERS

    fill: FillRule | None = Field(
        default=None,
        description=f"Where points without gains get them from, in tables that need a number everywhere "
        f"({_WITHOUT_MISSING}); the file names every point that was filled. Not for {_WITH_MISSING}, which say where "
        f"there is no gain",
    )
    rule: Interpolation = Field(default="multilinear", description="Between the points")
    out_of_range: OutOfRange = Field(default="clip", description="Outside them")
    integrator_placement: IntegratorPlacement = Field(
        default="before_gain", description="Where the integrators stand; both are one law while the gains stay"
    )
    certificate: Literal["summary"] | None = Field(
        default=None,
        description="`summary`: the file says what is proved between its points: cells, decay rate, rates of flight, "
        "with the digests of the table and of its certificate. That takes seconds; without it `proof` is null. Only of "
        "multilinear tables with integrators before their gains",
    )


@router.get(
    "/{controller}.{suffix}",
    response_class=Response,
    responses=_FILE | problems(404, 409, 422, 503),
    dependencies=[HEAVY],
)
def download_schedule(
    request: Request,
    ident: DesignId,
    controller: Annotated[str, Path(description="Name of the controller", examples=["nf"])],
    suffix: Annotated[str, Path(description=f"Format: {', '.join(FILE_FORMATS)}", examples=["csv"])],
    options: Annotated[Options, Query()],
    designs: DesignsHere,
    settings: SettingsHere,
) -> Response:
    """The gain schedule of one controller, with its outcomes, units, law and rule between the points.

    A table that needs a number everywhere is refused (409) when a point has no gains, unless `fill` says where they
    come from. HDF5 is there (404 if not) where the server is installed with the extra `hdf5`.
    """
    if suffix not in FILE_FORMATS:
        raise NotFound(f"there is no schedule file {suffix[:80]!a}; there are {', '.join(FILE_FORMATS)}")
    form = FILE_FORMATS[suffix]
    _check_fill(form, options.fill)
    envelope = designs.envelope(ident)
    rules = ScheduleRules(options.rule, options.out_of_range, options.integrator_placement)
    designed = controller_of(envelope, controller)
    schedule = schedule_of(envelope, designed, designs.provenance(ident), rules)
    if options.certificate is not None:
        _check_provable(rules)
        proof = summary_of(envelope, designed, origin_of(designs, ident), settings, "/certificate")
        schedule = proved_schedule(schedule, proof)
    try:
        content = write_schedule(schedule, suffix, options.fill)
    except LibraryMissing as missing:
        raise NotFound(f"this server writes no schedule file {suffix}: {missing}") from missing
    except MissingGains as missing:
        detail = f"{missing}; {_WITH_MISSING} files say where there is no gain"
        raise NoDesignAtPoint(detail) from missing
    except ValueError as refused:  # a rule that the format has no place for
        raise InvalidRequest(
            str(refused), FieldRefusal("/rule", str(refused), None, "another rule or format")
        ) from refused
    headers = download_headers(*file_name_parts(schedule, suffix), suffix=suffix)
    return answer(request, content, media_type=form.media_type, headers=headers)


def _check_provable(rules: ScheduleRules) -> None:
    if rules.interpolation != "multilinear" or rules.integrator_placement != "before_gain":
        detail = "only a multilinear table with integrators before their gains is proved between its points"
        allowed = "nothing, or summary with the rule multilinear and the integrator_placement before_gain"
        raise InvalidRequest(f"/certificate: {detail}", FieldRefusal("/certificate", detail, None, allowed))


def _check_fill(form: FileFormat, fill: FillRule | None) -> None:
    if fill is not None and form.says_missing:
        detail = f"a {form.suffix} file says where there is no gain and takes no fill rule"
        allowed = f"{' or '.join(get_args(FillRule))} with {_WITHOUT_MISSING}; nothing with {_WITH_MISSING}"
        raise InvalidRequest(f"/fill: {detail}", FieldRefusal("/fill", detail, None, allowed))
