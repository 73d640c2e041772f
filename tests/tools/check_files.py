"""Opens a file that Planish wrote with a program of other people's making and prints what that program sees, as JSON.

usage: check_files.py dxf|glb FILE      (exit 3 when the module that reads the form is not installed)
"""

import json
import sys


def dxf(path):
    try:
        import ezdxf
        from ezdxf import recover
    except ImportError:
        sys.exit(3)
    document, auditor = recover.readfile(path)
    strict = ezdxf.readfile(path)
    space = strict.modelspace()
    loops = []
    for line in space.query("POLYLINE"):
        points = [[v.dxf.location.x, v.dxf.location.y] for v in line.vertices]
        area = 0.5 * sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(points, points[1:] + points[:1]))
        loops.append({"layer": line.dxf.layer, "closed": line.is_closed, "points": len(points), "area": area})
    return {
        "version": strict.dxfversion,
        "errors": len(auditor.errors) + len(strict.audit().errors),
        "fixes": len(auditor.fixes) + len(strict.audit().fixes),
        "units": strict.header.get("$INSUNITS"),
        "metric": strict.header.get("$MEASUREMENT"),
        "extent": [list(strict.header["$EXTMIN"])[:2], list(strict.header["$EXTMAX"])[:2]],
        "layers": sorted(layer.dxf.name for layer in strict.layers),
        "loops": loops,
        "texts": [text.plain_text() for text in space.query("TEXT")],
    }


def glb(path):
    try:
        import numpy
        import trimesh
    except ImportError:
        sys.exit(3)
    scene = trimesh.load(path, force="scene")
    (name, mesh), = scene.geometry.items()
    bounds = scene.bounds
    uv = getattr(mesh.visual, "uv", None)
    facts = {
        "name": name,
        "triangles": len(mesh.faces),
        "vertices": len(mesh.vertices),
        "low": bounds[0].tolist(),
        "high": bounds[1].tolist(),
        "area": float(mesh.area),
        "colours": bool(mesh.visual.kind == "vertex") or "color" in mesh.vertex_attributes,
    }
    if uv is not None:
        # trimesh turns v to point up, as its users expect of texture coordinates.
        corners = numpy.asarray(uv)[mesh.faces]
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        u, v = b - a, c - a
        facts["flat_area"] = float(0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum())
    facts["extras"] = mesh.metadata
    return facts


if __name__ == "__main__":
    print(json.dumps({"dxf": dxf, "glb": glb}[sys.argv[1]](sys.argv[2]), default=str))
