#!/usr/bin/env python3
"""A million triangles through the service: time of each step and the process's peak memory.

    cargo build --release && load-tests/million_triangles.py [target/release/planish]

A trimmed half cylinder is sent, triangulated on a grid of a million triangles, flattened from one seed with the trimming
loop mapped on, and fetched as GLB. Needs Python alone. The bar: 1 GB of memory.
"""

import json
import math
import subprocess
import sys
import tempfile
import time
import urllib.request

BINARY = sys.argv[1] if len(sys.argv) > 1 else "target/release/planish"
RADIUS, LENGTH = 100.0, 400.0
# Points of the grid: 2 x 123 x 4095 triangles of the base surface. Long cells: sequential flattening is not stable on a
# million square ones, where rounding grows from level to level (docs/flattening.md).
GRID = [124, 4096]


def surface():
    """A half cylinder (rational quadratic) trimmed by an oval."""
    corner = math.sqrt(0.5)
    arc = [(1, 0, 1), (1, 1, corner), (0, 1, 1), (-1, 1, corner), (-1, 0, 1)]
    oval = [[1 + 0.98 * math.cos(a), 0.5 + 0.49 * math.sin(a)] for a in (2 * math.pi * k / 720 for k in range(720))]
    return {
        "name": "trimmed half cylinder",
        "units": "mm",
        "degree_u": 2,
        "degree_v": 1,
        "knots_u": [0, 0, 0, 1, 1, 2, 2, 2],
        "knots_v": [0, 0, 1, 1],
        "control_points": [[[RADIUS * x, RADIUS * y, z] for z in (0, LENGTH)] for x, y, _ in arc],
        "weights": [[w, w] for _, _, w in arc],
        "trims": [[{"points": oval + oval[:1]}]],
    }


def call(url, body=None):
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(url, data, {"Content-Type": "application/json"} if data else {})
    with urllib.request.urlopen(request) as answer:
        return answer.read()


def peak(process):
    """Peak resident memory, MB."""
    with open(f"/proc/{process.pid}/status", encoding="ascii") as status:
        return next(int(line.split()[1]) / 1000 for line in status if line.startswith("VmHWM"))


def main():
    with tempfile.TemporaryDirectory() as data:
        command = [BINARY, "serve", "--listen", "127.0.0.1:0", "--data", data, "--log", "warn"]
        service = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        try:
            address = service.stdout.readline().split()[-1]
            part = json.loads(call(f"{address}/v1/surfaces", surface()))
            job = json.loads(call(f"{address}/v1/jobs", {
                "kind": "flatten",
                "surface": part["id"],
                "triangulation": {"grid": GRID},
                "flattening": {"seed": "centre"},
            }))
            here = f"{address}/v1/jobs/{job['id']}"
            began = time.perf_counter()
            while job["state"] in ("queued", "running"):
                job = json.loads(call(f"{here}?wait=30"))
            took = time.perf_counter() - began
            if job["state"] != "succeeded":
                sys.exit(json.dumps(job, indent=1))
            report = json.loads(call(f"{here}/report.json"))
            before = peak(service)
            began = time.perf_counter()
            glb = call(f"{here}/mesh.glb")
            served = time.perf_counter() - began
            triangles = report["triangulation"]["triangles"]
            print(f"triangles                 {triangles}")
            print(f"job, wall                 {took:.2f} s   {job['timings_ms']}")
            print(f"area change               {report['distortion']['area_change_percent']:.2e} %")
            print(f"GLB                       {len(glb) / 1e6:.1f} MB in {served:.2f} s")
            print(f"peak memory after the job {before:.0f} MB, after the GLB {peak(service):.0f} MB")
            if triangles < 1_000_000:
                sys.exit("fewer than a million triangles: the grid is too coarse")
        finally:
            service.terminate()
            service.wait()


main()
