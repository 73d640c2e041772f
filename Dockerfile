# Build: the toolchain stays behind in this stage.
FROM rust:1.95-slim-bookworm AS build
RUN apt-get update && apt-get install -y --no-install-recommends gcc libc6-dev && rm -rf /var/lib/apt/lists/*
WORKDIR /build
COPY Cargo.toml Cargo.lock ./
COPY migrations ./migrations
COPY openapi.yaml ./
COPY src ./src
# The manifest names benches, examples and tests; cargo wants their files to exist even when they are not built.
COPY benches ./benches
COPY examples ./examples
COPY tests ./tests
RUN cargo build --release --locked --bin planish

# Run: the binary, a user without rights, a volume for the data.
FROM debian:bookworm-slim
RUN useradd --system --uid 10001 --no-create-home planish && install -d -o planish -g planish /data
COPY --from=build /build/target/release/planish /usr/local/bin/planish
USER planish
ENV PLANISH_LISTEN=0.0.0.0:8080 \
    PLANISH_OPEN=true \
    PLANISH_DATA=/data
VOLUME /data
EXPOSE 8080
HEALTHCHECK --interval=10s --timeout=3s --start-period=5s CMD ["planish", "health"]
STOPSIGNAL SIGTERM
ENTRYPOINT ["planish"]
CMD ["serve"]
