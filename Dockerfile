# docker build -t undertow . && docker run --rm --user "$(id -u):$(id -g)" -v "$PWD":/work undertow simulate examples/thruster_failure.yaml
#
# The tag of the base image moves. To build the same image again, give its digest, which `docker pull python:3.12-slim` prints;
# to refresh it, pull again: docker build --build-arg BASE=python:3.12-slim@sha256:... -t undertow .
ARG BASE=python:3.12-slim
FROM ${BASE}
COPY . /opt/undertow
RUN pip install --no-cache-dir -c /opt/undertow/constraints.txt "/opt/undertow[cluster]"
# Scenarios and results are in the mounted folder; compiled programs are kept outside it, in a folder of each user's own.
RUN useradd --create-home --uid 1000 undertow && install -d -m 1777 /var/cache/undertow
ENV UNDERTOW_CACHE=/var/cache/undertow
USER undertow
WORKDIR /work
ENTRYPOINT ["undertow"]
CMD ["--help"]
