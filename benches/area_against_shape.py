"""The curve of area change against shape change over our weights, with other programs' points, as a picture.

    cargo build --release --example flatten_bin
    PYTHON benches/area_against_shape.py docs/area-against-shape.svg [--bin PATH]

PYTHON and the other programs: see flattening_against_peers.py. For each grid of ../shared/data/grids one plot with
logarithmic axes; printed are, for each point of another program, whether a point of ours is at least as good in both.
"""
import argparse, glob, math, os, tempfile

from flattening_against_peers import ROOT, SHARED, measured, np, peers, read_glb

WEIGHTS = ['1:10', '1:3', '1:1', '2:1', '3:1', '6:1', '10:1', '30:1', '100:1', '300:1']
OTHERS = {'igl_lscm': ('LSCM at its best size, libigl', '#8a6d3b'), 'igl_arap100': ('ARAP 100, libigl', '#1b7837'),
          'igl_slim50': ('SLIM 50, libigl', '#762a83'), 'cgal_arap': ('ARAP, CGAL', '#5aae61'),
          'freecad_facewrap': ('face unwrapper, FreeCAD', '#c51b1b')}
OURS = '#1f5fa8'
SIDE, GAP, COLUMNS = 250, 62, 3
NOTHING = 1e-3   # percent; grids with less have nothing to trade


def axis(values):
    low, high = math.log10(min(values)), math.log10(max(values))
    pad = max(0.08 * (high - low), 0.05)
    return low - pad, high + pad


def ticks(low, high):
    found = [m * 10.0 ** e for e in range(math.floor(low), math.ceil(high) + 1) for m in (1, 2, 5)]
    return [t for t in found if low <= math.log10(t) <= high]


def plot(name, curve, points, left, top):
    xs, ys = axis([p[1] for p in curve + points]), axis([p[0] for p in curve + points])
    x = lambda v: left + SIDE * (math.log10(v) - xs[0]) / (xs[1] - xs[0])
    y = lambda v: top + SIDE * (ys[1] - math.log10(v)) / (ys[1] - ys[0])
    out = [f'<rect x="{left}" y="{top}" width="{SIDE}" height="{SIDE}" fill="none" stroke="#999"/>',
           f'<text x="{left}" y="{top - 8}" font-weight="bold">{name}</text>']
    for t in ticks(*xs):
        out.append(f'<text x="{x(t):.1f}" y="{top + SIDE + 14}" text-anchor="middle">{t:g}</text>'
                   f'<path d="M{x(t):.1f} {top}v{SIDE}" stroke="#ececec"/>')
    for t in ticks(*ys):
        out.append(f'<text x="{left - 4}" y="{y(t) + 4:.1f}" text-anchor="end">{t:g}</text>'
                   f'<path d="M{left} {y(t):.1f}h{SIDE}" stroke="#ececec"/>')
    line = ' '.join(f'{x(s):.1f},{y(a):.1f}' for a, s, _ in curve)
    out.append(f'<polyline points="{line}" fill="none" stroke="{OURS}" stroke-width="1.5"/>')
    out += [f'<circle cx="{x(s):.1f}" cy="{y(a):.1f}" r="2.5" fill="{OURS}"/>' for a, s, _ in curve]
    out += [f'<circle cx="{x(s):.1f}" cy="{y(a):.1f}" r="4.5" fill="{OTHERS[m][1]}"/>' for a, s, m in points]
    return out


def main():
    ap = argparse.ArgumentParser()
    ap.add_argument('out'); ap.add_argument('--bin', default=os.path.join(ROOT, 'target', 'release', 'examples', 'flatten_bin'))
    a = ap.parse_args()
    have, missing = peers.available()
    for name, why in missing.items():
        print(f'left out: {name} ({why})')
    worker = os.path.join(SHARED, 'peers', 'flatten_worker.py')
    plots = []
    print('| grid | program | area change % | shape change % | ours at least as good in both |')
    for path in sorted(glob.glob(os.path.join(SHARED, 'data', 'grids', '*.glb'))):
        name = os.path.basename(path)[:-4]
        V, F = read_glb(path)
        with tempfile.TemporaryDirectory() as td:
            np.savez(td + '/m.npz', V=V, F=F); peers.binfile(td + '/m.bin', V, F)
            # A conformal map has no size of its own: it is taken at its best one.
            size = lambda label: 'scaled' if label == 'igl_lscm' else 'raw'
            point = lambda judged, label: (judged[0][size(label)]['dA'], judged[0][size(label)]['dS'], label)
            curve = [point(measured([a.bin, td + '/m.bin', td + '/ours', '1'], V, F, td + '/ours', w)[0], w) for w in WEIGHTS]
            if max(p[0] for p in curve) < NOTHING:
                print(f'| {name} | nothing to trade | {max(p[0] for p in curve):.1e} | | |')
                continue
            points = []
            for method in OTHERS:
                if method not in have:
                    continue
                command = ([peers.CGAL, method[5:], td + '/m.bin', td + '/peer', '1'] if method.startswith('cgal') else
                           [peers.FCPY if method.startswith('freecad') else peers.VENV, worker, method, td + '/m.npz', td + '/peer.npz', '1'])
                found, why = measured(command, V, F, command[-2])
                if not found:
                    print(f'| {name} | {method} | {why} | | |')
                    continue
                points.append(point(found, method))
                best = [p[2] for p in curve if p[0] <= points[-1][0] and p[1] <= points[-1][1]]
                print(f'| {name} | {method} | {points[-1][0]:.4f} | {points[-1][1]:.4f} | {", ".join(best) or "NONE"} |', flush=True)
        plots.append((name, curve, points))
    rows = math.ceil(len(plots) / COLUMNS)
    width, height = COLUMNS * (SIDE + GAP) + GAP, rows * (SIDE + GAP) + 70
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" font-size="11">',
           f'<rect width="{width}" height="{height}" fill="white"/>',
           f'<text x="{GAP}" y="18">Change of area in percent (upwards) against change of lengths in percent; less is better</text>']
    legend = [('ours, weights area : shape from 1:10 to 300:1', OURS)] + list(OTHERS.values())
    for k, (label, colour) in enumerate(legend):
        x, y = GAP + (k % 3) * 300, 36 + 16 * (k // 3)
        out.append(f'<circle cx="{x + 4}" cy="{y - 4}" r="4" fill="{colour}"/><text x="{x + 14}" y="{y}">{label}</text>')
    for k, (name, curve, points) in enumerate(plots):
        out += plot(name, curve, points, GAP + (k % COLUMNS) * (SIDE + GAP), 84 + (k // COLUMNS) * (SIDE + GAP))
    with open(a.out, 'w') as file:
        file.write('\n'.join(out + ['</svg>', '']))


if __name__ == '__main__':
    main()
