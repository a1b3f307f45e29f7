# The platform, and the mail server that comes with it. Built from the repository's root.
FROM debian:bookworm-slim
RUN apt-get -qq update \
 && DEBIAN_FRONTEND=noninteractive apt-get -qq install -y --no-install-recommends bubblewrap python3-venv util-linux >/dev/null \
 && rm -rf /var/lib/apt/lists/*
RUN useradd --create-home --uid 1000 rapp && install -d -o rapp -g rapp /data /mail /pairing/nao1 /pairing/nao2
WORKDIR /opt/rapp
COPY pyproject.toml .
RUN /usr/bin/python3 -m venv .venv \
 && .venv/bin/pip install -q --no-cache-dir --upgrade 'pip>=25.1' \
 && .venv/bin/pip install -q --no-cache-dir --group cloud
ENV PATH=/opt/rapp/.venv/bin:$PATH PYTHONPATH=/opt/rapp/cloud/src
COPY cloud cloud
COPY store store
COPY docker docker
USER rapp
VOLUME /data
EXPOSE 9001
HEALTHCHECK --interval=5s --timeout=5s --start-period=60s \
 CMD ["python", "-c", "import ssl, urllib.request as u; \
u.urlopen('https://127.0.0.1:9001/readyz', timeout=4, context=ssl.create_default_context(cafile='/data/tls/certificate.pem'))"]
ENTRYPOINT ["docker/cloud"]
