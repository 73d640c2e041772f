//! Several surface files as one part: their faces in the order of the files, in millimetres.
//!
//! The text that comes out is a surface file like any other; the same files in the same order give the same bytes.

use std::collections::BTreeMap;

use super::faults::Fault;
use super::surface::{self, Geometry, Reading};
use super::surface_json::{MAX_LABELS, MAX_TEXT, write_part};
use crate::engine::sewing::MAX_FACES;
use crate::engine::trimming::TrimmedSurface;

/// Adds up files.
#[derive(Debug, Default)]
pub struct Composition {
    faces: Vec<TrimmedSurface>,
    names: Vec<String>,
    /// Labels on which no two files disagree.
    labels: BTreeMap<String, Option<String>>,
}

impl Composition {
    /// Adds the faces of a file. `at` is the pointer of what names it.
    ///
    /// # Errors
    /// Every fault of the file; a fault when it is a mesh, which has no border curves, or when there are too many faces.
    pub fn add(&mut self, bytes: &[u8], reading: Reading, at: &str) -> Result<(), Vec<Fault>> {
        let refused = |detail: String| vec![Fault { pointer: at.to_owned(), detail, place: None }];
        let read = surface::read(bytes, reading, at)?;
        match read.geometry {
            Geometry::Trimmed(face) => self.faces.push(*face),
            Geometry::Part(part) => self.faces.extend(part.faces),
            Geometry::Mesh(_) => {
                return Err(refused("this is a mesh: only trimmed surfaces are sewn to one part".to_owned()));
            }
        }
        if self.faces.len() > MAX_FACES {
            return Err(refused(format!("more than {MAX_FACES} faces in all: this is more than can be worked on")));
        }
        self.names.extend(read.name.filter(|name| !name.is_empty()));
        for (key, value) in read.labels {
            let known = self.labels.entry(key).or_insert_with(|| Some(value.clone()));
            if known.as_ref() != Some(&value) {
                *known = None;
            }
        }
        Ok(())
    }

    /// The text of the part. Its name is that of its files, one after the other, as far as there is room.
    #[must_use]
    pub fn text(self) -> String {
        let name: String = self.names.join(" + ").chars().take(MAX_TEXT).collect();
        let agreed = self.labels.into_iter().filter_map(|(key, value)| Some((key, value?)));
        let labels = agreed.take(MAX_LABELS).collect();
        write_part(Some(name.as_str()).filter(|name| !name.is_empty()), &labels, &self.faces)
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;

    fn plate(name: &str, x: f64, order: &str) -> Value {
        json!({
            "name": name, "units": "cm", "side": "reversed", "labels": { "order": order, "made": "here" },
            "degree_u": 1, "degree_v": 1, "knots_u": [0, 0, 1, 1], "knots_v": [0, 0, 1, 1],
            "control_points": [[[x, 0, 0], [x, 5, 0]], [[x + 10.0, 0, 0], [x + 10.0, 5, 0]]],
            "trims": [[{ "points": [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]] }]],
        })
    }

    #[test]
    fn files_are_one_part_in_their_order_that_reads_back() {
        let mut whole = Composition::default();
        for (name, x, order) in [("a", 0.0, "1"), ("b", 10.0, "2")] {
            whole.add(plate(name, x, order).to_string().as_bytes(), Reading::default(), "").unwrap();
        }
        let faces = whole.faces.clone();
        let text = whole.text();
        let read = surface::read(text.as_bytes(), Reading::default(), "").unwrap();
        assert_eq!(read.geometry, Geometry::Part(crate::engine::sewing::Part { faces }));
        assert_eq!(read.name.as_deref(), Some("a + b"));
        assert_eq!(read.labels, BTreeMap::from([("made".to_owned(), "here".to_owned())]));
        let mut again = Composition::default();
        again.add(text.as_bytes(), Reading::default(), "").unwrap();
        assert_eq!(again.text(), text, "a part is composed of parts");
    }

    #[test]
    fn a_mesh_and_a_faulty_file_are_refused_where_they_are_named() {
        let gltf = json!({ "asset": { "version": "2.0" } }).to_string();
        assert!(Composition::default().add(gltf.as_bytes(), Reading::default(), "/surfaces/1").is_err());
        let mut faulty = plate("a", 0.0, "1");
        faulty["degree_u"] = json!(2);
        let faults = Composition::default().add(faulty.to_string().as_bytes(), Reading::default(), "/x").unwrap_err();
        assert!(faults.iter().all(|fault| fault.pointer.starts_with("/x/")));
    }
}
