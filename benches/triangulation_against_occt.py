"""Our triangulation beside OpenCASCADE's BRepMesh on the real faces, in one run, on one core.

    cargo build --release --example triangulate_bin
    PYTHON benches/triangulation_against_occt.py [--rel 1e-3,1e-4] [--bin PATH] [--only NAME,..] [--out FILE]

PYTHON is one that has OCP (cadquery-ocp-novtk 7.9), numpy and scipy; ../shared/peers/README.md says how to get it. For every face
and every relative deflection OpenCASCADE meshes first (linear deflection = rel * diagonal, angular 0.5 rad, its default).
Its mesh is judged: the greatest distance from mesh to surface and from trimming curves to the mesh's border. It may
miss the asked deflection or overshoot it, so our mesh is then made with what it *achieved* as the tolerance, and judged in the same way;
where ours achieves less than that, it is made again with a tolerance that is smaller by as much. A face whose border
and surface are exact in either mesh is compared at the deflection asked for.

The judge is no part of either program: B-splines in numpy, seven or more samples a triangle (all triangles up to SAMPLED, then a
random choice with a fixed seed), each moved to its foot point by two steps of Gauss and Newton. CPU time: OpenCASCADE's process time, least of 3;
ours the least of several runs on one thread (see examples/triangulate_bin.rs). Reading files is in neither.

Bars: triangles, median of ours / theirs <= 1.5; CPU, geometric mean of ours / theirs <= 1/50 and none above 1/10.
"""
import argparse, glob, json, math, os, statistics, subprocess, sys, tempfile, time

HERE = os.path.dirname(os.path.abspath(__file__))
SHARED = os.path.join(os.path.dirname(HERE), '..', 'shared')
sys.path.insert(0, os.path.join(SHARED, 'peers'))
import numpy as np
from scipy.spatial import cKDTree

SAMPLED = 20_000        # triangles beyond which a random choice is judged
CURVE_SAMPLES = 96      # samples a knot span of a trimming curve
EXACT = 1e-9            # of the diagonal: below this an error is rounding


# ---------------------------------------------------------------- the judge's own B-splines
def basis(p, U, t, order):
    """values (n, p+1) of the functions and, with order 1, their derivatives; first[n] = index of the first"""
    n = len(U) - p - 1
    k = np.clip(np.searchsorted(U, t, side='right') - 1, p, n - 1)
    while True:                                           # never an empty span
        empty = (U[k] == U[k + 1]) & (k > p)
        if not empty.any(): break
        k = np.where(empty, k - 1, k)
    N = np.zeros((len(t), p + 1)); N[:, 0] = 1.0
    low = N
    for d in range(1, p + 1):
        if d == p: low = N.copy()
        M = np.zeros_like(N)
        for r in range(d):
            a, b = U[k + 1 + r], U[k + 1 + r - d]
            w = np.where(a > b, N[:, r] / np.where(a > b, a - b, 1.0), 0.0)
            M[:, r] += (a - t) * w; M[:, r + 1] += (t - b) * w
        N = M
    if order == 0: return k - p, N, None
    D = np.zeros_like(N)
    for r in range(p):
        a, b = U[k + 1 + r], U[k + 1 + r - p]
        w = np.where(a > b, p * low[:, r] / np.where(a > b, a - b, 1.0), 0.0)
        D[:, r] -= w; D[:, r + 1] += w
    return k - p, N, D


class Surface:
    def __init__(self, d):
        self.p, self.q = d['degree_u'], d['degree_v']
        self.U, self.V = np.array(d['knots_u']), np.array(d['knots_v'])
        P = np.array(d['control_points'], float)
        W = np.array(d['weights'], float) if d.get('weights') else np.ones(P.shape[:2])
        self.centre = P.reshape(-1, 3).mean(0)
        self.H = np.concatenate([(P - self.centre) * W[..., None], W[..., None]], 2)
        self.box = (self.U[self.p], self.U[-self.p - 1], self.V[self.q], self.V[-self.q - 1])

    def at(self, uv):
        """S, Su, Sv"""
        u = np.clip(uv[:, 0], *self.box[:2]); v = np.clip(uv[:, 1], *self.box[2:])
        i, A, Au = basis(self.p, self.U, u, 1); j, B, Bv = basis(self.q, self.V, v, 1)
        out = [np.zeros((len(u), 4)) for _ in range(3)]
        for a in range(self.p + 1):
            row = np.zeros((len(u), 4)); row_v = np.zeros((len(u), 4))
            for b in range(self.q + 1):
                h = self.H[i + a, j + b]
                row += B[:, b, None] * h; row_v += Bv[:, b, None] * h
            out[0] += A[:, a, None] * row; out[1] += Au[:, a, None] * row; out[2] += A[:, a, None] * row_v
        w = out[0][:, 3:]
        S = out[0][:, :3] / w
        return S + self.centre, (out[1][:, :3] - out[1][:, 3:] * S) / w, (out[2][:, :3] - out[2][:, 3:] * S) / w

    def distance(self, X, uv):
        """of points X to the surface near uv"""
        best = np.full(len(X), np.inf); uv = uv.copy()
        for _ in range(3):
            S, Su, Sv = self.at(uv); d = X - S
            best = np.minimum(best, np.linalg.norm(d, axis=1))
            e, f, g = (Su * Su).sum(1), (Su * Sv).sum(1), (Sv * Sv).sum(1)
            det = e * g - f * f; ok = det > 1e-16 * e * g; det = np.where(ok, det, 1.0)
            x, y = (Su * d).sum(1), (Sv * d).sum(1)
            uv[:, 0] += np.where(ok, (g * x - f * y) / det, 0.0); uv[:, 1] += np.where(ok, (e * y - f * x) / det, 0.0)
            uv[:, 0] = np.clip(uv[:, 0], *self.box[:2]); uv[:, 1] = np.clip(uv[:, 1], *self.box[2:])
        return best


def curve_points(c):
    U = np.array(c['knots'], float); p = c['degree']; P = np.array(c['control_points'], float)
    W = np.array(c['weights'], float) if c.get('weights') else np.ones(len(P))
    spans = np.unique(U[p:len(U) - p])
    n = max(4, min(CURVE_SAMPLES, 4000 // (len(spans) - 1)))
    t = np.unique(np.concatenate([np.linspace(a, b, n + 1) for a, b in zip(spans[:-1], spans[1:])]))
    first, N, _ = basis(p, U, t, 0)
    num = sum(N[:, r, None] * (P * W[:, None])[first + r] for r in range(p + 1))
    return num / sum(N[:, r] * W[first + r] for r in range(p + 1))[:, None]


WEIGHTS = np.array([(.5, .5, 0), (0, .5, .5), (.5, 0, .5), (1 / 3, 1 / 3, 1 / 3), (.6, .2, .2), (.2, .6, .2), (.2, .2, .6), (.4, .4, .2), (.2, .4, .4), (.4, .2, .4),
                    (.75, .25, 0), (.25, .75, 0), (0, .75, .25), (0, .25, .75), (.75, 0, .25), (.25, 0, .75)])


def judge(d, S, V, UV, F):
    """(greatest distance mesh - surface, greatest distance trimming curve - border of the mesh)"""
    pick = np.random.default_rng(0).choice(len(F), SAMPLED, replace=False) if len(F) > SAMPLED else np.arange(len(F))
    x, uv = V[F[pick]], UV[F[pick]]
    for corner in range(3):               # a pole has one vertex and many places: take the one between the others'
        _, Su, Sv = S.at(uv[:, corner]); lu, lv = np.linalg.norm(Su, axis=1), np.linalg.norm(Sv, axis=1)
        others = uv[:, [c for c in range(3) if c != corner]].mean(1)
        for k, (mine, other) in enumerate(((lu, lv), (lv, lu))):
            pole = mine < 1e-6 * other * (S.box[3] - S.box[2] if k == 0 else S.box[1] - S.box[0]) / (S.box[1] - S.box[0] if k == 0 else S.box[3] - S.box[2])
            uv[pole, corner, k] = others[pole, k]
    above = max(float(S.distance(np.einsum('k,nkc->nc', w, x), np.einsum('k,nkc->nc', w, uv)).max()) for w in WEIGHTS)
    E = np.sort(np.vstack([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), 1)
    E, count = np.unique(E, axis=0, return_counts=True)
    border = E[count == 1]
    if len(border) == 0: return above, 0.0
    # Only curves that bound the part: one that a loop walks twice (a seam) is no border of a mesh that is joined there.
    curves = [S.at(curve_points(c))[0] for loop in d['trims'] for c in loop]
    diag = math.dist(*d['bbox'])
    keep = []
    for k, a in enumerate(curves):
        twin = any(k != m and min(np.abs(a[[0, len(a) // 2, -1]] - b[[0, len(b) // 2, -1]]).max(), np.abs(a[[0, len(a) // 2, -1]] - b[[-1, len(b) // 2, 0]]).max()) < 1e-5 * diag
                   for m, b in enumerate(curves) if len(a) == len(b))
        if not twin: keep.append(a)
    if not keep: return above, 0.0
    X = np.vstack(keep); a, b = V[border[:, 0]], V[border[:, 1]]
    middle = cKDTree(0.5 * (a + b)); best = np.full(len(X), np.inf)
    _, near = middle.query(X, k=min(12, len(border)))
    near = np.atleast_2d(near.T).T if near.ndim == 1 else near
    for k in range(near.shape[1]):
        p, q = a[near[:, k]], b[near[:, k]]
        l = ((q - p) ** 2).sum(1); t = np.clip(((X - p) * (q - p)).sum(1) / np.where(l > 0, l, 1), 0, 1)
        best = np.minimum(best, np.linalg.norm(X - p - t[:, None] * (q - p), axis=1))
    far = best > 0.0                      # long edges: the nearest middle need not be the nearest edge; look at all where few
    if len(border) <= 3000:
        for lo in range(0, len(X), 500):
            P = X[lo:lo + 500, None]; l = ((b - a) ** 2).sum(1)
            t = np.clip(((P - a) * (b - a)).sum(2) / np.where(l > 0, l, 1), 0, 1)
            best[lo:lo + 500] = np.linalg.norm(P - a - t[..., None] * (b - a), axis=2).min(1)
    return above, float(best.max())


# ---------------------------------------------------------------- the two programs
def occt(path, tolerance, reps=3):
    from occt_json import load_face, BRepTools, TopLoc_Location, BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    d, f = load_face(path); cpu = []
    for _ in range(reps):
        BRepTools.Clean_s(f)
        c = time.process_time(); BRepMesh_IncrementalMesh(f, tolerance, False, 0.5, False); cpu.append(time.process_time() - c)
    T = BRep_Tool.Triangulation_s(f, TopLoc_Location())
    if T is None: return None
    V = np.array([(p.X(), p.Y(), p.Z()) for p in (T.Node(i) for i in range(1, T.NbNodes() + 1))])
    UV = np.array([(p.X(), p.Y()) for p in (T.UVNode(i) for i in range(1, T.NbNodes() + 1))])
    F = np.array([T.Triangle(i).Get() for i in range(1, T.NbTriangles() + 1)], np.int64).reshape(-1, 3) - 1
    return d, V, UV, F, min(cpu)


class Ours:
    def __init__(self, binary):
        self.p = subprocess.Popen([binary], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
        self.out = tempfile.NamedTemporaryFile(suffix='.mesh', delete=False).name

    def mesh(self, path, tolerance):
        self.p.stdin.write(json.dumps(dict(path=path, tolerance=tolerance, out=self.out)) + '\n'); self.p.stdin.flush()
        line = self.p.stdout.readline()
        r = json.loads(line) if line.startswith('{') else dict(ok=False, why='the program ended')
        if not r['ok']: return r, None
        raw = open(self.out, 'rb').read(); nv, nf = np.frombuffer(raw, np.uint64, 2).astype(int)
        V = np.frombuffer(raw, float, 3 * nv, 16).reshape(-1, 3); UV = np.frombuffer(raw, float, 2 * nv, 16 + 24 * nv).reshape(-1, 2)
        return r, (V, UV, np.frombuffer(raw, np.uint32, 3 * nf, 16 + 40 * nv).reshape(-1, 3).astype(np.int64))


def compare(ours, path, rel):
    d = json.load(open(path)); d.update(d.pop('extra', {}))
    diag = math.dist(*d['bbox']); S = Surface(d)
    row = dict(name=d['name'], rel=rel, ok=False)
    theirs = occt(path, rel * diag)
    if theirs is None: return dict(row, why='OpenCASCADE made no mesh')
    _, V, UV, F, cpu = theirs
    above, beside = judge(d, S, V, UV, F); achieved = max(above, beside)
    row.update(occt_tri=len(F), occt_cpu=cpu, occt_error=achieved / diag, occt_above=above / diag)
    target = achieved if achieved > EXACT * diag else rel * diag
    tolerance = target
    for _ in range(3):
        r, mesh = ours.mesh(path, tolerance)
        if mesh is None: return dict(row, why=r['why'])
        a, b = judge(d, S, *mesh); got = max(a, b)
        if got <= 1.02 * target: break
        tolerance *= 0.97 * target / got
    return dict(row, ok=True, tri=len(mesh[2]), cpu=r['cpu'], error=got / diag, above=a / diag, tri_ratio=len(mesh[2]) / len(F), cpu_ratio=r['cpu'] / cpu,
                within=got <= 1.02 * target, area=abs(r['area'] - d['area_occt']) / d['area_occt'])


def main():
    a = argparse.ArgumentParser(); a.add_argument('--rel', default='1e-3,1e-4'); a.add_argument('--only', default=''); a.add_argument('--out')
    a.add_argument('--bin', default=os.path.join(os.path.dirname(HERE), 'target', 'release', 'examples', 'triangulate_bin')); a = a.parse_args()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    ours = Ours(a.bin); rows = []
    print('%-40s %6s  %7s %7s %6s  %9s %9s  %9s %9s %6s' % ('face', 'rel', 'occt', 'ours', 'ratio', 'occt err', 'our err', 'occt ms', 'our ms', '1 in'))
    for rel in map(float, a.rel.split(',')):
        for path in sorted(glob.glob(os.path.join(SHARED, 'data', 'surfaces', '*.json'))):
            if a.only and not any(n in path for n in a.only.split(',')): continue
            r = compare(ours, path, rel); rows.append(r)
            if r['ok']:
                print('%-40s %6.0e  %7d %7d %6.2f  %9.2e %9.2e  %9.3f %9.4f %6.0f%s' % (r['name'][:40], rel, r['occt_tri'], r['tri'], r['tri_ratio'], r['occt_error'], r['error'],
                      1e3 * r['occt_cpu'], 1e3 * r['cpu'], 1 / r['cpu_ratio'], '' if r['within'] else '  NOT WITHIN'), flush=True)
            else:
                print('%-40s %6.0e  %s' % (r['name'][:40], rel, r['why']), flush=True)
                if r['why'] == 'the program ended': ours = Ours(a.bin)
    for rel in list(map(float, a.rel.split(','))) + [None]:
        ok = [r for r in rows if r['ok'] and rel in (None, r['rel'])]
        if not ok: continue
        print(json.dumps(dict(rel=rel or 'all', faces=sum(rel in (None, r['rel']) for r in rows), compared=len(ok), not_within=sum(not r['within'] for r in ok),
              triangles_median=round(statistics.median(r['tri_ratio'] for r in ok), 3), triangles_worst=round(max(r['tri_ratio'] for r in ok), 2),
              cpu_one_in_geometric_mean=round(1 / math.exp(statistics.fmean(math.log(r['cpu_ratio']) for r in ok)), 1), cpu_one_in_worst=round(1 / max(r['cpu_ratio'] for r in ok), 1),
              area_error_median=statistics.median(r['area'] for r in ok), area_error_worst=max(r['area'] for r in ok))))
    if a.out: json.dump(rows, open(a.out, 'w'), indent=1)


if __name__ == '__main__':
    main()
