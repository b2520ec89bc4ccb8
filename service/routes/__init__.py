"""The routes, one file a subject. A route reads its parameters, calls one function of the domain, and answers."""

from service.routes import (
    atmosphere,
    controllers,
    cross_flight,
    designs,
    eigenvalue_sweeps,
    examples,
    frequency_response,
    hinge_moments,
    linear_models,
    meta,
    points,
    robust_performance,
    root_locus,
    similarity,
    spec_packs,
    steady_state_maps,
)
from service.routes import schedules as schedule_files

#: Every router of the API, in the order of the documentation.
ROUTERS = (
    designs.router,
    points.router,
    root_locus.router,
    controllers.router,
    frequency_response.router,
    cross_flight.router,
    robust_performance.router,
    schedule_files.router,
    linear_models.router,
    eigenvalue_sweeps.router,
    steady_state_maps.router,
    similarity.router,
    hinge_moments.router,
    atmosphere.router,
    spec_packs.router,
    examples.router,
    meta.router,
)
