//! Which border vertices of different faces are one, and which lie on another face's border.

use std::collections::BTreeMap;

use glam::DVec3;

use super::Tolerances;
use super::border::{followed_borders, nearest};
use super::face::{Face, Insertion, NONE};
use super::near::{Near, Segment};
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;

/// Vertices along one border that are closer than this part of the tolerance are one: between the same two faces nothing
/// is gained by edges so short, and triangles on them are needles.
const APART: f64 = 0.1;

/// The most meetings of a vertex and another face's border within the tolerance. Parts have some hundred for each face; a
/// tolerance so large that each vertex meets many borders would take all the memory there is.
const MOST_MEETINGS: usize = 4_000_000;

/// How many segments may be looked at in all: what a part of [`super::MAX_FACES`] takes ten times over.
const MOST_VISITS: usize = 400_000_000;

/// Borders are followed to look for what is near, before distances are found exactly: no finer than this part of the pattern's
/// tolerance, however small that of the sewing is.
const LOOK_SHARE: f64 = 0.25;

/// Vertices that were looked at between two questions whether to go on.
const BETWEEN_CHECKS: usize = 1024;

/// Sets of border vertices that are one.
#[derive(Debug, Default)]
pub(super) struct Nodes {
    parent: Vec<u32>,
    /// For each root the faces that have a vertex in its set, ascending.
    faces: Vec<Vec<u32>>,
}

impl Nodes {
    /// A new set that holds vertices of these faces.
    pub(super) fn add(&mut self, faces: &[u32]) -> u32 {
        self.parent.push(self.parent.len() as u32);
        self.faces.push(faces.to_vec());
        self.parent.len() as u32 - 1
    }

    pub(super) fn root(&mut self, mut of: u32) -> u32 {
        while self.parent[of as usize] != of {
            // Halving the way keeps it short.
            self.parent[of as usize] = self.parent[self.parent[of as usize] as usize];
            of = self.parent[of as usize];
        }
        of
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        if a == b {
            return;
        }
        let (root, other) = (a.min(b), a.max(b));
        self.parent[other as usize] = root;
        let more = std::mem::take(&mut self.faces[other as usize]);
        let faces = &mut self.faces[root as usize];
        faces.extend(more);
        faces.sort_unstable();
        faces.dedup();
    }

    fn has(&mut self, of: u32, face: u32) -> bool {
        let root = self.root(of);
        self.faces[root as usize].binary_search(&face).is_ok()
    }

    fn put(&mut self, of: u32, face: u32) {
        let root = self.root(of);
        let faces = &mut self.faces[root as usize];
        if let Err(at) = faces.binary_search(&face) {
            faces.insert(at, face);
        }
    }
}

/// The refusal of a tolerance within which too much meets.
pub(super) fn too_many() -> EngineError {
    EngineError::Parameter {
        name: "sewing.tolerance_mm".into(),
        detail: "so many borders lie within this distance of each other that they cannot be told apart: set a smaller one, or \
                 send faces that lie on each other once"
            .into(),
    }
}

/// A border vertex.
struct Border {
    face: u32,
    at: DVec3,
}

/// Finds the sets and puts vertices into borders that others' vertices lie on.
pub(super) fn meet(
    faces: &mut [Face<'_>],
    tolerances: Tolerances,
    observer: &dyn Observer,
) -> Result<Nodes, EngineError> {
    let tolerance = tolerances.sewing_mm;
    let mut nodes = Nodes::default();
    let mut all: Vec<Border> = Vec::new();
    for (f, face) in faces.iter_mut().enumerate() {
        let edges: Vec<u32> = face.borders.iter().flatten().copied().collect();
        for edge in edges {
            let [vertex, _] = face.ends(edge);
            if face.node[vertex as usize] == NONE {
                face.node[vertex as usize] = nodes.add(&[f as u32]);
                all.push(Border { face: f as u32, at: face.positions[vertex as usize] });
            }
        }
    }
    join_nearest(&all, tolerance, &mut nodes, observer)?;
    let found = on_borders(faces, &all, tolerances, &mut nodes, observer)?;
    let insertions = settle(faces, &all, &found, tolerance, &mut nodes);
    for (face, along) in faces.iter_mut().zip(insertions) {
        let mut by_edge = vec![Vec::new(); face.edge_count()];
        for (edge, list) in along {
            by_edge[edge as usize] = list.into_iter().map(|(insertion, _)| insertion).collect();
        }
        face.insert(&by_edge);
    }
    Ok(nodes)
}

/// Joins vertices of two faces that are each other's nearest.
fn join_nearest(all: &[Border], tolerance: f64, nodes: &mut Nodes, observer: &dyn Observer) -> Result<(), EngineError> {
    let point = |(k, b): (usize, &Border)| Segment { ends: [b.at; 2], face: b.face, of: k as u32, s: [0.0; 2] };
    let tree = Near::new(all.iter().enumerate().map(point).collect());
    // For each vertex, by face, the nearest of that: the least of equals.
    let mut nearest: Vec<Vec<(u32, u32, f64)>> = Vec::with_capacity(all.len());
    let (mut visits, mut meetings) = (0, 0);
    for (k, vertex) in all.iter().enumerate() {
        if k.is_multiple_of(BETWEEN_CHECKS) {
            observer.check()?;
        }
        let mut of: BTreeMap<u32, (u32, f64)> = BTreeMap::new();
        tree.within(vertex.at, tolerance, |other| {
            visits += 1;
            let distance = vertex.at.distance(other.ends[0]);
            if other.face != vertex.face && distance <= tolerance {
                let known = of.entry(other.face).or_insert((other.of, distance));
                if distance < known.1 {
                    *known = (other.of, distance);
                }
            }
        });
        meetings += of.len();
        if meetings > MOST_MEETINGS || visits > MOST_VISITS {
            return Err(too_many());
        }
        nearest.push(of.into_iter().map(|(face, (other, distance))| (face, other, distance)).collect());
    }
    for (k, of) in nearest.iter().enumerate() {
        for &(_, other, _) in of {
            let mine = all[k].face;
            let back = nearest[other as usize].binary_search_by_key(&mine, |&(face, ..)| face);
            if back.is_ok_and(|at| nearest[other as usize][at].1 == k as u32) {
                nodes.join(k as u32, other);
            }
        }
    }
    Ok(())
}

/// A vertex on another face's border.
struct Meeting {
    vertex: u32,
    face: u32,
    edge: u32,
    s: f64,
    gap: f64,
}

/// The vertices that lie on borders of faces of which they have no vertex yet, nearest first.
fn on_borders(
    faces: &[Face<'_>],
    all: &[Border],
    tolerances: Tolerances,
    nodes: &mut Nodes,
    observer: &dyn Observer,
) -> Result<Vec<Meeting>, EngineError> {
    let tolerance = tolerances.sewing_mm;
    let chord = (0.5 * tolerance).max(LOOK_SHARE * tolerances.chord_mm);
    let tree = followed_borders(faces, chord);
    let mut found = Vec::new();
    let mut visits = 0;
    for (k, vertex) in all.iter().enumerate() {
        if k.is_multiple_of(BETWEEN_CHECKS) {
            observer.check()?;
        }
        let mut of: BTreeMap<u32, (f64, u32, f64)> = BTreeMap::new();
        tree.within(vertex.at, tolerance + chord, |segment| {
            visits += 1;
            let (t, distance) = segment.nearest(vertex.at);
            if segment.face == vertex.face || distance > tolerance + chord {
                return;
            }
            let s = segment.s[0] + (segment.s[1] - segment.s[0]) * t;
            let known = of.entry(segment.face).or_insert((distance, segment.of, s));
            if distance < known.0 {
                *known = (distance, segment.of, s);
            }
        });
        for (face, (_, edge, s)) in of {
            if nodes.has(k as u32, face) {
                continue;
            }
            let (s, gap) = nearest(&faces[face as usize], edge, vertex.at, s);
            if gap <= tolerance {
                found.push(Meeting { vertex: k as u32, face, edge, s, gap });
            }
        }
        if found.len() > MOST_MEETINGS || visits > MOST_VISITS {
            return Err(too_many());
        }
    }
    found.sort_by(|a, b| a.gap.total_cmp(&b.gap).then(a.vertex.cmp(&b.vertex)).then(a.face.cmp(&b.face)));
    Ok(found)
}

/// For a face its edges with what is put into each, in ascending order, and where that lies.
type Along = BTreeMap<u32, Vec<(Insertion, DVec3)>>;

/// Decides what of the meetings becomes a new vertex, and what is joined with one that is there.
fn settle(faces: &[Face<'_>], all: &[Border], found: &[Meeting], tolerance: f64, nodes: &mut Nodes) -> Vec<Along> {
    let apart = APART * tolerance;
    let mut insertions: Vec<Along> = vec![Along::new(); faces.len()];
    for meeting in found {
        let Meeting { vertex, face, edge, s, .. } = *meeting;
        let (mine, at) = (all[vertex as usize].face, all[vertex as usize].at);
        let other = &faces[face as usize];
        let place = other.point(edge, s);
        let end = other.ends(edge).into_iter().find(|&end| place.distance(other.positions[end as usize]) <= apart);
        if let Some(end) = end {
            let node = other.node[end as usize];
            // One vertex of a face is joined there, further ones only when they are the same place.
            if !nodes.has(node, mine) || at.distance(other.positions[end as usize]) <= apart {
                nodes.join(vertex, node);
            }
            continue;
        }
        if nodes.has(vertex, face) {
            continue;
        }
        let along = insertions[face as usize].entry(edge).or_default();
        let next = along.partition_point(|(known, _)| known.s < s);
        let close = [next.checked_sub(1), Some(next)]
            .into_iter()
            .flatten()
            .filter_map(|k| along.get(k))
            .find(|(_, known)| known.distance(place) <= apart)
            .map(|(known, _)| known.node);
        match close {
            Some(node) if !nodes.has(node, mine) => nodes.join(vertex, node),
            Some(_) => {}
            None => {
                nodes.put(vertex, face);
                along.insert(next, (Insertion { s, node: vertex }, place));
            }
        }
    }
    insertions
}
