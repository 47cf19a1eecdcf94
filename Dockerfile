# The service with its page. The image holds no database and no secrets; see docker-compose.yml.
FROM python:3.11-slim AS build
WORKDIR /src
COPY . .
RUN pip wheel --no-cache-dir --no-deps --wheel-dir /wheels . \
    && pip wheel --no-cache-dir --require-hashes --wheel-dir /wheels --requirement requirements.txt

FROM python:3.11-slim
RUN --mount=type=bind,from=build,source=/wheels,target=/wheels \
    pip install --no-cache-dir --no-index --no-deps /wheels/*.whl \
    && useradd --system --uid 10001 --groups dialout --create-home --home-dir /var/lib/kata kata
USER kata
ENV KATA_DATA=/var/lib/kata \
    KATA_HOST=0.0.0.0 \
    KATA_PORT=8000 \
    PYTHONUNBUFFERED=1
VOLUME /var/lib/kata
EXPOSE 8000
# A stop needs time: ramp down, journal, import.
STOPSIGNAL SIGINT
HEALTHCHECK --interval=10s --timeout=3s --start-period=20s \
    CMD ["python", "-c", "import urllib.request as r; r.urlopen('http://127.0.0.1:8000/api/health', timeout=2)"]
ENTRYPOINT ["kata"]
CMD ["serve"]
