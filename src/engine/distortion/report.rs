//! The report of a job: the very names that the API gives. A report holds no clock, id or timing.

use serde::{Deserialize, Serialize};

use super::iso_lines::IsoLinesReport;
use super::{HotSpot, Thresholds, Verdict};
use crate::engine::curvature::CurvatureReport;
use crate::engine::curvature::developability::DevelopabilityReport;
use crate::engine::flattening::PinPlace;
use crate::engine::flattening::energy_release::ReleaseReport;
use crate::engine::pattern::Compensation;
use crate::engine::sewing::SewingReport;
use crate::engine::triangulation::ampc::AmpcCounts;

/// Everything that is said of a result.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Report {
    /// The mesh.
    pub triangulation: TriangulationReport,
    /// The flattening.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flattening: Option<FlatteningReport>,
    /// The seed search, when there was one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed_search: Option<SeedSearchReport>,
    /// How the pattern was placed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub placement: Option<PlacementReport>,
    /// The verdict.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// The distortion.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub distortion: Option<DistortionReport>,
    /// The pattern.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pattern: Option<PatternReport>,
    /// How the faces of a part were sewn.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sewing: Option<SewingReport>,
    /// What a person should know.
    pub warnings: Vec<String>,
}

/// Aspect ratios of the mesh (thesis 1.6.9).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct AspectRatio {
    /// Least.
    pub min: f64,
    /// Greatest.
    pub max: f64,
    /// Share of triangles, percent, in the ranges of Tables 3.3 and 3.4: `[from, to, percent]`.
    pub histogram: Vec<(f64, Option<f64>, f64)>,
}

/// The mesh.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct TriangulationReport {
    /// Vertices.
    pub vertices: u64,
    /// Edges.
    pub edges: u64,
    /// Triangles.
    pub triangles: u64,
    /// Area of the mesh, mm^2.
    pub area_mm2: f64,
    /// Area of the surface under the mesh, by quadrature, mm^2.
    pub surface_area_mm2: f64,
    /// Area of the surface inside the trimming loops, by quadrature, mm^2; where the mesh is that of the part or there
    /// are no loops, the same as `surface_area_mm2`. Null where the loops could not be followed at this density.
    #[serde(default)]
    pub part_area_mm2: Option<f64>,
    /// Sampled greatest distance between mesh and surface, mm.
    pub chord_error_mm: f64,
    /// Longest edge, mm.
    pub edge_max_mm: f64,
    /// Points of the grid along u and v.
    pub grid: [u32; 2],
    /// Cells of the grid.
    pub cells: u64,
    /// Visits of cells by loops.
    pub cells_traced: u64,
    /// Distinct cells visited.
    pub cells_distinct: u64,
    /// Borders of the mesh.
    pub borders: u64,
    /// Pieces of the mesh.
    pub pieces: u64,
    /// Aspect ratios.
    pub aspect_ratio: AspectRatio,
    /// Curvature at the interior vertices, in the report of a triangulation and of a sequential flattening.
    #[serde(default)]
    pub curvature: Option<CurvatureReport>,
    /// What the method `ampc` counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ampc: Option<AmpcCounts>,
    /// What is foretold of a flattening, by jobs that end with the mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub developability: Option<DevelopabilityReport>,
}

/// The flattening.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct FlatteningReport {
    /// The method.
    pub method: String,
    /// `base` or `trimmed`.
    pub domain: String,
    /// What was made least, for the method that makes something least.
    #[serde(default)]
    pub objective: Option<String>,
    /// How the least was found; of a part that lies flat without strain nothing had to be looked for.
    #[serde(default)]
    pub solver: Option<SolverReport>,
    /// What became of the wish that the pattern does not lie on itself, where there was one.
    #[serde(default)]
    pub injective: Option<InjectiveReport>,
    /// The part, or every piece of it, lies flat without strain, and was laid so.
    #[serde(default)]
    pub developable: Option<DevelopableReport>,
    /// How energy was released, for methods that do.
    #[serde(default)]
    pub release: Option<ReleaseReport>,
    /// The seed triangle, for methods that have one.
    pub seed: Option<u32>,
    /// Levels of the mapping order, likewise.
    pub levels: Option<u64>,
    /// Of each level, by sequential methods: triangles, points averaged, and of these points averaged before already (Tables 5.9
    /// to 5.11); of the first piece.
    #[serde(default)]
    pub level_counts: Option<Vec<[u32; 3]>>,
    /// Points averaged, by `cader`.
    pub averaged_points: Option<u64>,
    /// Greatest way between the first place of a vertex and its last, by `cader`, mm.
    #[serde(default)]
    pub greatest_movement_mm: Option<f64>,
    /// Triangles flattened.
    pub flattened: u64,
    /// Flipped triangles.
    pub flips: u64,
    /// Places where far parts of the flattening lie on each other; null where that cannot be told: it is flipped somewhere,
    /// or its borders cross too often.
    pub overlaps: Option<u64>,
    /// The largest of these places.
    #[serde(default)]
    pub overlap_places: Vec<OverlapReport>,
    /// The pinned points.
    #[serde(default)]
    pub pins: Vec<PinReport>,
}

/// A pinned point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PinReport {
    /// The point, as it was asked for.
    pub at: PinPlace,
    /// Where it was to lie, mm.
    pub to_mm: [f64; 2],
    /// How far from there it lies, mm.
    pub residual_mm: f64,
}

/// How a map of least energy was found: all pieces together.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct SolverReport {
    /// Times that the system was factorised while the energy of the objective was made least: starts and coarser meshes
    /// are not counted.
    pub rounds: u64,
    /// Area-weighted mean of the objective's energy (which energy depends on the objective); 0 for an isometry.
    pub energy: f64,
    /// Whether it is the least within the solver's tolerance. Else the map is valid, but a better one may exist.
    pub converged: bool,
}

/// What it took that a pattern does not lie on itself: all pieces together.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct InjectiveReport {
    /// Whether the map of least distortion overlapped, so that another one had to be found.
    pub continued: bool,
    /// Times that a system was factorised for it.
    pub rounds: u64,
    /// Area-weighted mean of the objective's energy of the map of least distortion.
    pub energy_before: f64,
    /// The same of the map without overlaps.
    pub energy_after: f64,
    /// Whether that energy fell no further. Else the map is valid, but a better one may exist.
    pub converged: bool,
}

/// A part without strain.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct DevelopableReport {
    /// `plane`, `cylinder`, `cone` or `general` for a surface, `mesh` for a mesh whose angles add up.
    pub kind: String,
    /// Greatest `|s - 1|` of the singular values `s` of the map, on the surface (or the mesh) itself.
    pub strain: f64,
}

/// A place where far parts of a flattening lie on each other.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct OverlapReport {
    /// Area of the plane that is covered more than once, mm^2.
    pub area_mm2: f64,
    /// Place in the pattern.
    pub xy_mm: [f64; 2],
    /// The two places of the part that meet there, on its boundaries; one where a whole boundary lies on the rest.
    pub sides: Vec<OverlapSide>,
}

/// A place on a boundary of the part.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct OverlapSide {
    /// Place in the domain.
    pub uv: Option<[f64; 2]>,
    /// Place in space.
    pub xyz_mm: [f64; 3],
}

/// The seed search (thesis 4.4.4).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct SeedSearchReport {
    /// What is minimised: `area` or `shape`.
    pub measure: String,
    /// Which seeds were to be tried: `exhaustive` or `predicted`.
    pub strategy: String,
    /// Seeds that there are.
    pub seeds: u64,
    /// Seeds tried.
    pub tried: u64,
    /// Of these, how many were run to their end and flattened the whole mesh.
    pub succeeded: u64,
    /// The same in percent of those tried; not known when seeds were abandoned.
    pub success_percent: Option<f64>,
    /// The best seed.
    pub best: Option<u32>,
    /// Its change, percent.
    pub best_percent: Option<f64>,
    /// The worst seed that succeeded; not known when seeds were abandoned.
    pub worst: Option<u32>,
    /// Its change, percent.
    pub worst_percent: Option<f64>,
    /// Seeds abandoned since they could no longer win.
    pub abandoned: u64,
    /// Whether every seed had its turn. Where not, the strategy tries few, or the budget had run out: then another run may
    /// find another best.
    pub complete: bool,
    /// Whether some seed succeeds (thesis 4.4.2); null where none of those tried did, and not all were.
    #[serde(default)]
    pub almost_developable: Option<bool>,
    /// The budget, seconds, where there was one.
    pub budget_s: Option<f64>,
}

/// How the pattern lies.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PlacementReport {
    /// The side one looks at: `show` or `back`.
    pub side_up: String,
    /// True when the flat mesh was mirrored to show that side.
    pub mirrored: bool,
    /// Rotation applied to the flattening, degrees.
    pub rotation_deg: f64,
    /// Place of the flattening's own origin in the pattern, mm.
    pub origin_mm: [f64; 2],
}

/// Where an extreme strain stands.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StrainPlace {
    /// Place in the domain.
    pub uv: Option<[f64; 2]>,
    /// Place in space.
    pub xyz_mm: [f64; 3],
    /// Place in the pattern.
    pub xy_mm: [f64; 2],
    /// The triangle.
    pub triangle: u32,
}

/// Principal strains: 100 (length on the part / length in the pattern - 1); positive = stretched onto the part.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct StrainReport {
    /// Least.
    pub min: f64,
    /// Greatest.
    pub max: f64,
    /// 1st percentile by area of the lesser principal strain.
    pub p01: f64,
    /// 99th percentile by area of the greater principal strain.
    pub p99: f64,
    /// Where the least is.
    pub at_min: StrainPlace,
    /// Where the greatest is.
    pub at_max: StrainPlace,
}

/// Lengths of one boundary of the part.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct BoundaryReport {
    /// Index of the loop in the file; null for the natural boundary.
    pub source_loop: Option<usize>,
    /// Whether it is a hole.
    pub hole: bool,
    /// Length on the surface, mm.
    pub length_3d_mm: f64,
    /// Length on the mesh, mm.
    pub length_mesh_mm: f64,
    /// Length in the pattern, mm.
    pub length_2d_mm: f64,
}

/// The measures of one set of triangles.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct DistortionMeasures {
    /// Absolute area change (4.9), percent of the 3D area.
    pub area_change_percent: f64,
    /// Absolute shape change (4.10), percent of the summed 3D edge lengths.
    pub shape_change_percent: f64,
    /// Relative area difference (4.5), positive = shrunk.
    pub relative_area: f64,
    /// Relative edge length difference (4.7), positive = shrunk.
    pub relative_shape: f64,
    /// Mean over the triangles that change by more than the threshold, mm^2.
    pub average_area_change_mm2: f64,
    /// Mean over the edges that change by more than the threshold, mm.
    pub average_shape_change_mm: f64,
    /// Principal strains, percent.
    pub strain_percent: StrainReport,
    /// Greatest shear angle and its 99th percentile by area, degrees.
    pub shear_deg: [f64; 2],
    /// Area-weighted mean of s1^2 + s2^2 + 1/s1^2 + 1/s2^2 (least 4).
    pub symmetric_dirichlet: f64,
    /// Triangles that the measures are of.
    pub triangles: u64,
}

/// The distortion of the part, and of the base surface where that is larger.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct DistortionReport {
    /// Of the part: what counts.
    #[serde(flatten)]
    pub part: DistortionMeasures,
    /// Of the whole base surface, with `domain: base`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base: Option<DistortionMeasures>,
    /// Shape change along iso-parameter lines (4.7), of the part. Null for a mesh that was sent, and where the map is exact.
    #[serde(default)]
    pub iso_lines: Option<IsoLinesReport>,
    /// The part's boundaries.
    pub boundary: Vec<BoundaryReport>,
    /// The thresholds of the averages.
    pub thresholds: Thresholds,
    /// Where to look first, the worst place first.
    #[serde(default)]
    pub hot_spots: Vec<HotSpot>,
}

/// The pattern.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct PatternReport {
    /// Net area: outlines less holes, mm^2.
    pub area_mm2: f64,
    /// Length of all outlines and holes, mm.
    pub perimeter_mm: f64,
    /// Width and height, mm.
    pub bounding_box_mm: [f64; 2],
    /// Pieces.
    pub pieces: u64,
    /// Holes.
    pub holes: u64,
    /// Points of all outlines and holes.
    pub points: u64,
    /// By how much the pieces were made larger or smaller; areas and lengths above are those after it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compensation: Option<Compensation>,
    /// The curves that were fitted; absent where none were.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curves: Option<CurvesReport>,
}

/// The curves of outlines and holes, in each form.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct CurvesReport {
    /// Lines and arcs.
    pub arcs: FormReport,
    /// Lines and cubic splines.
    pub spline: FormReport,
}

/// What one form of the curves is.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct FormReport {
    /// Lines, arcs, cubics and circles.
    pub entities: u64,
    /// Greatest distance from the samples of the mapped curve, mm; these leave the curve by at most an eighth of the tolerance.
    pub deviation_mm: f64,
}
