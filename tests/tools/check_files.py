"""Opens a file that Planish wrote with a program of other people's making and prints what that program sees, as JSON.

usage: check_files.py dxf|glb|obj|stl|ply|csv FILE      (exit 3 when the module that reads the form is not installed)
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
    # Part and waste are two geometries over the same vertices; the part comes first.
    geometries = list(scene.geometry.items())
    name, mesh = geometries[0]
    bounds = scene.bounds
    uv = getattr(mesh.visual, "uv", None)
    facts = {
        "name": name,
        "geometries": len(geometries),
        "triangles": len(mesh.faces),
        "all_triangles": sum(len(g.faces) for _, g in geometries),
        "vertices": len(mesh.vertices),
        "attributes": {
            key: [float(numpy.min(value)), float(numpy.max(value))]
            for key, value in mesh.vertex_attributes.items() if key.startswith("_")
        },
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


def loaded(path):
    try:
        import trimesh
    except ImportError:
        sys.exit(3)
    return trimesh.load(path, process=False, maintain_order=True)


def facts_of(mesh):
    return {
        "triangles": len(mesh.faces),
        "vertices": len(mesh.vertices),
        "low": mesh.bounds[0].tolist(),
        "high": mesh.bounds[1].tolist(),
        "area": float(mesh.area),
    }


def obj(path):
    mesh = loaded(path)
    facts = facts_of(mesh)
    uv = mesh.visual.uv
    facts["flat_low"], facts["flat_high"] = uv.min(axis=0).tolist(), uv.max(axis=0).tolist()
    return facts


def stl(path):
    mesh = loaded(path)
    facts = facts_of(mesh)
    # The normals of the file against those of the corners.
    facts["normals"] = float(abs((mesh.face_normals * mesh.triangles_cross).sum(axis=1)).sum() / 2.0)
    return facts


def ply(path):
    mesh = loaded(path)
    facts = facts_of(mesh)
    raw = mesh.metadata["_ply_raw"]
    vertex, face = raw["vertex"]["data"], raw["face"]["data"]
    facts["flat_low"] = [float(vertex["flat_x"].min()), float(vertex["flat_y"].min())]
    facts["flat_high"] = [float(vertex["flat_x"].max()), float(vertex["flat_y"].max())]
    facts["strain"] = [float(face["strain_min"].min()), float(face["strain_max"].max())]
    facts["part"] = int(face["part"].sum())
    facts["normal_x"] = float(vertex["nx"].max())
    return facts


def csv(path):
    import csv as table

    with open(path, newline="", encoding="utf-8") as file:
        rows = list(table.DictReader(file, strict=True))
    return {
        "rows": len(rows),
        "columns": list(rows[0]),
        "area_3d": sum(float(row["area_3d_mm2"]) for row in rows),
        "area_2d": sum(float(row["area_2d_mm2"]) for row in rows),
        "part": sum(int(row["part"]) for row in rows),
        "strain": [
            min(float(row["strain_min_percent"]) for row in rows),
            max(float(row["strain_max_percent"]) for row in rows),
        ],
    }


if __name__ == "__main__":
    readers = {"dxf": dxf, "glb": glb, "obj": obj, "stl": stl, "ply": ply, "csv": csv}
    print(json.dumps(readers[sys.argv[1]](sys.argv[2]), default=str))
