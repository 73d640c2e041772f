//! From a trimmed domain to a mesh (thesis chapter 3 and 5.2): density, cells, tracing, polygons, configurations.

mod error;
mod grid;
mod lift;
mod options;
mod outcome;

pub use error::TriangulationError;
pub use grid::grid_mesh;
pub use lift::lift;
pub use options::{Configuration, Density, TriangulationMethod, TriangulationOptions};
pub use outcome::{DomainMesh, GridLines, Lifted, TracingCounts};
