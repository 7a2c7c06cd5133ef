# docker build -t undertow . && docker run --rm -v "$PWD":/work undertow simulate examples/own_vehicle.yaml
FROM python:3.12-slim
COPY . /opt/undertow
RUN pip install --no-cache-dir -c /opt/undertow/constraints.txt "/opt/undertow[cluster]"
# Scenarios and results are in the mounted folder; compiled programs are kept outside it.
ENV UNDERTOW_CACHE=/var/cache/undertow
WORKDIR /work
ENTRYPOINT ["undertow"]
CMD ["--help"]
