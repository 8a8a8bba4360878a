# The bridge on a robot: a supervisor without ROS on its serial lines. Built from the top of the repository:
#
#   docker build -f deploy/images/bridge.Dockerfile -t robosc-bridge .
#
# A digest pins the base: --build-arg PYTHON_IMAGE=docker.io/library/python:3.12.12-slim-bookworm@sha256:...
ARG PYTHON_IMAGE=docker.io/library/python:3.12.12-slim-bookworm
# The same with a C compiler.
ARG BUILD_IMAGE=docker.io/library/python:3.12.12-bookworm

FROM ${BUILD_IMAGE} AS build
ENV PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_CACHE_DIR=1 PIP_NO_INPUT=1
WORKDIR /build
COPY deploy/requirements-build.txt deploy/requirements-bridge.txt ./
# All packages, also those that build others, are locked by their hashes; no requirement of a package is followed.
RUN python -m venv /build/venv \
    && /build/venv/bin/pip install --no-deps --require-hashes --only-binary :all: -r requirements-build.txt \
    && /build/venv/bin/pip wheel --no-deps --require-hashes --no-build-isolation -r requirements-bridge.txt -w wheels \
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
LABEL org.opencontainers.image.title="RoboSC bridge" \
    org.opencontainers.image.licenses="MIT"
RUN install -d -o 10001 -g 10001 -m 0700 /var/lib/robosc-bridge
COPY --from=build /opt/robosc /opt/robosc
ENV PATH=/opt/robosc/bin:$PATH \
    PYTHONDONTWRITEBYTECODE=1
# The command that starts it adds the group that the serial lines belong to on the robot (--group-add).
USER 10001:10001
WORKDIR /var/lib/robosc-bridge
# The last supervisor of a synthesis server is kept here; the root may be read-only.
VOLUME ["/var/lib/robosc-bridge"]
EXPOSE 50061
STOPSIGNAL SIGTERM
# Any answer will do: a robot that waits for its operator after a fault is no container that a restart would fix.
HEALTHCHECK --interval=30s --timeout=6s --start-period=20s --retries=3 \
    CMD ["robosc-bridge", "health", "--alive", "--config", "/etc/robosc/robot.yaml"]
ENTRYPOINT ["robosc-bridge"]
CMD ["run", "--standby", "--model", "/etc/robosc/robot.rscd", "--config", "/etc/robosc/robot.yaml", "--keep", "/var/lib/robosc-bridge"]
