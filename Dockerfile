# docker build -t nvhchain . && docker run --rm -v "$PWD:/work" nvhchain run case.toml --fidelity draft
FROM debian:12-slim
RUN apt-get update \
    && apt-get install -y --no-install-recommends python3 python3-venv \
       libgl1 libglu1-mesa libxcursor1 libxft2 libxinerama1 libgomp1 \
    && rm -rf /var/lib/apt/lists/*
RUN python3 -m venv /opt/nvhchain
ENV PATH=/opt/nvhchain/bin:$PATH NUMBA_CACHE_DIR=/tmp/numba
COPY . /src
RUN pip install --no-cache-dir -c /src/constraints.txt setuptools \
    && pip install --no-cache-dir --no-build-isolation -c /src/constraints.txt "/src[pictures,uff,xarray]" \
    && rm -rf /src
WORKDIR /work
ENTRYPOINT ["nvhchain"]
CMD ["doctor"]
