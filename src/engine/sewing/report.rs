//! What is told of the sewing.

use serde::{Deserialize, Serialize};

use super::Join;
use crate::engine::pattern::Seam;

/// A stretch of border that two faces share.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JoinedBorder {
    /// The faces, by their places in the file.
    pub faces: [u32; 2],
    /// Its length, mm.
    pub length_mm: f64,
    /// Greatest distance of the two borders, mm.
    pub gap_mm: f64,
}

/// Border edges that run near another face, but farther from it than the tolerance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct NearMisses {
    /// How many edges of the mesh.
    pub edges: u64,
    /// Their length, mm.
    pub length_mm: f64,
    /// Least and greatest distance of their middles from the other face, mm.
    pub gap_mm: [f64; 2],
}

/// A seam between two pieces of the pattern.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SeamReport {
    /// Its name in the pattern.
    pub name: String,
    /// The pieces, by their places in the pattern.
    pub pieces: [u32; 2],
    /// Its length on each piece as it is cut, mm.
    pub lengths_mm: [f64; 2],
    /// Its length on the part, mm.
    pub length_3d_mm: f64,
    /// Difference of the two lengths, mm.
    pub mismatch_mm: f64,
}

impl From<&Seam> for SeamReport {
    fn from(seam: &Seam) -> Self {
        let [a, b] = &seam.sides;
        Self {
            name: seam.name.clone(),
            pieces: [a.piece, b.piece],
            lengths_mm: [a.length_mm, b.length_mm],
            length_3d_mm: seam.length_3d_mm,
            mismatch_mm: seam.mismatch_mm(),
        }
    }
}

/// The sewing.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SewingReport {
    /// Faces of the part.
    pub faces: u64,
    /// Faces left out since another is the same, number for number.
    pub faces_doubled: u64,
    /// Faces turned over to agree with their neighbours.
    pub faces_turned: u64,
    /// What was asked for.
    pub join: Join,
    /// Borders at most so far apart are shared, mm.
    pub tolerance_mm: f64,
    /// Stretches of border that two faces share.
    pub joined_borders: u64,
    /// Edges of the mesh on them.
    pub joined_edges: u64,
    /// Their length, mm.
    pub joined_mm: f64,
    /// Greatest distance of two borders that are shared, mm.
    pub greatest_gap_mm: f64,
    /// Border edges of the mesh that belong to one face alone.
    pub open_edges: u64,
    /// Edges that run near another face, but farther from it than the tolerance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub near_misses: Option<NearMisses>,
    /// The shared stretches, at most two hundred of them.
    pub borders: Vec<JoinedBorder>,
    /// Seams of the pattern; of the stretches those along which pieces were kept apart.
    pub seam_count: u64,
    /// The greatest difference of the two lengths of a seam, mm.
    pub greatest_mismatch_mm: f64,
    /// The seams, at most two hundred of them.
    pub seams: Vec<SeamReport>,
}

/// Stretches that are listed one by one.
pub(super) const MAX_LISTED: usize = 200;

impl SewingReport {
    /// Tells of the pattern's seams.
    pub fn tell_seams(&mut self, seams: &[Seam]) {
        self.seam_count = seams.len() as u64;
        self.greatest_mismatch_mm = seams.iter().map(Seam::mismatch_mm).fold(0.0, f64::max);
        self.seams = seams.iter().take(MAX_LISTED).map(SeamReport::from).collect();
    }

    /// What a person should know of it.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.faces_doubled > 0 {
            warnings.push(format!("{} of the faces are there twice: each is taken once", self.faces_doubled));
        }
        if self.faces_turned > 0 {
            warnings.push(format!(
                "{} of the faces had their show side on the other side than their neighbours and were turned over",
                self.faces_turned
            ));
        }
        if let Some(missed) = &self.near_misses {
            warnings.push(format!(
                "{:.4} mm of border run {:.4} to {:.4} mm from another face and were not joined: if they are meant to meet, \
                 set sewing.tolerance_mm above {:.4}",
                missed.length_mm, missed.gap_mm[0], missed.gap_mm[1], missed.gap_mm[1]
            ));
        }
        warnings
    }
}
