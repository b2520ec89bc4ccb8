"""Settings of the server: where it listens, where it keeps designs, how much work it takes."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field, SecretStr
from pydantic_settings import BaseSettings, SettingsConfigDict


class Settings(BaseSettings):
    """Each is also an environment variable: ``GAINFIELD_`` and the name in capitals."""

    model_config = SettingsConfigDict(env_prefix="GAINFIELD_", extra="ignore", frozen=True)

    host: str = "127.0.0.1"
    port: int = Field(default=8000, ge=0, le=65535)
    data_dir: Path = Path("data")
    database_url: SecretStr | None = None
    retention_days: float | None = Field(default=None, gt=0, description="Days that an unused design is kept")
    max_stored_bytes: int | None = Field(default=None, ge=0, description="Bytes of all designs that are kept")
    job_retention_days: float = Field(default=7.0, gt=0, description="Days that a job is kept after its end")
    housekeeping_s: float = Field(default=300.0, ge=1.0, le=86_400.0)
    require_keys: bool | None = None
    allow_anonymous: bool = False
    anonymous_requests_per_minute: int | None = Field(default=None, ge=1)
    workers: int = Field(default=1, ge=1, le=64)
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    head_timeout_s: float = Field(default=10.0, gt=0.0, le=3600.0)
    body_timeout_s: float = Field(default=10.0, gt=0.0, le=3600.0)
    min_body_rate_b_s: int = Field(default=4096, ge=1)
    idle_timeout_s: float = Field(default=15.0, gt=0.0, le=3600.0)
    stalled_answer_timeout_s: float = Field(default=60.0, gt=0.0, le=3600.0)
    shutdown_timeout_s: int = Field(default=20, ge=1, le=3600)
    min_free_bytes: int = Field(default=64 << 20, ge=0)
    max_body_bytes: int = Field(default=1 << 20, ge=1024, description="Bytes of a request body")
    max_grid_points: int = Field(default=2500, ge=1, description="Points of a grid")
    max_controllers: int = Field(default=16, ge=1, description="Controllers of a design")
    max_point_designs: int = Field(default=7500, ge=1, description="Grid points times controllers of a design")
    max_tab_only_designs: int = Field(
        default=500,
        ge=1,
        description="Searches of a design: grid points times controllers whose gains or powers are sought",
    )
    max_locus_gains: int = Field(default=2000, ge=2, description="Gains of a root locus")
    max_response_samples: int = Field(default=5000, ge=2, description="Samples of a response")
    max_table_rows: int = Field(
        default=20_000,
        ge=1,
        description="Rows of a table of hinge moments, times the fits of a sweep that fits it anew at each value",
    )
    max_map_cells: int = Field(default=50_000, ge=1, description="Grid points times cells of a steady-state map")
    max_sweep_models: int = Field(default=5000, ge=1, description="Grid points times values of an eigenvalue sweep")
    max_flown_loops: int = Field(
        default=50_000,
        ge=1,
        description="Loops flown away from their design: pairs of points, or grid points times perturbed plants",
    )
    max_delayed_loops: int = Field(default=2000, ge=1, description="The same, of controllers with transport delays")
    max_actuator_candidates: int = Field(default=100, ge=1, description="Candidates for one actuator")
    max_manoeuvre_stretches: int = Field(
        default=50_000,
        ge=1,
        description="Stretches of a manoeuvre: grid points times knots, and eight for each period of a sine, of every "
        "design that flies it",
    )
    max_swept_samples: int = Field(
        default=500_000,
        ge=1,
        description="Samples that a sweep of sample times scans: of a step at every grid point and sample time, each "
        "counted as often as the fastest mode of the plant needs a finer mesh there",
    )
    max_step_samples: int = Field(
        default=20_000, ge=1, description="The same, of the step at one grid point and sample time"
    )
    max_simulated_steps: int = Field(
        default=5_000_000,
        ge=1,
        description="Steps of a non-linear simulation: of all points, and 100 times those of the point with most",
    )
    max_worst_case_rows: int = Field(
        default=100_000,
        ge=1,
        description="Rows of guaranteed peaks: grid points times signals times references, each counted the more often "
        "the longer the loop swings",
    )
    max_compared_samples: int = Field(
        default=60_000_000,
        ge=1,
        description="Samples of a comparison: of the step and each of its rate-limited forms, of every controller at "
        "every grid point, as finely as its fastest mode needs for as long as it lasts",
    )
    max_weight_searches: int = Field(
        default=24,
        ge=1,
        description="Searches of weights: grid points, of a trade-off times its settling times",
    )
    max_profile_steps: int = Field(
        default=400_000,
        ge=1,
        description="Steps of a flight over a profile: 20 times as many with a table of hinge moments, 3 times with an "
        "estimate of the error",
    )
    max_refined_points: int = Field(
        default=64, ge=4, description="Points that a refined table may have: lines of altitude times lines of speed"
    )
    max_proof_pieces: int = Field(
        default=30_000,
        ge=1,
        description="Pieces of a proof between grid points: cells times plants times the pieces a cell may be cut into",
    )
    max_cross_checks: int = Field(
        default=40, ge=1, description="Points times controllers of a cross-check with python-control"
    )
    max_compared_points: int = Field(default=200, ge=1, description="Grid points that two designs are compared at")
    max_listed_designs: int = Field(default=200, ge=1, description="Designs on one page of the list")
    max_concurrent_designs: int = Field(default=2, ge=1, description="Designs computed at the same time")
    job_work_factor: int = Field(
        default=40,
        ge=1,
        description="How many times the work in line a job may be: of the limits on grid points, designs, searches, "
        "flown and delayed loops, samples, steps, rows, pieces of a proof and comparisons, not on sizes of answers",
    )
    max_queued_jobs: int = Field(default=100, ge=1, description="Jobs that wait at the same time")
    max_running_jobs: int = Field(default=8, ge=1, description="Jobs that are worked on at the same time")
    job_workers: int = Field(default=2, ge=1, le=256, description="Processes of this machine that work on jobs")
    job_lease_s: float = Field(default=5.0, ge=0.5, le=600.0, allow_inf_nan=False)
    dask: str | None = Field(default=None, description="Address of a Dask scheduler whose workers work on jobs instead")
    dask_allow_insecure: bool = False
    dask_ca_file: Path | None = None
    dask_cert_file: Path | None = None
    dask_key_file: Path | None = None
    max_waiting_designs: int = Field(default=200, ge=1, description="Requests that wait for a computation")
    max_connections: int = Field(default=4096, ge=8, description="Connections of a server process at the same time")
    max_repeatable_answers: int = Field(
        default=10_000, ge=1, description="Answers of an owner kept for their Idempotency-Key, for 24 h each"
    )
    kept_envelopes: int = Field(default=16, ge=1, description="Designs kept ready in memory")
    kept_point_designs: int = Field(
        default=30_000,
        ge=1,
        description="Grid points times controllers of the designs kept ready in memory, some 14 kB each; the design "
        "used last is kept whatever its size",
    )
