# The synthesis server; also the scheduler and the workers of a Dask cluster for it, which are other commands of the same
# image. Built from the top of the repository:
#
#   docker build -f deploy/images/server.Dockerfile -t robosc-server .
#
# A digest pins the base: --build-arg PYTHON_IMAGE=docker.io/library/python:3.12.12-slim-bookworm@sha256:...
ARG PYTHON_IMAGE=docker.io/library/python:3.12.12-slim-bookworm
# The same with a C compiler.
ARG BUILD_IMAGE=docker.io/library/python:3.12.12-bookworm

FROM ${BUILD_IMAGE} AS build
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1 PIP_NO_INPUT=1
WORKDIR /build
COPY deploy/requirements-build.txt deploy/requirements-server.txt ./
# All packages, also those that build others, are locked by their hashes; no requirement of a package is followed.
RUN python -m venv /build/venv \
    && /build/venv/bin/pip install --no-deps --require-hashes --only-binary :all: -r requirements-build.txt \
    && /build/venv/bin/pip wheel --no-deps --require-hashes --no-build-isolation -r requirements-server.txt -w wheels \
    && python -m venv --without-pip /opt/robosc \
    && /build/venv/bin/pip --python /opt/robosc/bin/python install --no-index --no-deps wheels/*.whl \
    && /build/venv/bin/pip --python /opt/robosc/bin/python check
COPY pyproject.toml README.md LICENSE ./
COPY deploy/build_kernel.py deploy/
COPY robosc robosc
COPY proto/robosc_api proto/robosc_api
COPY server server
COPY client client
COPY bridge bridge
COPY editors/robosc_lsp editors/robosc_lsp
RUN /build/venv/bin/pip wheel --no-build-isolation --no-deps -w own . \
    && /build/venv/bin/pip --python /opt/robosc/bin/python install --no-index --no-deps own/*.whl

FROM ${PYTHON_IMAGE}
LABEL org.opencontainers.image.title="RoboSC synthesis server" \
    org.opencontainers.image.licenses="MIT"
RUN install -d -o 10001 -g 10001 -m 0700 /var/lib/robosc
COPY --from=build /opt/robosc /opt/robosc
# A server that other machines reach wants TLS, ROBOSC_SERVER_TLS_CERTIFICATE and ROBOSC_SERVER_TLS_KEY, or the word
# that the network is trusted.
ENV PATH=/opt/robosc/bin:$PATH \
    PYTHONDONTWRITEBYTECODE=1 \
    ROBOSC_SERVER_HOST=0.0.0.0 \
    ROBOSC_SERVER_LOG_FORMAT=json \
    ROBOSC_SERVER_STATE_DIR=/var/lib/robosc
# A number, since Kubernetes cannot check by a name that the user is not root.
USER 10001:10001
WORKDIR /var/lib/robosc
# All that is ever written: the root may be read-only.
VOLUME ["/var/lib/robosc"]
EXPOSE 50051 9464
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=30s --timeout=6s --start-period=20s --retries=3 CMD ["robosc-server", "health"]
ENTRYPOINT ["robosc-server"]
