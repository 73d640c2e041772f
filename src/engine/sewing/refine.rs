//! Which edges of borders are shared, and all border edges followed as finely as the pattern's curves, shared ones alike.

use std::collections::{BTreeMap, BTreeSet};

use super::border::{followed, nearest};
use super::face::{Face, Insertion};
use super::meetings::Nodes;
use super::{Join, Tolerances};
use crate::engine::budget::Observer;
use crate::engine::error::EngineError;

/// The most edges between the same two vertices that are compared with each other. Faces that lie on each other in such
/// numbers are no part.
const MOST_COMPARED: usize = 64;

/// Places at which the nearest point of a curve is looked for before it is found exactly.
const LOOKS: u32 = 16;

/// An edge of a face's border.
pub(super) type EdgeOf = (u32, u32);

/// Edges of two faces that are one; each stands for the other.
pub(super) type Shared = BTreeMap<EdgeOf, EdgeOf>;

/// Refines borders and gives the edges that are shared in the end.
pub(super) fn refine(
    faces: &mut [Face<'_>],
    nodes: &mut Nodes,
    tolerances: Tolerances,
    observer: &dyn Observer,
) -> Result<Shared, EngineError> {
    let mut partners = Shared::new();
    let mut to_part: BTreeSet<EdgeOf> = BTreeSet::new();
    for group in groups(faces, nodes) {
        observer.check()?;
        pair(faces, &group, tolerances.sewing_mm, &mut partners, &mut to_part);
    }
    let mut insertions: Vec<Vec<Vec<Insertion>>> =
        faces.iter().map(|face| vec![Vec::new(); face.edge_count()]).collect();
    for f in 0..faces.len() as u32 {
        observer.check()?;
        let mut edges: Vec<u32> = faces[f as usize].borders.iter().flatten().copied().collect();
        edges.sort_unstable();
        for edge in edges {
            match partners.get(&(f, edge)) {
                // The other side of a cut has come before: the same places, from its other end.
                None if faces[f as usize].cut_twin(edge).is_some_and(|twin| twin < edge) => {
                    let twin = faces[f as usize].cut_twin(edge).unwrap_or(edge);
                    let places: Vec<f64> =
                        insertions[f as usize][twin as usize].iter().rev().map(|i| 1.0 - i.s).collect();
                    insertions[f as usize][edge as usize] =
                        places.into_iter().map(|s| Insertion { s, node: nodes.add(&[f]) }).collect();
                }
                None => {
                    let is_cut = faces[f as usize].cut_twin(edge).is_some();
                    let mut inner = followed(&faces[f as usize], edge, tolerances.chord_mm);
                    // The sides of a cut must differ somewhere, also where both ends are joined to other faces.
                    if inner.is_empty() && (is_cut || to_part.contains(&(f, edge))) {
                        inner.push(0.5);
                    }
                    insertions[f as usize][edge as usize] =
                        inner.into_iter().map(|s| Insertion { s, node: nodes.add(&[f]) }).collect();
                }
                Some(&other) if (f, edge) < other => {
                    let sides = together(faces, nodes, [(f, edge), other], tolerances);
                    for ((face, edge), along) in [(f, edge), other].into_iter().zip(sides) {
                        insertions[face as usize][edge as usize] = along;
                    }
                }
                Some(_) => {}
            }
        }
    }
    for (face, along) in faces.iter_mut().zip(&insertions) {
        face.insert(along);
    }
    // What has the same ends now is one: curves that part between them have vertices of their own there.
    let mut shared = Shared::new();
    for group in groups(faces, nodes) {
        if let Some((&first, rest)) = group.split_first()
            && let Some(&other) = rest.iter().find(|other| other.0 != first.0)
        {
            shared.insert(first, other);
            shared.insert(other, first);
        }
    }
    Ok(shared)
}

/// Border edges of all faces between the same two nodes, where there are several.
fn groups(faces: &[Face<'_>], nodes: &mut Nodes) -> Vec<Vec<EdgeOf>> {
    let mut by_ends: BTreeMap<(u32, u32), Vec<EdgeOf>> = BTreeMap::new();
    for (f, face) in faces.iter().enumerate() {
        for &edge in face.borders.iter().flatten() {
            let [a, b] = face.ends(edge).map(|v| nodes.root(face.node[v as usize]));
            if a != b {
                by_ends.entry((a.min(b), a.max(b))).or_default().push((f as u32, edge));
            }
        }
    }
    by_ends.into_values().filter(|group| group.len() > 1).collect()
}

/// Pairs the edges of a group whose curves agree, nearest first; those that agree with none are to be parted.
fn pair(faces: &[Face<'_>], group: &[EdgeOf], tolerance: f64, partners: &mut Shared, to_part: &mut BTreeSet<EdgeOf>) {
    let group = &group[..group.len().min(MOST_COMPARED)];
    let mut close: Vec<(f64, EdgeOf, EdgeOf)> = Vec::new();
    for (k, &a) in group.iter().enumerate() {
        for &b in &group[k + 1..] {
            if a.0 == b.0 {
                continue;
            }
            let middle = faces[a.0 as usize].point(a.1, 0.5);
            let (_, gap) = met(&faces[b.0 as usize], b.1, middle);
            if gap <= tolerance {
                close.push((gap, a, b));
            }
        }
    }
    close.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    for &(_, a, b) in &close {
        if !partners.contains_key(&a) && !partners.contains_key(&b) {
            partners.insert(a, b);
            partners.insert(b, a);
        }
    }
    for &edge in group {
        let agrees = close.iter().any(|&(_, a, b)| a == edge || b == edge);
        if !agrees {
            to_part.insert(edge);
        }
    }
}

/// The point of an edge's whole curve that is nearest to `p`: its parameter and the distance.
fn met(face: &Face<'_>, edge: u32, p: glam::DVec3) -> (f64, f64) {
    let mut start = (0.5, f64::INFINITY);
    for k in 0..=LOOKS {
        let s = f64::from(k) / f64::from(LOOKS);
        let distance = p.distance(face.point(edge, s));
        if distance < start.1 {
            start = (s, distance);
        }
    }
    nearest(face, edge, p, start.0)
}

/// The vertices to put into two edges that are one: at the same places, as many as the one that bends more asks for; none where
/// they are welded and agree throughout.
fn together(faces: &[Face<'_>], nodes: &mut Nodes, pair: [EdgeOf; 2], tolerances: Tolerances) -> [Vec<Insertion>; 2] {
    let [first, second] = pair.map(|(f, edge)| followed(&faces[f as usize], edge, tolerances.chord_mm));
    let leads = usize::from(second.len() > first.len());
    let places = if leads == 0 { first } else { second };
    let ((lead_face, lead), (other_face, other)) = (pair[leads], pair[1 - leads]);
    let mut ends =
        |(f, edge): EdgeOf| faces[f as usize].ends(edge).map(|v| nodes.root(faces[f as usize].node[v as usize]));
    let opposite = ends(pair[0])[0] != ends(pair[1])[0];
    let mut of_lead: Vec<Insertion> = Vec::new();
    let mut of_other: Vec<Insertion> = Vec::new();
    let mut agree = true;
    let mut last = if opposite { 1.0 } else { 0.0 };
    for s in places {
        let point = faces[lead_face as usize].point(lead, s);
        let (t, gap) = met(&faces[other_face as usize], other, point);
        let onwards = if opposite { t < last && t > 0.0 } else { t > last && t < 1.0 };
        if onwards && gap <= tolerances.sewing_mm {
            let node = nodes.add(&[lead_face, other_face]);
            of_lead.push(Insertion { s, node });
            of_other.push(Insertion { s: t, node });
            last = t;
        } else if gap > tolerances.sewing_mm {
            // The curves part here: each goes its own way.
            agree = false;
            of_lead.push(Insertion { s, node: nodes.add(&[lead_face]) });
            if onwards {
                of_other.push(Insertion { s: t, node: nodes.add(&[other_face]) });
                last = t;
            }
        }
    }
    // Inside a mesh vertices that lie beside the chord of a coarse row would only bend it.
    if agree && tolerances.join == Join::All {
        return [Vec::new(), Vec::new()];
    }
    if opposite {
        of_other.reverse();
    }
    if leads == 0 { [of_lead, of_other] } else { [of_other, of_lead] }
}
