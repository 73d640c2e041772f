//! The faces as one mesh, and what is told of their borders.

use std::collections::BTreeMap;

use glam::DVec3;

use super::border::{followed_borders, nearest};
use super::face::{Face, NONE};
use super::meetings::Nodes;
use super::refine::{EdgeOf, Shared};
use super::report::MAX_LISTED;
use super::{Join, JoinedBorder, NearMisses, SewingReport, Tolerances};
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;
use crate::engine::flattening::FlatteningError;
use crate::engine::mesh::assembly::{Assembled, assemble};

/// Borders that are farther apart than the tolerance, but at most so many times, were perhaps meant to meet.
const NEAR_MISS: f64 = 10.0;

/// Borders whose distance changes by more than this part of their length leave each other at a corner: they were not meant to
/// meet.
const PARALLEL: f64 = 0.1;

/// A stretch of border that two faces share, vertex by vertex, walked the same way on both sides.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Run {
    /// The faces.
    pub faces: [u32; 2],
    /// Its vertices in both, in the numbers of [`Assembled::origin_of`]: the same ones where the faces are welded.
    pub vertices: [Vec<u32>; 2],
    /// Its length on the first face, mm.
    pub length_mm: f64,
    /// Greatest distance of its two sides, mm.
    pub gap_mm: f64,
}

/// The faces as one mesh.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sewn {
    /// The mesh.
    pub assembled: Assembled,
    /// What the faces share.
    pub runs: Vec<Run>,
    /// What is told of it. The number of faces that were left out is not known here.
    pub report: SewingReport,
}

/// Welds the faces, or lays them side by side.
pub(super) fn weld(
    faces: &[Face<'_>],
    nodes: &mut Nodes,
    shared: &Shared,
    tolerances: Tolerances,
    observer: &dyn Observer,
) -> Result<Sewn, EngineError> {
    let turned = turned(faces, nodes, shared);
    let welded = tolerances.join == Join::All;
    // Vertices face by face; a joined one stands where the first of it does, in the middle of all.
    let mut number: Vec<Vec<u32>> = Vec::with_capacity(faces.len());
    let mut sums: Vec<(DVec3, f64)> = Vec::new();
    let mut of_node: BTreeMap<u32, u32> = BTreeMap::new();
    for face in faces {
        let numbers = face.positions.iter().zip(&face.node).map(|(&position, &node)| {
            let fresh = sums.len() as u32;
            let k = if welded && node != NONE { *of_node.entry(nodes.root(node)).or_insert(fresh) } else { fresh };
            if k == fresh {
                sums.push((position, 1.0));
            } else {
                let (sum, count) = &mut sums[k as usize];
                *sum += position;
                *count += 1.0;
            }
            k
        });
        number.push(numbers.collect());
    }
    let positions: Vec<DVec3> =
        sums.into_iter().map(|(sum, count)| if count > 1.0 { sum / count } else { sum }).collect();
    let mut triangles = Vec::new();
    for ((face, numbers), &turned) in faces.iter().zip(&number).zip(&turned) {
        triangles.extend(face.triangles.iter().map(|corners| {
            let [a, b, c] = corners.map(|v| numbers[v as usize]);
            if face.reversed == turned { [a, b, c] } else { [a, c, b] }
        }));
    }
    observer.check()?;
    let assembled = assemble(&positions, &triangles, false).map_err(FlatteningError::from)?;
    let once = shared.iter().filter(|(edge, other)| edge < other).map(|(&edge, &other)| (edge, other)).collect();
    let mut stretches = runs(faces, &number, &once);
    let mut report = SewingReport {
        faces: faces.len() as u64,
        faces_turned: turned.iter().filter(|&&turned| turned).count() as u64,
        join: tolerances.join,
        tolerance_mm: tolerances.sewing_mm,
        joined_borders: stretches.len() as u64,
        joined_edges: shared.len() as u64 / 2,
        joined_mm: stretches.iter().map(|run| run.length_mm).sum(),
        greatest_gap_mm: stretches.iter().map(|run| run.gap_mm).fold(0.0, f64::max),
        open_edges: faces.iter().map(|face| face.borders.iter().map(Vec::len).sum::<usize>()).sum::<usize>() as u64
            - shared.len() as u64,
        ..SewingReport::default()
    };
    report.borders = stretches
        .iter()
        .take(MAX_LISTED)
        .map(|run| JoinedBorder { faces: run.faces, length_mm: run.length_mm, gap_mm: run.gap_mm })
        .collect();
    stretches.extend(cut_runs(faces, &number));
    report.near_misses = near_misses(faces, shared, tolerances, observer)?;
    Ok(Sewn { assembled, runs: stretches, report })
}

/// Which faces are to be turned over so that neighbours agree: in each set of faces that hang together those of the
/// smaller area, of equals those that do not agree with the first.
fn turned(faces: &[Face<'_>], nodes: &mut Nodes, shared: &Shared) -> Vec<bool> {
    let mut neighbours: Vec<Vec<(u32, bool)>> = vec![Vec::new(); faces.len()];
    for (&(f, edge), &(g, other)) in shared {
        let mut start = |face: &Face<'_>, edge: u32| nodes.root(face.node[face.ends(edge)[0] as usize]);
        let (a, b) = (&faces[f as usize], &faces[g as usize]);
        let same_way = start(a, edge) == start(b, other);
        // Neighbours that look to the same side run through their edge in opposite directions.
        neighbours[f as usize].push((g, same_way != (a.reversed != b.reversed)));
    }
    let mut turned: Vec<Option<bool>> = vec![None; faces.len()];
    for first in 0..faces.len() {
        if turned[first].is_some() {
            continue;
        }
        turned[first] = Some(false);
        let mut set = vec![first];
        let (mut at, mut balance) = (0, 0.0);
        while let Some(&face) = set.get(at) {
            at += 1;
            let own = turned[face] == Some(true);
            balance += if own { -1.0 } else { 1.0 } * faces[face].area();
            for &(other, disagrees) in &neighbours[face] {
                if turned[other as usize].is_none() {
                    turned[other as usize] = Some(own != disagrees);
                    set.push(other as usize);
                }
            }
        }
        if balance < 0.0 {
            for face in set {
                turned[face] = turned[face].map(|own| !own);
            }
        }
    }
    turned.into_iter().map(|turned| turned == Some(true)).collect()
}

/// The cuts in stretches, as [`runs`].
fn cut_runs(faces: &[Face<'_>], number: &[Vec<u32>]) -> Vec<Run> {
    let mut twins = Shared::new();
    for (f, face) in faces.iter().enumerate() {
        for &edge in face.borders.iter().flatten() {
            if let Some(twin) = face.cut_twin(edge)
                && face.is_along_cut(edge)
            {
                twins.insert((f as u32, edge), (f as u32, twin));
            }
        }
    }
    runs(faces, number, &twins)
}

/// Edges of faces with those on the other side, each pair once, in stretches: in the order of the first face's borders.
fn runs(faces: &[Face<'_>], number: &[Vec<u32>], shared: &Shared) -> Vec<Run> {
    let mut runs = Vec::new();
    for (f, face) in faces.iter().enumerate() {
        for border in &face.borders {
            let first_of_border = runs.len();
            let mut open = false;
            for &edge in border {
                let step = shared.get(&(f as u32, edge)).map(|&other| step(faces, (f as u32, edge), other));
                let Some(step) = step else {
                    open = false;
                    continue;
                };
                let vertices =
                    |side: usize, end: usize| number[step.faces[side] as usize][step.ends[side][end] as usize];
                let [last, next] = [0, 1].map(|end| [vertices(0, end), vertices(1, end)]);
                let goes_on = open
                    && runs.last().is_some_and(|run: &Run| {
                        run.faces == step.faces && (0..2).all(|side| run.vertices[side].last() == Some(&last[side]))
                    });
                if !goes_on {
                    let vertices = last.map(|v| vec![v]);
                    runs.push(Run { faces: step.faces, vertices, length_mm: 0.0, gap_mm: step.gaps[0] });
                }
                open = true;
                if let Some(run) = runs.last_mut() {
                    for (list, v) in run.vertices.iter_mut().zip(next) {
                        list.push(v);
                    }
                    run.length_mm += step.length;
                    run.gap_mm = run.gap_mm.max(step.gaps[1]);
                }
            }
            join_around(&mut runs, first_of_border);
        }
    }
    runs
}

/// Joins the last run of a border to the first where it goes on there.
fn join_around(runs: &mut Vec<Run>, first: usize) {
    if runs.len() < first + 2 {
        return;
    }
    let (start, end) = (&runs[first], &runs[runs.len() - 1]);
    let goes_on = start.faces == end.faces && (0..2).all(|k| start.vertices[k].first() == end.vertices[k].last());
    if !goes_on {
        return;
    }
    if let Some(mut end) = runs.pop() {
        let start = &mut runs[first];
        for (before, after) in end.vertices.iter_mut().zip(&start.vertices) {
            before.extend_from_slice(&after[1..]);
        }
        end.length_mm += start.length_mm;
        end.gap_mm = end.gap_mm.max(start.gap_mm);
        *start = end;
    }
}

/// A shared edge, from its start to its end in the first face.
struct Step {
    faces: [u32; 2],
    /// Start and end in both faces.
    ends: [[u32; 2]; 2],
    length: f64,
    /// Distances of the two starts and of the two ends.
    gaps: [f64; 2],
}

fn step(faces: &[Face<'_>], (f, edge): EdgeOf, (g, other): EdgeOf) -> Step {
    let (a, b) = (&faces[f as usize], &faces[g as usize]);
    let mine = a.ends(edge);
    let mut theirs = b.ends(other);
    let at = |face: &Face<'_>, v: u32| face.positions[v as usize];
    let apart = |theirs: [u32; 2]| [0, 1].map(|k| at(a, mine[k]).distance(at(b, theirs[k])));
    // Joined vertices lie within the tolerance of each other, far less than an edge's length from the other end.
    let [straight, turned] = [theirs, [theirs[1], theirs[0]]].map(|theirs| apart(theirs).iter().sum::<f64>());
    if turned < straight {
        theirs.reverse();
    }
    Step { faces: [f, g], ends: [mine, theirs], length: at(a, mine[0]).distance(at(a, mine[1])), gaps: apart(theirs) }
}

/// Edges of one face alone that run near another one and beside it.
fn near_misses(
    faces: &[Face<'_>],
    shared: &Shared,
    tolerances: Tolerances,
    observer: &dyn Observer,
) -> Result<Option<NearMisses>, EngineError> {
    let reach = NEAR_MISS * tolerances.sewing_mm;
    let tree = followed_borders(faces, tolerances.chord_mm);
    let mut found: Option<NearMisses> = None;
    for (f, face) in faces.iter().enumerate() {
        observer.check()?;
        for &edge in face.borders.iter().flatten() {
            let [a, b] = face.ends(edge).map(|v| face.positions[v as usize]);
            let length = a.distance(b);
            // An edge that runs away from a joint starts near the other face too.
            if shared.contains_key(&(f as u32, edge)) || length <= reach {
                continue;
            }
            let near = |s: f64| {
                let place = face.point(edge, s);
                let mut best: Option<(f64, u32, u32, f64)> = None;
                tree.within(place, reach, |segment| {
                    let (t, distance) = segment.nearest(place);
                    if segment.face != f as u32 && distance <= reach && best.is_none_or(|known| distance < known.0) {
                        let s = segment.s[0] + (segment.s[1] - segment.s[0]) * t;
                        best = Some((distance, segment.face, segment.of, s));
                    }
                });
                best.map(|(_, other, of, s)| nearest(&faces[other as usize], of, place, s).1)
            };
            let [Some(from), Some(gap), Some(to)] = [0.25, 0.5, 0.75].map(near) else { continue };
            if (to - from).abs() > PARALLEL * 0.5 * length {
                continue;
            }
            let missed = found.get_or_insert(NearMisses { edges: 0, length_mm: 0.0, gap_mm: [gap, gap] });
            missed.edges += 1;
            missed.length_mm += length;
            missed.gap_mm = [missed.gap_mm[0].min(gap), missed.gap_mm[1].max(gap)];
        }
    }
    Ok(found)
}
