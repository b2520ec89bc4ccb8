"""Every kind of jobs by its name."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from service.jobs.kinds.answer import ANSWER, AnswerJobs
from service.jobs.kinds.design import DESIGN, DesignJobs
from service.jobs.kinds.kind import Kind
from service.jobs.kinds.perturbed import PERTURBED, PerturbedJobs

KINDS: Mapping[str, Kind] = MappingProxyType({DESIGN: DesignJobs(), ANSWER: AnswerJobs(), PERTURBED: PerturbedJobs()})
