//! Mesh and pattern as they are kept between a job's end and the reading of its results: exact to the bit.
//!
//! A mesh of version 1 has no part, one of version 2 neither curvature nor movement; they are read as before.
//!
//! Little-endian, in the order of the fields below, without padding. A header of 4 letters and a version stands first;
//! a reader refuses a version it does not know. Counts are checked against the bytes that are there before anything is
//! allocated, and indices against the counts, so that a damaged row gives an error, not a panic.
//!
//! A mesh: `PLNM`, version, flags (1 uv, 2 normals, 4 flat, 8 strain, 16 part, 32 curvature, 64 movement), vertices u64,
//! triangles u64; positions 3 x f64, uv 2 x f64, normals 3 x f64, flat 2 x f64, triangles 3 x u32, strain 2 x f64, part a
//! byte each, curvature f64, movement f64. The pattern's order is that of [`pattern`].

mod pattern;

use glam::{DVec2, DVec3};

pub use pattern::{PATTERN_MEDIA, decode_pattern, encode_pattern};

use super::model::MeshParts;
use crate::engine::mesh::Mesh;

const MESH_MAGIC: [u8; 4] = *b"PLNM";
/// Media type under which an encoded mesh is stored.
pub const MESH_MEDIA: &str = "application/vnd.planish.mesh";

/// Version of meshes that are written; version 1 did not know which triangles belong to the part.
const MESH_VERSION: u32 = 3;

const HAS_UV: u32 = 1;
const HAS_NORMALS: u32 = 2;
const HAS_FLAT: u32 = 4;
const HAS_STRAIN: u32 = 8;
const HAS_PART: u32 = 16;
const HAS_GAUSSIAN: u32 = 32;
const HAS_MOVEMENT: u32 = 64;

/// A mesh as stored.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StoredMesh {
    /// The mesh.
    pub mesh: Mesh,
    /// Unit normals at its vertices; empty when there are none.
    pub normals: Vec<DVec3>,
    /// Places in the pattern, mm; NaN where a partial flattening did not get to.
    pub flat: Option<Vec<DVec2>>,
    /// Principal strains of each triangle `[least, greatest]`, percent.
    pub strain_percent: Option<Vec<[f64; 2]>>,
    /// Which triangles belong to the part; `None`: all of them.
    pub part: Option<Vec<bool>>,
    /// The surface's own Gaussian curvature at the vertices, 1/mm^2.
    pub gaussian: Option<Vec<f64>>,
    /// How far averaging moved each vertex, mm; NaN where a partial flattening did not get to.
    pub movement: Option<Vec<f64>>,
}

impl StoredMesh {
    /// The same as the writers want it.
    #[must_use]
    pub fn parts(&self) -> MeshParts<'_> {
        MeshParts {
            mesh: &self.mesh,
            normals: &self.normals,
            flat: self.flat.as_deref(),
            strain_percent: self.strain_percent.as_deref(),
            part: self.part.as_deref(),
            gaussian: self.gaussian.as_deref(),
            movement: self.movement.as_deref(),
        }
    }
}

/// Why stored bytes could not be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StoredError {
    /// The first letters are not ours.
    #[error("these bytes are not a stored {what}")]
    Magic {
        /// What was looked for.
        what: &'static str,
    },
    /// Written by another version.
    #[error("stored {what} of version {found}: this program reads versions up to {newest}")]
    Version {
        /// What was looked for.
        what: &'static str,
        /// Its version.
        found: u32,
        /// The newest that is read.
        newest: u32,
    },
    /// The bytes contradict themselves.
    #[error("a stored result is damaged: {detail}")]
    Damaged {
        /// How.
        detail: &'static str,
    },
}

/// Encodes a mesh. Slices that do not fit the mesh are left out.
#[must_use]
pub fn encode_mesh(parts: &MeshParts<'_>) -> Vec<u8> {
    let mesh = parts.mesh;
    let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
    let uv = mesh.uv.as_deref().filter(|uv| uv.len() == vertices);
    let normals = Some(parts.normals).filter(|n| n.len() == vertices && vertices > 0);
    let flat = parts.flat.filter(|f| f.len() == vertices);
    let strain = parts.strain_percent.filter(|s| s.len() == triangles);
    let part = parts.part.filter(|p| p.len() == triangles);
    let gaussian = parts.gaussian.filter(|k| k.len() == vertices);
    let movement = parts.movement.filter(|m| m.len() == vertices);
    let flags = [
        (uv.is_some(), HAS_UV),
        (normals.is_some(), HAS_NORMALS),
        (flat.is_some(), HAS_FLAT),
        (strain.is_some(), HAS_STRAIN),
        (part.is_some(), HAS_PART),
        (gaussian.is_some(), HAS_GAUSSIAN),
        (movement.is_some(), HAS_MOVEMENT),
    ]
    .iter()
    .map(|(has, flag)| u32::from(*has) * flag)
    .sum::<u32>();
    let mut out = Vec::with_capacity(28 + mesh_bytes(flags, vertices as u128, triangles as u128) as usize);
    out.extend_from_slice(&MESH_MAGIC);
    out.extend_from_slice(&MESH_VERSION.to_le_bytes());
    out.extend_from_slice(&flags.to_le_bytes());
    out.extend_from_slice(&(vertices as u64).to_le_bytes());
    out.extend_from_slice(&(triangles as u64).to_le_bytes());
    let mut floats = |values: &[f64]| {
        for x in values {
            out.extend_from_slice(&x.to_le_bytes());
        }
    };
    mesh.positions.iter().for_each(|p| floats(&p.to_array()));
    uv.unwrap_or_default().iter().for_each(|p| floats(&p.to_array()));
    normals.unwrap_or_default().iter().for_each(|p| floats(&p.to_array()));
    flat.unwrap_or_default().iter().for_each(|p| floats(&p.to_array()));
    for corner in mesh.triangles.as_flattened() {
        out.extend_from_slice(&corner.to_le_bytes());
    }
    for x in strain.unwrap_or_default().as_flattened() {
        out.extend_from_slice(&x.to_le_bytes());
    }
    out.extend(part.unwrap_or_default().iter().map(|inside| u8::from(*inside)));
    for x in gaussian.unwrap_or_default().iter().chain(movement.unwrap_or_default()) {
        out.extend_from_slice(&x.to_le_bytes());
    }
    out
}

/// Bytes after the header. Counts up to `u64::MAX` do not overflow a `u128`.
fn mesh_bytes(flags: u32, vertices: u128, triangles: u128) -> u128 {
    let per = |flag: u32, bytes: u128| if flags & flag != 0 { bytes } else { 0 };
    vertices
        * (24
            + per(HAS_UV, 16)
            + per(HAS_NORMALS, 24)
            + per(HAS_FLAT, 16)
            + per(HAS_GAUSSIAN, 8)
            + per(HAS_MOVEMENT, 8))
        + triangles * (12 + per(HAS_STRAIN, 16) + per(HAS_PART, 1))
}

/// Decodes a mesh.
///
/// # Errors
/// [`StoredError`].
pub fn decode_mesh(bytes: &[u8]) -> Result<StoredMesh, StoredError> {
    let (mut read, _) = Reader::open(bytes, MESH_MAGIC, "mesh", MESH_VERSION)?;
    let flags = read.u32()?;
    let (vertices, triangles) = (read.u64()?, read.u64()?);
    if read.rest.len() as u128 != mesh_bytes(flags, u128::from(vertices), u128::from(triangles)) {
        return Err(damaged("its counts do not fit its length"));
    }
    // The counts fit a slice in memory, so they fit usize.
    let (vertices, triangles) = (vertices as usize, triangles as usize);
    let positions = read.points::<3>(vertices)?.map(DVec3::from_array).collect();
    let uv = if flags & HAS_UV != 0 { Some(read.points(vertices)?.map(DVec2::from_array).collect()) } else { None };
    let normals =
        if flags & HAS_NORMALS != 0 { read.points(vertices)?.map(DVec3::from_array).collect() } else { Vec::new() };
    let flat = if flags & HAS_FLAT != 0 { Some(read.points(vertices)?.map(DVec2::from_array).collect()) } else { None };
    let corners = read.take(triangles * 12)?;
    let triangles_read: Vec<[u32; 3]> = corners
        .as_chunks::<12>()
        .0
        .iter()
        .map(|c| std::array::from_fn(|k| u32::from_le_bytes([c[4 * k], c[4 * k + 1], c[4 * k + 2], c[4 * k + 3]])))
        .collect();
    if triangles_read.as_flattened().iter().any(|c| *c as usize >= vertices) {
        return Err(damaged("a triangle names a vertex that is not there"));
    }
    let strain_percent = if flags & HAS_STRAIN != 0 { Some(read.points(triangles)?.collect()) } else { None };
    let part = if flags & HAS_PART != 0 { Some(read.take(triangles)?.iter().map(|b| *b != 0).collect()) } else { None };
    let mut numbers = |flag: u32| -> Result<Option<Vec<f64>>, StoredError> {
        if flags & flag == 0 {
            return Ok(None);
        }
        Ok(Some(read.points::<1>(vertices)?.map(|[x]| x).collect()))
    };
    let (gaussian, movement) = (numbers(HAS_GAUSSIAN)?, numbers(HAS_MOVEMENT)?);
    let mesh = Mesh { positions, uv, triangles: triangles_read };
    Ok(StoredMesh { mesh, normals, flat, strain_percent, part, gaussian, movement })
}

pub(super) const fn damaged(detail: &'static str) -> StoredError {
    StoredError::Damaged { detail }
}

pub(super) struct Reader<'a> {
    pub(super) rest: &'a [u8],
}

impl<'a> Reader<'a> {
    /// What stands behind the header, and its version.
    pub(super) fn open(
        bytes: &'a [u8],
        magic: [u8; 4],
        what: &'static str,
        newest: u32,
    ) -> Result<(Self, u32), StoredError> {
        let rest = bytes.strip_prefix(&magic).ok_or(StoredError::Magic { what })?;
        let mut read = Self { rest };
        let found = read.u32()?;
        if (1..=newest).contains(&found) {
            Ok((read, found))
        } else {
            Err(StoredError::Version { what, found, newest })
        }
    }

    fn take(&mut self, bytes: usize) -> Result<&'a [u8], StoredError> {
        let (taken, rest) = self.rest.split_at_checked(bytes).ok_or(damaged("it ends too early"))?;
        self.rest = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], StoredError> {
        let (taken, rest) = self.rest.split_first_chunk().ok_or(damaged("it ends too early"))?;
        self.rest = rest;
        Ok(*taken)
    }

    pub(super) fn u32(&mut self) -> Result<u32, StoredError> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, StoredError> {
        self.array().map(u64::from_le_bytes)
    }

    pub(super) fn f64(&mut self) -> Result<f64, StoredError> {
        self.array().map(f64::from_le_bytes)
    }

    /// A count of things that take at least `least` bytes each: no more than there are bytes for.
    pub(super) fn count(&mut self, least: usize) -> Result<usize, StoredError> {
        let count = self.u64()?;
        if count > (self.rest.len() / least) as u64 {
            return Err(damaged("a count is larger than what follows"));
        }
        Ok(count as usize)
    }

    fn points<const N: usize>(
        &mut self,
        count: usize,
    ) -> Result<impl Iterator<Item = [f64; N]> + use<'a, N>, StoredError> {
        let bytes = count.checked_mul(8 * N).ok_or(damaged("a count is larger than what follows"))?;
        let values = self.take(bytes)?.as_chunks::<8>().0;
        Ok(values.chunks_exact(N).map(|p| std::array::from_fn(|k| f64::from_le_bytes(p[k]))))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::engine::pattern::Pattern;

    fn float() -> impl Strategy<Value = f64> {
        any::<u64>().prop_map(f64::from_bits)
    }

    fn stored_mesh() -> impl Strategy<Value = StoredMesh> {
        (1_usize..20, 0_usize..20, any::<[bool; 7]>()).prop_flat_map(|(vertices, triangles, has)| {
            let v2 = move || prop::collection::vec([float(), float()].prop_map(DVec2::from_array), vertices);
            let v3 = move || prop::collection::vec([float(), float(), float()].prop_map(DVec3::from_array), vertices);
            let corner = 0..vertices as u32;
            let corners = prop::collection::vec([corner.clone(), corner.clone(), corner], triangles);
            let strain = prop::collection::vec([float(), float()], triangles);
            let part = prop::collection::vec(any::<bool>(), triangles);
            let numbers = prop::collection::vec([float(), float()], vertices);
            (v3(), v2(), v3(), v2(), corners, strain, part, numbers).prop_map(
                move |(positions, uv, normals, flat, triangles, strain, part, numbers)| StoredMesh {
                    mesh: Mesh { positions, uv: has[0].then_some(uv), triangles },
                    normals: if has[1] { normals } else { Vec::new() },
                    flat: has[2].then_some(flat),
                    strain_percent: has[3].then_some(strain),
                    part: has[4].then_some(part),
                    gaussian: has[5].then(|| numbers.iter().map(|n| n[0]).collect()),
                    movement: has[6].then(|| numbers.iter().map(|n| n[1]).collect()),
                },
            )
        })
    }

    proptest! {
        #[test]
        fn a_mesh_comes_back_bit_for_bit(mesh in stored_mesh()) {
            let bytes = encode_mesh(&mesh.parts());
            let again = decode_mesh(&bytes).unwrap();
            // Bytes are compared, since NaN does not equal itself.
            prop_assert_eq!(encode_mesh(&again.parts()), bytes);
            prop_assert_eq!(again.mesh.triangles, mesh.mesh.triangles);
            prop_assert_eq!(again.part, mesh.part);
            prop_assert_eq!(again.movement.map(|m| m.len()), mesh.movement.map(|m| m.len()));
            prop_assert_eq!(again.flat.map(|f| f.len()), mesh.flat.map(|f| f.len()));
        }

        #[test]
        fn damage_gives_an_error_or_other_values_never_a_panic(mesh in stored_mesh(), at in any::<prop::sample::Index>(), bits in 1..=255_u8, cut in any::<prop::sample::Index>()) {
            let mut bytes = encode_mesh(&mesh.parts());
            let i = at.index(bytes.len());
            bytes[i] ^= bits;
            let _ = decode_mesh(&bytes);
            bytes.truncate(cut.index(bytes.len()));
            prop_assert!(decode_mesh(&bytes).is_err());
        }
    }

    #[test]
    fn a_mesh_of_the_first_version_is_still_read() {
        let mesh = Mesh { positions: vec![DVec3::X, DVec3::Y, DVec3::Z], uv: None, triangles: vec![[0, 1, 2]] };
        let mut bytes = encode_mesh(&MeshParts { strain_percent: Some(&[[1.0, 2.0]]), ..MeshParts::of(&mesh) });
        bytes[4] = 1;
        let read = decode_mesh(&bytes).unwrap();
        assert_eq!((read.mesh, read.part), (mesh, None));
        assert_eq!(read.strain_percent, Some(vec![[1.0, 2.0]]));
    }

    #[test]
    fn arbitrary_bytes_are_no_mesh() {
        assert_eq!(decode_mesh(&encode_pattern(&Pattern::default())), Err(StoredError::Magic { what: "mesh" }));
    }
}
