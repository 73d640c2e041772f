//! Which borders of the mesh are the curves whose lengths are kept.

use glam::DVec2;

use super::Length;
use crate::engine::error::EngineError;
use crate::engine::flattening::KeepCurve;
use crate::engine::flattening::isometric::KeptCurve;
use crate::engine::job::JobOptions;
use crate::engine::mesh::{Piece, Topology};
use crate::engine::pipeline::meshed::Meshed;

/// Places along a border that tell which loop it follows.
const SAMPLES: usize = 5;

/// Refuses a number that no border has.
pub(super) fn in_range(border: u32, count: usize) -> Result<(), EngineError> {
    if (border as usize) < count {
        return Ok(());
    }
    let detail = format!(
        "there is no border {border}: the part has {count}, counted from 0 as the report's `distortion.boundary` counts them"
    );
    Err(EngineError::Parameter { name: "flattening.keep".into(), detail })
}

/// The kept lengths of a trimmed surface: loops of the file as borders of the mesh.
pub(super) fn of_surface(meshed: &Meshed, options: &JobOptions) -> Result<Vec<Length>, EngineError> {
    let keep = options.flattening.keep();
    if !keep.is_empty() && !meshed.of_part && !meshed.region.natural {
        return Err(EngineError::Parameter {
            name: "flattening.keep".into(),
            detail:
                "with the domain `base` the part's boundaries are no borders of the mesh: take `flattening.domain: \
                     trimmed`"
                    .into(),
        });
    }
    let mut lengths = Vec::new();
    let mut followed = None;
    for keep in keep {
        match keep.curve {
            KeepCurve::Borders => lengths.push(Length::Borders(keep.weight)),
            KeepCurve::Border(border) => {
                in_range(border, meshed.region.loops.len())?;
                let followed: &Vec<usize> = followed.get_or_insert_with(|| loops_of_borders(meshed));
                let own = followed.iter().enumerate().filter(|(_, l)| **l == border as usize);
                lengths.extend(own.map(|(k, _)| Length::Border(k as u32, keep.weight)));
            }
        }
    }
    Ok(lengths)
}

/// For each border of the mesh the loop that it follows: the nearest one at most of its places.
fn loops_of_borders(meshed: &Meshed) -> Vec<usize> {
    let (loops, topology) = (&meshed.region.loops, &meshed.topology);
    let Some(uv) = meshed.lifted.mesh.uv.as_deref().filter(|_| loops.len() > 1) else {
        return vec![0; topology.border_count()];
    };
    let domain = meshed.surface.domain();
    let scale = DVec2::new(domain.u[1] - domain.u[0], domain.v[1] - domain.v[0]).recip();
    let distance = |l: usize, p: DVec2| {
        let points = &loops[l].points;
        let next = points.iter().skip(1).chain(points.first());
        let to_segment = |(a, b): (&DVec2, &DVec2)| {
            let (edge, to) = ((*b - *a) * scale, (p - *a) * scale);
            let square = edge.length_squared();
            let x = if square > 0.0 { (to.dot(edge) / square).clamp(0.0, 1.0) } else { 0.0 };
            (to - edge * x).length_squared()
        };
        points.iter().zip(next).map(to_segment).fold(f64::INFINITY, f64::min)
    };
    let nearest = |border: &[u32]| {
        let mut votes = vec![0_usize; loops.len()];
        for k in 0..SAMPLES {
            let h = border[k * border.len() / SAMPLES];
            let p = 0.5 * (uv[topology.origin(h) as usize] + uv[topology.target(h) as usize]);
            let near = (0..loops.len()).map(|l| distance(l, p)).enumerate();
            let least = near.fold((0, f64::INFINITY), |best, (l, d)| if d < best.1 { (l, d) } else { best });
            votes[least.0] += 1;
        }
        let most = votes.iter().copied().max().unwrap_or(0);
        votes.iter().position(|&v| v == most).unwrap_or(0)
    };
    topology.borders().map(nearest).collect()
}

/// For each piece how many borders the pieces before it have.
pub(super) fn borders_before(topology: &Topology) -> Vec<usize> {
    let mut counts = vec![0; topology.piece_count()];
    for &h in topology.borders().filter_map(|border| border.first()) {
        counts[topology.piece_of()[h as usize / 3] as usize] += 1;
    }
    let mut before = 0;
    for count in &mut counts {
        before += std::mem::replace(count, before);
    }
    counts
}

/// A border of the whole in the numbers of a piece, where it is the piece's.
pub(super) fn border_in(piece: &Piece, whole: &Topology, own: &Topology, border: usize) -> Option<KeptCurve> {
    let &first = whole.borders().nth(border)?.first()?;
    let triangle = piece.triangle_of.binary_search(&(first / 3)).ok()? as u32;
    let halfedge = 3 * triangle + first % 3;
    let local = own.borders().position(|halfedges| halfedges.contains(&halfedge))?;
    Some(KeptCurve::Border(local as u32))
}
