"""The operations of the documentation: their groups, in the order in which one reads them, and a title for each."""

from __future__ import annotations

#: Group -> what its operations are about.
GROUPS = {
    "Designs": "Post a design request, keep the design, read it point by point, set two side by side. Begin here.",
    "Loops": "One controller of a design in the time and frequency domains: loci, responses, margins, norms.",
    "Verdicts and robustness": "What a controller meets, by how much, and how far its gains carry.",
    "Actuators": "Torque, rate, power and energy that the surfaces' actuators must deliver, and which of them do.",
    "Tuning": "Weights, sample times and grid lines searched for by the service.",
    "Schedules and proofs": "Gain-schedule files, gains between the grid points, and proofs of what happens there.",
    "Plant": "Hinge moments, linear models, sweeps and steady states of the plant alone; nothing is kept.",
    "Reference data": "The shipped requests, the spec packs and the atmosphere.",
    "Jobs": "Work above the limits of an answer in line: progress, result, cancelling.",
    "Server": "What this server is, takes and does.",
}

_DESIGN = "/v1/designs/{id}"
_CONTROLLER = "/v1/designs/{id}/controllers/{name}"

#: Group -> method and path of its operations, with a title that reads as a sentence.
_TITLES: dict[str, dict[tuple[str, str], str]] = {
    "Designs": {
        ("post", "/v1/designs"): "Design every controller over the envelope",
        ("get", "/v1/designs"): "List the designs",
        ("get", _DESIGN): "Read a design",
        ("delete", _DESIGN): "Forget a design",
        ("get", f"{_DESIGN}/points"): "Read all grid points, a line each",
        ("get", f"{_DESIGN}/points/{{index}}"): "Read everything about one grid point",
        ("get", f"{_DESIGN}/compare"): "Set two designs or controllers side by side",
        ("get", f"{_DESIGN}/cross-check"): "Check the figures with python-control",
        ("get", f"{_DESIGN}/report"): "Read the report of a design",
        ("post", "/v1/previews"): "Try a request without keeping it",
    },
    "Loops": {
        ("get", f"{_CONTROLLER}/root-locus"): "Follow the poles as one gain grows",
        ("get", f"{_CONTROLLER}/response"): "Respond to the design's reference step",
        ("post", f"{_CONTROLLER}/response"): "Respond to any manoeuvre",
        ("post", f"{_CONTROLLER}/flight-profile"): "Fly a manoeuvre while altitude and speed change",
        ("get", f"{_CONTROLLER}/frequency-response"): "Read loop, sensitivities and transfers over frequency",
        ("get", f"{_CONTROLLER}/phase-plane"): "Follow trajectories in the phase plane",
        ("get", f"{_CONTROLLER}/norms"): "Read H2 and H-infinity norms",
        ("get", f"{_CONTROLLER}/hidden-coupling"): "See what scheduling adds to the linear law",
    },
    "Verdicts and robustness": {
        ("get", f"{_CONTROLLER}/figures"): "Read poles, margins and step figures over the grid",
        ("get", f"{_CONTROLLER}/verdicts"): "Judge every spec at every point",
        ("get", f"{_CONTROLLER}/design-margin"): "See by how much all specs could be stricter",
        ("get", f"{_CONTROLLER}/simultaneous-margins"): "See what both loops stand at once",
        ("get", f"{_CONTROLLER}/cross-flight"): "Fly each point's gains at every other point",
        ("get", f"{_CONTROLLER}/robust-performance"): "Fly the gains on plants that are changed",
        ("get", f"{_CONTROLLER}/worst-case"): "Bound every signal over all references",
        ("get", f"{_CONTROLLER}/worst-case/reference"): "Read the reference that is worst",
    },
    "Actuators": {
        ("get", f"{_CONTROLLER}/actuator-requirements"): "Read what the reference step asks of the actuators",
        ("post", f"{_CONTROLLER}/actuator-requirements"): "Read what any manoeuvre asks of the actuators",
        ("post", f"{_CONTROLLER}/actuator-selection"): "Choose among candidate actuators",
        ("post", f"{_CONTROLLER}/inverse-sizing"): "See which envelope an actuator holds",
        ("get", f"{_CONTROLLER}/limited-tab"): "See what a limited tab leaves to the aileron",
        ("get", f"{_CONTROLLER}/power-comparison"): "Compare with and without weighed power",
        ("get", f"{_DESIGN}/actuation-comparison"): "See what the tab saves the aileron's actuator",
    },
    "Tuning": {
        ("post", f"{_CONTROLLER}/weight-search"): "Search weights that meet specs with least power",
        ("post", f"{_CONTROLLER}/trade-off"): "Trade settling time against torque",
        ("get", f"{_CONTROLLER}/sample-time-sweep"): "Find the slowest sample time that passes",
        ("post", f"{_CONTROLLER}/refinement"): "Find the grid lines that a table needs",
        ("get", f"{_CONTROLLER}/scaling"): "Fit the gains by powers of the flight condition",
    },
    "Schedules and proofs": {
        ("get", f"{_DESIGN}/schedules/{{controller}}.{{suffix}}"): "Download a gain schedule",
        ("get", f"{_CONTROLLER}/gains"): "Read the gains between the grid points",
        ("get", f"{_DESIGN}/verification"): "Prove the cells between the grid points",
        ("get", f"{_CONTROLLER}/certificate"): "Download the proof itself",
        ("post", "/v1/schedules/verify"): "Prove any table of gains",
    },
    "Plant": {
        ("post", "/v1/hinge-moments"): "Compute hinge moments of a section",
        ("post", "/v1/linear-models"): "Compute linear models over a grid",
        ("post", "/v1/eigenvalue-sweeps"): "Sweep the plant's eigenvalues",
        ("post", "/v1/steady-state-maps"): "Map hinge moments and equilibria",
        ("post", "/v1/similarity"): "Scale the plant to another flight condition",
    },
    "Reference data": {
        ("get", "/v1/examples"): "Read the shipped requests",
        ("get", "/v1/examples/{name}"): "Read one shipped request",
        ("get", "/v1/spec-packs"): "Read the spec packs",
        ("get", "/v1/atmosphere"): "Read the standard atmosphere",
    },
    "Jobs": {
        ("get", "/v1/jobs"): "List the jobs",
        ("get", "/v1/jobs/{id}"): "Read a job",
        ("get", "/v1/jobs/{id}/events"): "Follow a job while it runs",
        ("get", "/v1/jobs/{id}/result"): "Read the result of a job",
        ("delete", "/v1/jobs/{id}"): "Cancel or forget a job",
    },
    "Server": {
        ("get", "/v1/version"): "Read the versions",
        ("get", "/v1/limits"): "Read the limits",
        ("get", "/healthz"): "See that the process is up",
        ("get", "/readyz"): "See that the server can work",
        ("get", "/metrics"): "Read the metrics",
    },
}

#: Method and path -> group and title.
TITLES: dict[tuple[str, str], tuple[str, str]] = {
    operation: (group, title) for group, titles in _TITLES.items() for operation, title in titles.items()
}
