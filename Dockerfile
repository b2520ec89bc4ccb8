# Two stages: wheels are resolved once, the image keeps the environment and the checkout only.
FROM python:3.13-slim AS build
WORKDIR /app
COPY pyproject.toml README.md LICENSE ./
COPY .ci/constraints.txt .ci/constraints.txt
COPY model model
COPY design design
COPY schedules schedules
COPY service service
RUN python -m venv /venv \
    && /venv/bin/pip install --no-cache-dir --constraint .ci/constraints.txt .

FROM python:3.13-slim
RUN useradd --system --uid 10001 --home-dir /data --create-home gainfield
COPY --from=build /venv /venv
USER gainfield
WORKDIR /data
ENV PATH=/venv/bin:$PATH PYTHONUNBUFFERED=1 \
    OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 \
    GAINFIELD_HOST=0.0.0.0 GAINFIELD_PORT=8000 GAINFIELD_DATA_DIR=/data
VOLUME /data
EXPOSE 8000
HEALTHCHECK --interval=30s --timeout=5s --start-period=20s --retries=3 \
    CMD ["python", "-c", "import urllib.request as u; u.urlopen('http://127.0.0.1:8000/healthz', timeout=4)"]
CMD ["python", "-m", "service"]
