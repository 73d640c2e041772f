//! From a trimmed domain to a mesh (thesis chapter 3 and 5.2): density, cells, tracing, polygons, configurations.

pub mod ampc;
mod conformity;
pub mod density;
mod deviation;
mod error;
mod fitted;
mod flat;
mod grid;
mod lift;
mod options;
mod outcome;
mod polygon;
mod skew;
mod surface_area;
mod tracing;

pub use conformity::{DomainFault, check_domain_mesh, region_area};
pub use deviation::{observed_chord_error, sampled_chord_error};
pub use error::TriangulationError;
pub use fitted::{Fitted, fit, fitted_mesh};
pub use grid::{grid_mesh, grid_mesh_by, random_mesh};
pub use lift::lift;
pub use options::{Configuration, Density, TriangulationMethod, TriangulationOptions};
pub use outcome::{DomainMesh, GridLines, Lifted, TracingCounts};
pub use skew::{Skew, SkewedPoints, SkewedSide};
pub use surface_area::{observed_area, rough_trimmed_area, trimmed_area};
pub use tracing::{CellEdge, CellLabel, CrossingList, Traced, TracedCell, aspect_of, trace};
