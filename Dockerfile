# The service with its page. The image contains neither a database nor secrets. docker-compose.yml starts it with a database.
FROM python:3.11-slim AS build
WORKDIR /src
COPY . .
RUN pip wheel --no-cache-dir --no-deps --wheel-dir /wheels . \
    && pip wheel --no-cache-dir --require-hashes --no-deps --wheel-dir /wheels --requirement requirements.txt

FROM python:3.11-slim
RUN --mount=type=bind,from=build,source=/wheels,target=/wheels \
    pip install --no-cache-dir --no-index --no-deps /wheels/*.whl \
    && apt-get update && apt-get install --yes --no-install-recommends postgresql-client && rm -rf /var/lib/apt/lists/* \
    && useradd --system --uid 10001 --groups dialout --create-home --home-dir /var/lib/kata kata \
    && install --directory --owner kata --group kata --mode 0700 /var/lib/kata-shared
USER kata
ENV KATA_DATA=/var/lib/kata \
    KATA_HOST=0.0.0.0 \
    KATA_PORT=8000 \
    PYTHONUNBUFFERED=1
VOLUME /var/lib/kata
EXPOSE 8000
# KATA_ALLOWED_HOSTS lists the names by which browsers reach the service. It uses TLS: with the clinic's certificate if KATA_TLS_CERTIFICATE
# and KATA_TLS_KEY name one, else with its own. The health check does not verify the certificate, because only the container itself
# uses its loopback address.
# Stopping takes time: ramp down, journal, import.
STOPSIGNAL SIGINT
HEALTHCHECK --interval=10s --timeout=3s --start-period=20s \
    CMD ["python", "-c", "import ssl, urllib.request as r; r.urlopen('https://127.0.0.1:8000/health/live', timeout=2, context=ssl._create_unverified_context())"]
ENTRYPOINT ["kata"]
CMD ["serve"]
