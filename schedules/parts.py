"""A study in parts: what workers need to compute one piece by piece, keep the pieces, and go on after a break.

::

    for part in parts(study):                            in any order, on any machine
        content = synthesise(study, part).to_bytes()     kept; the same bytes wherever they are made
    run(study, [Synthesised.from_bytes(content), ...])   the same design as run(study), to the last bit
"""

from __future__ import annotations

from schedules.analysis import analyse
from schedules.digests import study_digest
from schedules.part import Part, parts, requested
from schedules.run import designed_part
from schedules.study import Study
from schedules.synthesised import Synthesised

__all__ = ["Part", "Synthesised", "parts", "synthesise"]


def synthesise(study: Study, part: Part) -> Synthesised:
    """Design and judge the controller of a part at its points, whatever becomes of the other parts.

    Raises
    ------
    ControllerRefused : weights that define no regulator; where a part is all of its grid, also weights that cannot work
        at any point. Of a smaller part they make its points infeasible, and `schedules.run.run` refuses them where
        no other part has gains
    ValueError : not one of the study's `parts`, or the grid cannot be built
    """
    if part not in parts(study):
        raise ValueError(f"{part} is not a part of the study {study.name}")
    return Synthesised(part, study_digest(study, requested(study, part)), designed_part(study, analyse(study), part))
