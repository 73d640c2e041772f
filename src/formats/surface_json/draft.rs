//! First pass over a surface file: every field into an array of its own, unchecked against the others.
//!
//! Faults that a value shows by itself are found here (wrong type, a number that is not finite, ragged rows, unknown or
//! repeated fields, too much of something); what needs several fields is the second pass's ([`super::check`]). A number
//! that is at fault is kept as NaN, so that the places of all others stay right.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use super::limits::{MAX_LABEL_NAME, MAX_LABELS, MAX_TEXT, ReadLimits};
use super::text::{JsonText, Kind, SyntaxError};
use crate::engine::nurbs::MAX_DEGREE;
use crate::engine::sewing::MAX_FACES;
use crate::engine::trimming::Side;
use crate::formats::faults::{FaultList, Step, pointer};
use crate::formats::units::Units;

/// A field of the file.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) enum Field<T> {
    /// Not there, or `null`.
    #[default]
    Missing,
    /// There, but of no use; its fault is noted.
    Bad,
    /// There.
    Given(T),
}

impl<T> Field<T> {
    pub(super) fn given(self) -> Option<T> {
        match self {
            Self::Given(value) => Some(value),
            Self::Missing | Self::Bad => None,
        }
    }

    pub(super) const fn as_ref(&self) -> Option<&T> {
        match self {
            Self::Given(value) => Some(value),
            Self::Missing | Self::Bad => None,
        }
    }

    pub(super) const fn is_missing(&self) -> bool {
        matches!(self, Self::Missing)
    }
}

/// Rows of equal length, one after the other.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Rows<T> {
    pub(super) count: usize,
    pub(super) columns: usize,
    pub(super) values: Vec<T>,
    /// False when some row had another length than the first.
    pub(super) even: bool,
}

/// A trimming curve.
#[derive(Debug, Default)]
pub(super) struct CurveDraft {
    pub(super) is_object: bool,
    pub(super) degree: Field<usize>,
    pub(super) knots: Field<Vec<f64>>,
    pub(super) control: Field<Vec<DVec2>>,
    pub(super) weights: Field<Vec<f64>>,
    pub(super) points: Field<Vec<DVec2>>,
    pub(super) reversed: bool,
}

/// A surface file.
#[derive(Debug, Default)]
pub(super) struct SurfaceDraft {
    pub(super) is_object: bool,
    pub(super) name: Option<String>,
    pub(super) units: Field<Units>,
    pub(super) side: Field<Side>,
    pub(super) degree_u: Field<usize>,
    pub(super) degree_v: Field<usize>,
    pub(super) knots_u: Field<Vec<f64>>,
    pub(super) knots_v: Field<Vec<f64>>,
    pub(super) control: Field<Rows<DVec3>>,
    pub(super) weights: Field<Rows<f64>>,
    pub(super) trims: Vec<Vec<CurveDraft>>,
    /// The faces of a part of several.
    pub(super) faces: Field<Vec<SurfaceDraft>>,
    /// Names of fields that belong to a surface by itself and were given.
    pub(super) own: Vec<&'static str>,
    pub(super) labels: BTreeMap<String, String>,
}

const SURFACE_FIELDS: [&str; 13] = [
    "name",
    "units",
    "side",
    "degree_u",
    "degree_v",
    "knots_u",
    "knots_v",
    "control_points",
    "weights",
    "trims",
    "labels",
    "extra",
    "faces",
];
/// Fields that a part of several faces does not have: its faces do.
const OWN_FIELDS: [&str; 7] = ["degree_u", "degree_v", "knots_u", "knots_v", "control_points", "weights", "trims"];
const CURVE_FIELDS: [&str; 7] = ["degree", "knots", "control_points", "weights", "points", "reversed", "extra"];

/// Reads a whole file. `Err` when the text is not JSON: what was found before is in `faults` all the same.
pub(super) fn read(
    text: &str,
    prefix: &str,
    limits: &ReadLimits,
    faults: &mut FaultList,
) -> Result<SurfaceDraft, (SyntaxError, String)> {
    let mut reader =
        DraftReader { text: JsonText::new(text), steps: Vec::new(), prefix, limits, faults, curves: 0, trim_points: 0 };
    let draft = reader.surface(false).and_then(|draft| reader.text.end().map(|()| draft));
    draft.map_err(|error| (error, pointer(prefix, &reader.steps)))
}

struct DraftReader<'a> {
    text: JsonText<'a>,
    /// Where the reader is. Left as it is on a syntax error, so that the error has its place.
    steps: Vec<Step>,
    prefix: &'a str,
    limits: &'a ReadLimits,
    faults: &'a mut FaultList,
    curves: usize,
    trim_points: usize,
}

type Read<T> = Result<T, SyntaxError>;

impl DraftReader<'_> {
    fn fault(&mut self, detail: impl Into<String>) {
        self.faults.add(pointer(self.prefix, &self.steps), detail);
    }

    fn within<T>(&mut self, step: Step, read: impl FnOnce(&mut Self) -> Read<T>) -> Read<T> {
        self.steps.push(step);
        let value = read(self)?;
        self.steps.pop();
        Ok(value)
    }

    /// True when a value of this kind comes next; else notes what stands there instead and passes over it.
    fn is(&mut self, wanted: Kind) -> Read<bool> {
        let found = self.text.kind()?;
        if found == wanted {
            return Ok(true);
        }
        self.fault(format!("{} is needed here, this is {}", wanted.words(), found.words()));
        self.text.skip()?;
        Ok(false)
    }

    /// True when `null` comes next, which is passed over.
    fn is_null(&mut self) -> Read<bool> {
        if self.text.kind()? == Kind::Null {
            self.text.null()?;
            return Ok(true);
        }
        Ok(false)
    }

    /// Reads an object field by field. Returns false when there was no object.
    fn object(
        &mut self,
        fields: &'static [&'static str],
        mut read: impl FnMut(&mut Self, &'static str) -> Read<()>,
    ) -> Read<bool> {
        if !self.is(Kind::Object)? {
            return Ok(false);
        }
        self.text.enter_object()?;
        let mut seen = vec![false; fields.len()];
        let mut first = true;
        while let Some(name) = self.text.next_field(first)? {
            first = false;
            let Some(index) = fields.iter().position(|f| *f == name) else {
                let detail = unknown_field(&name, fields);
                self.within(Step::Named(name.chars().take(MAX_TEXT).collect()), |r| {
                    r.fault(detail);
                    r.text.skip()
                })?;
                continue;
            };
            self.within(Step::Field(fields[index]), |r| {
                if std::mem::replace(&mut seen[index], true) {
                    r.fault("this field is given twice: keep one of them");
                    return r.text.skip();
                }
                read(r, fields[index])
            })?;
        }
        Ok(true)
    }

    /// Reads an array; `read` gets the index of each element. Beyond `limit` elements are passed over, with one fault.
    /// Returns false when there was no array.
    fn array(&mut self, limit: usize, what: &str, mut read: impl FnMut(&mut Self, usize) -> Read<()>) -> Read<bool> {
        if !self.is(Kind::Array)? {
            return Ok(false);
        }
        self.text.enter_array()?;
        let mut index = 0;
        while self.text.next_element(index == 0)? {
            if index < limit {
                self.within(Step::Index(index), |r| read(r, index))?;
            } else {
                if index == limit {
                    self.fault(format!("more than {limit} {what}: this is more than can be worked on"));
                }
                self.text.skip()?;
            }
            index += 1;
        }
        Ok(true)
    }

    /// A finite number; NaN with a fault when there is none.
    fn number(&mut self) -> Read<f64> {
        if self.text.kind()? == Kind::Text {
            self.fault("a number is needed here, this is a text: leave out the quotes");
            self.text.skip()?;
            return Ok(f64::NAN);
        }
        if !self.is(Kind::Number)? {
            return Ok(f64::NAN);
        }
        let (value, text) = self.text.number()?;
        if value.is_finite() {
            return Ok(value);
        }
        let shown: String = text.chars().take(24).collect();
        if text.starts_with(|c: char| c.is_ascii_digit()) || text[1..].starts_with(|c: char| c.is_ascii_digit()) {
            self.fault(format!("{shown} is larger than any number that can be worked with"));
        } else {
            self.fault(format!("{shown} is not a number: the program that wrote this file failed to compute it"));
        }
        Ok(f64::NAN)
    }

    /// A surface, or a face of a part of several.
    fn surface(&mut self, is_face: bool) -> Read<SurfaceDraft> {
        let mut draft = SurfaceDraft::default();
        draft.is_object = self.object(&SURFACE_FIELDS, |r, field| {
            if OWN_FIELDS.contains(&field) {
                draft.own.push(field);
            }
            match field {
                "units" | "labels" | "faces" if is_face => {
                    r.fault("this stands once, beside the list of faces, not in a face");
                    r.text.skip()?;
                }
                "name" => draft.name = r.optional_text()?.given(),
                "units" => draft.units = r.units()?,
                "side" => draft.side = r.side()?,
                "degree_u" => draft.degree_u = r.degree()?,
                "degree_v" => draft.degree_v = r.degree()?,
                "knots_u" => draft.knots_u = r.numbers(r.limits.control_points + MAX_DEGREE + 1, "knots")?,
                "knots_v" => draft.knots_v = r.numbers(r.limits.control_points + MAX_DEGREE + 1, "knots")?,
                "control_points" => draft.control = r.rows("points", Self::point)?,
                "weights" => draft.weights = r.rows("weights", Self::number)?,
                "trims" => draft.trims = r.trims()?,
                "labels" => draft.labels = r.labels()?,
                "faces" => draft.faces = r.faces()?,
                _ => r.text.skip()?,
            }
            Ok(())
        })?;
        Ok(draft)
    }

    fn faces(&mut self) -> Read<Field<Vec<SurfaceDraft>>> {
        if self.is_null()? {
            return Ok(Field::Missing);
        }
        let mut faces = Vec::new();
        let is_array = self.array(MAX_FACES, "faces", |r, _| {
            faces.push(r.surface(true)?);
            Ok(())
        })?;
        Ok(if is_array { Field::Given(faces) } else { Field::Bad })
    }

    fn optional_text(&mut self) -> Read<Field<String>> {
        if self.is_null()? {
            return Ok(Field::Missing);
        }
        if !self.is(Kind::Text)? {
            return Ok(Field::Bad);
        }
        let text = self.text.string()?.into_owned();
        if text.chars().count() > MAX_TEXT {
            self.fault(format!("this text has more than {MAX_TEXT} characters: shorten it"));
            return Ok(Field::Bad);
        }
        Ok(Field::Given(text))
    }

    fn units(&mut self) -> Read<Field<Units>> {
        let text = match self.optional_text()? {
            Field::Given(text) => text,
            Field::Missing => return Ok(Field::Missing),
            Field::Bad => return Ok(Field::Bad),
        };
        let units = Units::ALL.into_iter().find(|u| u.symbol() == text);
        if units.is_none() {
            self.fault("units are one of \"mm\", \"cm\", \"m\", \"in\", \"ft\"");
        }
        Ok(units.map_or(Field::Bad, Field::Given))
    }

    fn side(&mut self) -> Read<Field<Side>> {
        match self.optional_text()? {
            Field::Missing => Ok(Field::Missing),
            Field::Given(text) if text == "normal" => Ok(Field::Given(Side::Normal)),
            Field::Given(text) if text == "reversed" => Ok(Field::Given(Side::Reversed)),
            Field::Given(_) => {
                self.fault("side is \"normal\" (the side that Su x Sv points to) or \"reversed\"");
                Ok(Field::Bad)
            }
            Field::Bad => Ok(Field::Bad),
        }
    }

    fn degree(&mut self) -> Read<Field<usize>> {
        let value = self.number()?;
        if value.is_nan() {
            return Ok(Field::Bad);
        }
        if value.fract() != 0.0 || value < 1.0 || value > MAX_DEGREE as f64 {
            self.fault(format!("a degree is a whole number from 1 to {MAX_DEGREE}"));
            return Ok(Field::Bad);
        }
        Ok(Field::Given(value as usize))
    }

    fn numbers(&mut self, limit: usize, what: &str) -> Read<Field<Vec<f64>>> {
        if self.is_null()? {
            return Ok(Field::Missing);
        }
        let mut values = Vec::new();
        let is_array = self.array(limit, what, |r, _| {
            values.push(r.number()?);
            Ok(())
        })?;
        Ok(if is_array { Field::Given(values) } else { Field::Bad })
    }

    /// `N` coordinates; NaN where one is at fault.
    fn coordinates<const N: usize>(&mut self, hint: &str) -> Read<[f64; N]> {
        let mut out = [f64::NAN; N];
        let mut count = 0;
        let is_array = self.array(usize::MAX, "coordinates", |r, index| {
            count = index + 1;
            if index < N {
                out[index] = r.number()?;
                Ok(())
            } else {
                r.text.skip()
            }
        })?;
        if is_array && count != N {
            self.fault(format!("a point has {N} coordinates here, this one has {count}{hint}"));
            out = [f64::NAN; N];
        }
        Ok(out)
    }

    fn point(&mut self) -> Read<DVec3> {
        self.coordinates::<3>(" (weights stand apart, under \"weights\")").map(DVec3::from_array)
    }

    fn trim_point(&mut self) -> Read<DVec2> {
        self.coordinates::<2>(" (trimming curves lie in the surface's u and v)").map(DVec2::from_array)
    }

    fn rows<T>(&mut self, what: &str, mut read: impl FnMut(&mut Self) -> Read<T>) -> Read<Field<Rows<T>>> {
        if self.is_null()? {
            return Ok(Field::Missing);
        }
        let limit = self.limits.control_points;
        let mut out = Rows { count: 0, columns: 0, values: Vec::new(), even: true };
        let is_array = self.array(limit, "rows", |r, row| {
            let room = limit - out.values.len();
            let before = out.values.len();
            let is_row = r.array(room, what, |r, _| {
                out.values.push(read(r)?);
                Ok(())
            })?;
            out.count = row + 1;
            let length = out.values.len() - before;
            if !is_row {
                out.even = false;
            } else if row == 0 {
                out.columns = length;
            } else if length != out.columns {
                out.even = false;
                r.fault(format!("this row has {length} {what}, the first row {}: all rows need the same", out.columns));
            }
            Ok(())
        })?;
        Ok(if is_array { Field::Given(out) } else { Field::Bad })
    }

    fn trims(&mut self) -> Read<Vec<Vec<CurveDraft>>> {
        let mut loops = Vec::new();
        if self.is_null()? {
            return Ok(loops);
        }
        self.array(self.limits.loops, "trimming loops", |r, _| {
            let room = r.limits.curves - r.curves;
            let mut curves = Vec::new();
            let is_array = r.array(room, "trimming curves", |r, _| {
                r.curves += 1;
                let curve = r.curve()?;
                curves.push(curve);
                Ok(())
            })?;
            if is_array && curves.is_empty() && room > 0 {
                r.fault("this trimming loop has no curves: leave it out");
            }
            loops.push(curves);
            Ok(())
        })?;
        Ok(loops)
    }

    fn curve(&mut self) -> Read<CurveDraft> {
        let mut draft = CurveDraft::default();
        draft.is_object = self.object(&CURVE_FIELDS, |r, field| {
            let limit = r.limits.trim_points;
            match field {
                "degree" => draft.degree = r.degree()?,
                "knots" => draft.knots = r.numbers(limit + MAX_DEGREE + 1, "knots")?,
                "control_points" => draft.control = r.trim_points()?,
                "weights" => draft.weights = r.numbers(limit, "weights")?,
                "points" => draft.points = r.trim_points()?,
                "reversed" => {
                    if !r.is_null()? && r.is(Kind::Bool)? {
                        draft.reversed = r.text.boolean()?;
                    }
                }
                _ => r.text.skip()?,
            }
            Ok(())
        })?;
        Ok(draft)
    }

    fn trim_points(&mut self) -> Read<Field<Vec<DVec2>>> {
        if self.is_null()? {
            return Ok(Field::Missing);
        }
        let mut points = Vec::new();
        let room = self.limits.trim_points - self.trim_points;
        let is_array = self.array(room, "points of trimming curves", |r, _| {
            r.trim_points += 1;
            points.push(r.trim_point()?);
            Ok(())
        })?;
        Ok(if is_array { Field::Given(points) } else { Field::Bad })
    }

    fn labels(&mut self) -> Read<BTreeMap<String, String>> {
        let mut labels = BTreeMap::new();
        if self.is_null()? || !self.is(Kind::Object)? {
            return Ok(labels);
        }
        self.text.enter_object()?;
        let mut first = true;
        let mut overfull = false;
        while let Some(key) = self.text.next_field(first)? {
            first = false;
            let key = key.into_owned();
            if labels.len() == MAX_LABELS && !labels.contains_key(&key) {
                if !std::mem::replace(&mut overfull, true) {
                    self.fault(format!("more than {MAX_LABELS} labels"));
                }
                self.text.skip()?;
                continue;
            }
            self.within(Step::Named(key.chars().take(MAX_TEXT).collect()), |r| {
                if key.is_empty() || key.chars().count() > MAX_LABEL_NAME {
                    r.fault(format!("a label's name has 1 to {MAX_LABEL_NAME} characters"));
                }
                if labels.contains_key(&key) {
                    r.fault("this label is given twice: keep one of them");
                }
                if r.text.kind()? != Kind::Text {
                    r.fault("a label is a text: put it in quotes");
                    return r.text.skip();
                }
                if let Field::Given(text) = r.optional_text()? {
                    labels.insert(key, text);
                }
                Ok(())
            })?;
        }
        Ok(labels)
    }
}

fn unknown_field(name: &str, fields: &[&'static str]) -> String {
    let near = fields.iter().map(|f| (edit_distance(name, f), f)).min();
    match near {
        Some((distance, field)) if distance <= 2 => {
            format!("this field is not known: did you mean \"{field}\"?")
        }
        _ => "this field is not known: what is your own goes under \"extra\"".to_owned(),
    }
}

/// Letters to insert, remove or replace to make `a` of `b` (Levenshtein); 99 for a name too long to be a slip.
fn edit_distance(a: &str, b: &str) -> usize {
    if a.len() > 2 * b.len() + 2 {
        return 99;
    }
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, cb) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(ca.to_ascii_lowercase() != *cb);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_the_pen_is_recognised() {
        assert!(unknown_field("knot_u", &SURFACE_FIELDS).contains("knots_u"));
        assert!(unknown_field("Units", &SURFACE_FIELDS).contains("units"));
        assert!(unknown_field("material", &SURFACE_FIELDS).contains("extra"));
    }
}
