//! Bytes to geometry and back. In: trimmed-surface JSON. Out: GLB, DXF, SVG, JSON.

pub mod faults;
pub mod units;
