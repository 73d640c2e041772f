"""Our least distortion beside other programs' on the grids and meshes of ../shared/data, in one run, on one core.

    cargo build --release --example flatten_bin
    PYTHON benches/flattening_against_peers.py [--bin PATH] [--dirs grids,meshes] [--only NAME,..] [--parts balanced,arap,area]

PYTHON is one that has libigl, numpy and scipy; ../shared/peers/README.md says how to get it. A program that is not there is
named in one line and left out. Every flattening is a process of its own; CPU seconds of the call itself on one thread,
the least of 3 (of one, where a call takes more than 5 s). Every map is judged alike, as delivered, by ../shared/peers/metrics.py.

balanced  against libigl's SLIM after 50 iterations. Bars: no flip; mean symmetric Dirichlet energy at most SLIM's times (1 + 1e-9);
          time 1/20 on grids (geometric mean), 1/10 on meshes (median), nowhere above 1/4
arap      against libigl's ARAP after 100 iterations, which may flip. Bars: energy not above, time 1/4
area      the curve of area change against shape change over weights; FreeCAD's face unwrapper (5 relaxations) where it is there
"""
import argparse, glob, math, os, statistics, subprocess, sys, tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(HERE)
SHARED = os.path.join(ROOT, '..', 'shared')
sys.path.insert(0, os.path.join(SHARED, 'peers'))
try:
    import numpy as np
    import flatten_bench as peers
    from glb import read_glb
    from metrics import metrics, tri_local
except ImportError as missing:
    print(f'skipped: {missing}')
    sys.exit(0)

CURVE = ['1:3', '1:1', '3:1', '10:1', '30:1', '100:1']   # weights area:shape


def arap_energy(V, F, UV):
    """area-weighted mean of (s1 - 1)^2 + (s2 - 1)^2, s2 signed"""
    x1, x2, y2, area = tri_local(V, F)
    p, d1, d2 = UV[F[:, 0]], UV[F[:, 1]] - UV[F[:, 0]], UV[F[:, 2]] - UV[F[:, 0]]
    a, c = d1[:, 0] / x1, d1[:, 1] / x1
    b, d = (d2[:, 0] - a * x2) / y2, (d2[:, 1] - c * x2) / y2
    P, Q = np.hypot((a + d) / 2, (c - b) / 2), np.hypot((a - d) / 2, (c + b) / 2)
    if (a * d - b * c).sum() < 0:
        P, Q = Q, P
    sound = area > 1e-14 * area.max()
    return float((area * (2 * (P - 1) ** 2 + 2 * Q ** 2))[sound].sum() / area[sound].sum())


def measured(command, V, F, out, objective=None):
    """(metrics, ARAP energy, CPU seconds), or why not"""
    peers.ENV.pop('OBJECTIVE', None)
    if objective:
        peers.ENV['OBJECTIVE'] = objective
    if os.path.exists(out):
        os.unlink(out)
    answer, error, _ = peers.run(command, 600)
    if error or answer is None or answer.get('error'):
        return None, error or answer['error']
    UV = np.load(out)['UV'] if open(out, 'rb').read(2) == b'PK' else np.fromfile(out).reshape(-1, 2)
    judged = metrics(V, F, UV)
    if 'raw' not in judged:
        return None, judged.get('why', 'no map')
    return (judged, arap_energy(V, F, UV), min(answer['cpu'])), None


def main():
    ap = argparse.ArgumentParser()
    ap.add_argument('--bin', default=os.path.join(ROOT, 'target', 'release', 'examples', 'flatten_bin'))
    ap.add_argument('--dirs', default='grids,meshes'); ap.add_argument('--only', default='')
    ap.add_argument('--parts', default='balanced,arap,area'); a = ap.parse_args()
    if not os.path.isdir(os.path.join(SHARED, 'data')):
        print('skipped: no folder ../shared/data'); return
    if not os.path.exists(a.bin):
        print('skipped: build the example flatten_bin first'); return
    have, missing = peers.available()
    for name, why in missing.items():
        print(f'left out: {name} ({why})')
    ours = lambda td: [a.bin, td + '/m.bin', td + '/ours', '3']
    worker = os.path.join(SHARED, 'peers', 'flatten_worker.py')
    peer = lambda td, method: [peers.FCPY if method.startswith('freecad') else peers.VENV, worker, method, td + '/m.npz', td + '/peer.npz', '3']
    for part, method in (('balanced', 'igl_slim50'), ('arap', 'igl_arap100'), ('area', 'freecad_facewrap')):
        if part not in a.parts.split(','):
            continue
        for folder in a.dirs.split(','):
            if part == 'area' and folder != 'grids':
                continue
            ratios, above = [], []
            print(f'\n{part} on {folder}' + (f' against {method}' if method in have else ''))
            print('| map | triangles | energy | theirs | flips | seconds | theirs | time |' if part != 'area' else '| map | weights | area change % | shape change % | seconds |')
            for path in sorted(glob.glob(os.path.join(SHARED, 'data', folder, '*.glb')), key=os.path.getsize):
                name = os.path.basename(path)[:-4]
                if a.only and name not in a.only.split(','):
                    continue
                V, F = read_glb(path)
                with tempfile.TemporaryDirectory() as td:
                    np.savez(td + '/m.npz', V=V, F=F); peers.binfile(td + '/m.bin', V, F)
                    if part == 'area':
                        for weights in ['area'] + CURVE:
                            found, why = measured(ours(td), V, F, td + '/ours', weights)
                            print(f'| {name} | {weights} | ' + (f"{found[0]['raw']['dA']:.4f} | {found[0]['raw']['dS']:.4f} | {found[2]:.3f} |" if found else f'{why} |'), flush=True)
                        if method in have:
                            found, why = measured(peer(td, method), V, F, td + '/peer.npz')
                            print(f'| {name} | {method} | ' + (f"{found[0]['raw']['dA']:.4f} | {found[0]['raw']['dS']:.4f} | {found[2]:.3f} |" if found else f'{why} |'), flush=True)
                        continue
                    found, why = measured(ours(td), V, F, td + '/ours', part)
                    if not found:
                        print(f'| {name} | {len(F)} | refused: {why} |', flush=True)
                        continue
                    other, reason = measured(peer(td, method), V, F, td + '/peer.npz') if method in have else (None, 'left out')
                    energy = lambda m: m[1] if part == 'arap' else m[0]['raw']['sd_mean'] - 4
                    row = f"| {name} | {len(F)} | {energy(found):.4e} | "
                    if other:
                        ratio = other[2] / max(found[2], 1e-9)
                        row += f"{energy(other):.4e} | {found[0]['flips']} / {other[0]['flips']} | {found[2]:.4f} | {other[2]:.4f} | 1/{ratio:.1f} |"
                        ratios.append(ratio)
                        offset = 0 if part == 'arap' else 4
                        if offset + energy(found) > (offset + energy(other)) * (1 + 1e-9):
                            above.append(name)
                    else:
                        row += f"{reason} | {found[0]['flips']} | {found[2]:.4f} |"
                    print(row, flush=True)
            if ratios:
                mean = math.exp(sum(map(math.log, ratios)) / len(ratios))
                print(f'time: geometric mean 1/{mean:.1f}, median 1/{statistics.median(ratios):.1f}, worst 1/{min(ratios):.1f}; energy above theirs: {", ".join(above) or "none"}')


if __name__ == '__main__':
    main()
