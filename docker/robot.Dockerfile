# A robot that stays up: core agent, rosbridge, link and the simulated NAO. Built from the repository's root.
FROM debian:bookworm-slim
RUN useradd --create-home --uid 1000 rapp && install -d -o rapp -g rapp /robot
WORKDIR /opt/rapp
COPY . .
RUN RAPP_GROUP=run ./rapp help >/dev/null && rm -rf /var/lib/apt/lists/*
USER rapp
VOLUME /robot
HEALTHCHECK --interval=10s --timeout=10s --start-period=120s CMD ["./rapp", "status", "--home", "/robot"]
ENTRYPOINT ["docker/robot"]
