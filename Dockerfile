# Two stages: wheels are resolved once; the image keeps the environment they make, and neither compilers nor sources.
FROM python:3.13-slim AS build
WORKDIR /app
RUN python -m venv /venv
COPY pyproject.toml README.md LICENSE ./
COPY .ci/constraints.txt .ci/constraints.txt
COPY model model
COPY design design
COPY schedules schedules
COPY service service
RUN /venv/bin/pip install --no-cache-dir --disable-pip-version-check --constraint .ci/constraints.txt '.[dask,hdf5,postgres]'

FROM python:3.13-slim
# A user by number, as orchestrators ask for one that is not root; /data is all that it may write.
RUN groupadd --gid 10001 gainfield \
    && useradd --uid 10001 --gid gainfield --home-dir /data --no-create-home --shell /usr/sbin/nologin gainfield \
    && install --directory --owner=gainfield --group=gainfield --mode=0750 /data
COPY --from=build /venv /venv
USER 10001:10001
WORKDIR /data
# No byte code is written: the root file system may be read-only, with a tmpfs at /tmp.
# One BLAS thread: small matrices are several times slower with more.
ENV PATH=/venv/bin:$PATH \
    HOME=/data \
    PYTHONUNBUFFERED=1 \
    PYTHONDONTWRITEBYTECODE=1 \
    OPENBLAS_NUM_THREADS=1 \
    OMP_NUM_THREADS=1 \
    MKL_NUM_THREADS=1 \
    GAINFIELD_HOST=0.0.0.0 \
    GAINFIELD_PORT=8000 \
    GAINFIELD_DATA_DIR=/data
VOLUME /data
EXPOSE 8000
HEALTHCHECK --interval=30s --timeout=5s --start-period=30s --retries=3 \
    CMD ["python", "-c", "import os, urllib.request as u; u.urlopen(f'http://127.0.0.1:{os.environ[\"GAINFIELD_PORT\"]}/healthz', timeout=4)"]
CMD ["gainfield", "serve"]
