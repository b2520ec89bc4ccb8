"""Previews: a design that is made, looked at and forgotten."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from service.schemas.controller_answers import RootLocus
from service.schemas.design import OverTheGrid
from service.schemas.frequency_answers import FrequencyResponses
from service.schemas.point import Point
from service.schemas.requests import DesignRequest
from service.schemas.requirement_answers import Requirements, Response
from service.schemas.wire import Answer, Request, refusal

#: What a preview can answer about one controller, and which of them are at one point.
Study = Literal["point", "root_locus", "response", "frequency_response", "actuator_requirements"]


class PreviewRequest(Request):
    """A design request, and what is wanted of its controllers beside the design itself."""

    request: DesignRequest
    studies: list[Study] = Field(
        default_factory=list,
        max_length=5,
        description="What is answered beside the design, each as its own route answers it",
        examples=[["point", "root_locus", "response"]],
    )
    controller: Annotated[str, Field(max_length=63)] | None = Field(
        default=None, description="Which controller the studies are of; null: the first", examples=["nf"]
    )
    point: Annotated[int, Field(ge=0)] = Field(default=0, description="Flat row-major index of the grid point, from 0")
    loop: Annotated[str, Field(max_length=64)] | None = Field(
        default=None, description="Of the root locus, as its own route takes it"
    )
    gains: Annotated[int, Field(ge=100)] = Field(default=300, description="Gains of the root locus")
    samples: Annotated[int, Field(ge=2)] = Field(default=301, description="Samples of the response")
    frequencies: Annotated[int, Field(ge=2)] = Field(default=300, description="Frequencies of the frequency response")

    @model_validator(mode="after")
    def each_once(self) -> Self:
        """Refuse a study that is asked for twice."""
        if len(set(self.studies)) < len(self.studies):
            raise refusal("a study is named twice", "each at most once", at="/studies")
        return self


class PreviewStudies(Answer):
    """What was asked for beside the design, each as its own route answers it; null: not asked for."""

    point: Point | None
    root_locus: RootLocus | None
    response: Response | None
    frequency_response: FrequencyResponses | None
    actuator_requirements: Requirements | None


class Preview(Answer):
    """A design that is not kept, and the studies of one of its controllers."""

    design: OverTheGrid
    studies: PreviewStudies
