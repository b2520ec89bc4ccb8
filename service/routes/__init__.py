"""The routes, one file a subject. A route reads its parameters, calls one function of the domain, and answers."""

from service.routes import (
    atmosphere,
    controllers,
    designs,
    examples,
    hinge_moments,
    linear_models,
    meta,
    points,
    root_locus,
)
from service.routes import schedules as schedule_files

#: Every router of the API, in the order of the documentation.
ROUTERS = (
    designs.router,
    points.router,
    root_locus.router,
    controllers.router,
    schedule_files.router,
    linear_models.router,
    hinge_moments.router,
    atmosphere.router,
    examples.router,
    meta.router,
)
