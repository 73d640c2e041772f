//! Triangles of primitives: lists, strips and fans, with indices or without, put where their instances stand.

use glam::DVec3;

use super::accessors;
use super::buffers::Buffers;
use super::document::{Document, Primitive, whole};
use super::limits::MeshLimits;
use super::scene::Instance;
use super::{Faults, Ignored};

const TRIANGLES: u64 = 4;
const STRIP: u64 = 5;
const FAN: u64 = 6;

/// Triangles of all instances over vertices of their own, not yet welded.
#[derive(Debug, Default)]
pub(super) struct Soup {
    /// Millimetres.
    pub(super) positions: Vec<DVec3>,
    /// Corners.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Primitives that gave triangles, each instance counted.
    pub(super) primitives: u64,
}

/// Reads all instances. `millimetres` is the length of the file's unit.
pub(super) fn read(
    document: &Document,
    buffers: &Buffers,
    instances: &[Instance],
    millimetres: f64,
    limits: &MeshLimits,
    faults: &mut Faults,
    ignored: &mut Ignored,
) -> Soup {
    let mut soup = Soup::default();
    let mut total = [0_u64; 2];
    // A mesh is looked at once for its faults, however often it stands in the scene.
    let mut seen = vec![false; document.meshes.len()];
    for instance in instances {
        let first = !std::mem::replace(&mut seen[instance.mesh], true);
        for (k, primitive) in document.meshes[instance.mesh].primitives.iter().enumerate() {
            let pointer = format!("/meshes/{}/primitives/{k}", instance.mesh);
            let mut note = |at: &str, detail: String| {
                if first {
                    faults.add(at, detail);
                }
            };
            let mode = primitive.mode.unwrap_or(4.0);
            let mode = match whole(mode) {
                Some(0..=3) => {
                    ignored.not_triangles += u64::from(first);
                    continue;
                }
                Some(mode @ 4..=6) => mode,
                _ => {
                    note(&format!("{pointer}/mode"), format!("there is no mode {mode}; triangles have 4, 5 or 6"));
                    continue;
                }
            };
            if let Some(name) = primitive.extensions.keys().find(|name| name.contains("draco")) {
                note(&pointer, format!("it is compressed ({name}). Export the mesh without Draco compression."));
                continue;
            }
            let Some(position) = primitive.attributes.position else {
                ignored.without_positions += u64::from(first);
                continue;
            };
            ignored.morphed += u64::from(first && primitive.targets.is_some());
            let counted = size(document, primitive, position, mode);
            let [vertices, triangles] = match counted {
                Ok(counted) => counted,
                Err((at, detail)) => {
                    note(&at, detail);
                    continue;
                }
            };
            total = [total[0].saturating_add(vertices), total[1].saturating_add(triangles)];
            if total[0] > limits.vertices || total[1] > limits.triangles {
                faults.add(
                    &pointer,
                    format!(
                        "the file has more than {} triangles or {} vertices in its scene. Send a coarser mesh.",
                        limits.triangles, limits.vertices
                    ),
                );
                return soup;
            }
            match one(document, buffers, primitive, position, mode) {
                Ok((positions, triangles)) => append(&mut soup, instance, millimetres, &positions, &triangles),
                Err((at, detail)) => note(&at, detail),
            }
        }
    }
    soup
}

type Where = (String, String);
/// Positions, and triangles among them.
type Geometry = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// How many vertices and triangles a primitive says that it has.
fn size(document: &Document, primitive: &Primitive, position: f64, mode: u64) -> Result<[u64; 2], Where> {
    let at = |accessor: f64| format!("/accessors/{accessor}");
    let vertices = accessors::count(document, position).map_err(|detail| (at(position), detail))?;
    let corners = match primitive.indices {
        None => vertices,
        Some(indices) => accessors::count(document, indices).map_err(|detail| (at(indices), detail))?,
    };
    let triangles = if mode == TRIANGLES { corners / 3 } else { corners.saturating_sub(2) };
    Ok([vertices, triangles])
}

/// The positions and triangles of a primitive.
fn one(
    document: &Document,
    buffers: &Buffers,
    primitive: &Primitive,
    position: f64,
    mode: u64,
) -> Result<Geometry, Where> {
    let at = |accessor: f64| format!("/accessors/{accessor}");
    let positions = accessors::positions(document, buffers, position).map_err(|detail| (at(position), detail));
    let indices = match primitive.indices {
        None => Ok(None),
        Some(indices) => {
            accessors::indices(document, buffers, indices).map(Some).map_err(|detail| (at(indices), detail))
        }
    };
    let (positions, indices) = (positions?, indices?);
    if let (Some(list), Some(accessor)) = (&indices, primitive.indices)
        && let Some(k) = list.iter().position(|&i| i as usize >= positions.len())
    {
        let detail = format!("index {k} names vertex {}, and the primitive has {}", list[k], positions.len());
        return Err((at(accessor), detail));
    }
    let corners = indices.as_ref().map_or(positions.len(), Vec::len);
    let corner = |k: usize| indices.as_ref().map_or(k as u32, |list| list[k]);
    if mode == TRIANGLES && !corners.is_multiple_of(3) {
        let accessor = primitive.indices.unwrap_or(position);
        return Err((at(accessor), format!("{corners} corners are no whole number of triangles")));
    }
    let triangles = match mode {
        STRIP => {
            // Every other triangle of a strip runs the other way round; one with a vertex twice only leads on.
            let triangle = |k: usize| [corner(k), corner(k + 1 + k % 2), corner(k + 2 - k % 2)];
            let leads_on = |[a, b, c]: &[u32; 3]| a == b || b == c || c == a;
            (0..corners.saturating_sub(2)).map(triangle).filter(|t| !leads_on(t)).collect()
        }
        FAN => (0..corners.saturating_sub(2)).map(|k| [corner(k + 1), corner(k + 2), corner(0)]).collect(),
        _ => (0..corners / 3).map(|k| [corner(3 * k), corner(3 * k + 1), corner(3 * k + 2)]).collect(),
    };
    Ok((positions, triangles))
}

/// Puts a primitive where its instance stands. A mirroring transform turns its triangles back.
fn append(soup: &mut Soup, instance: &Instance, millimetres: f64, positions: &[[f64; 3]], triangles: &[[u32; 3]]) {
    let from = soup.positions.len() as u32;
    let placed = |p: &[f64; 3]| instance.transform.transform_point3(DVec3::from_array(*p)) * millimetres;
    soup.positions.extend(positions.iter().map(placed));
    let mirrored = instance.transform.matrix3.determinant() < 0.0;
    soup.triangles.extend(triangles.iter().map(|t| {
        let [a, b, c] = t.map(|corner| from + corner);
        if mirrored { [a, c, b] } else { [a, b, c] }
    }));
    soup.primitives += 1;
}
