//! Second pass over a surface file: the fields against each other, then the engine's own types.
//!
//! Faults are found field by field and curve by curve, so that one bad knot vector does not hide another. The loops as
//! such (gaps, crossings) are judged by the engine when nothing else is wrong.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use super::ReadOptions;
use super::draft::{CurveDraft, Field, Rows, SurfaceDraft};
use super::limits::{
    MAX_COORDINATE_MM, MAX_PARAMETER, MAX_WEIGHT_RATIO, MIN_DOMAIN, MIN_DOMAIN_RELATIVE, MIN_EXTENT_MM,
    MIN_EXTENT_RELATIVE,
};
use crate::engine::nurbs::{Curve2, KnotVector, Surface};
use crate::engine::trimming::{Side, TrimCurve, TrimLoop, TrimShape, TrimmedSurface};
use crate::formats::faults::{FaultList, Step, pointer};
use crate::formats::units::Units;

/// What a draft without faults comes to.
#[derive(Debug)]
pub(super) struct Sound {
    pub(super) name: Option<String>,
    pub(super) units: Units,
    pub(super) labels: BTreeMap<String, String>,
    /// The surface, or the faces of a part.
    pub(super) content: Content,
    pub(super) inferred: Vec<String>,
}

/// What a file holds.
#[derive(Debug)]
pub(super) enum Content {
    Surface(TrimmedSurface),
    Faces(Vec<TrimmedSurface>),
}

/// Checks a draft and makes a surface of it, or the faces of a part. `None` when something is wrong: then `faults` says what.
pub(super) fn check(mut draft: SurfaceDraft, options: &ReadOptions, faults: &mut FaultList) -> Option<Sound> {
    if !draft.is_object {
        return None;
    }
    let mut checker = Checker { prefix: &options.pointer_prefix, faults, inferred: Vec::new() };
    let units = checker.units(&draft.units, options.units);
    let mut inferred = std::mem::take(&mut checker.inferred);
    let millimetres = units.map_or(1.0, Units::millimetres);
    let (name, labels) = (draft.name.take(), std::mem::take(&mut draft.labels));
    let content = match std::mem::take(&mut draft.faces) {
        Field::Missing => checker.trimmed(draft, options.side, millimetres).map(Content::Surface),
        Field::Bad => None,
        Field::Given(faces) => {
            checker.of_part(&draft, &faces, options.limits.control_points);
            let side = options.side;
            let usual = draft.side.given();
            let mut sound = Vec::with_capacity(faces.len());
            for (k, mut face) in faces.into_iter().enumerate() {
                let prefix = format!("{}/faces/{k}", options.pointer_prefix);
                let mut checker = Checker { prefix: &prefix, faults, inferred: Vec::new() };
                if face.side.is_missing()
                    && let Some(usual) = usual
                {
                    face.side = Field::Given(usual);
                }
                if face.is_object {
                    sound.extend(checker.trimmed(face, side, millimetres));
                }
                inferred.extend(checker.inferred.into_iter().map(|said| format!("faces/{k}: {said}")));
            }
            return faults.is_empty().then_some(()).and(Some(Sound {
                name,
                units: units?,
                labels,
                content: Content::Faces(sound),
                inferred,
            }));
        }
    };
    inferred.extend(checker.inferred);
    if !faults.is_empty() {
        return None;
    }
    Some(Sound { name, units: units?, labels, content: content?, inferred })
}

struct Checker<'a> {
    prefix: &'a str,
    faults: &'a mut FaultList,
    inferred: Vec<String>,
}

impl Checker<'_> {
    fn fault(&mut self, steps: &[Step], detail: impl Into<String>) {
        self.faults.add(pointer(self.prefix, steps), detail);
    }

    fn units(&mut self, filed: &Field<Units>, asked: Option<Units>) -> Option<Units> {
        match (filed, asked) {
            (Field::Given(filed), Some(asked)) if *filed != asked => {
                self.inferred.push(format!(
                    "units: {} as the request says, not {} as the file does",
                    asked.symbol(),
                    filed.symbol()
                ));
            }
            (Field::Missing, None) => self.fault(
                &[Step::Field("units")],
                "the unit of length is missing: say \"units\": \"mm\" (or cm, m, in, ft) in the file, or ?units=mm in \
                 the request. It is not guessed, since a wrong guess gives a pattern 10 or 1000 times too small",
            ),
            _ => {}
        }
        asked.or_else(|| filed.as_ref().copied())
    }

    /// A surface by itself, or a face. Side: as the request says, else as the file does.
    fn trimmed(&mut self, draft: SurfaceDraft, side: Option<Side>, millimetres: f64) -> Option<TrimmedSurface> {
        let side = match (side, draft.side.given()) {
            (Some(asked), Some(filed)) if asked != filed => {
                self.inferred.push("side: as the request says, not as the file does".to_owned());
                asked
            }
            (Some(asked), _) => asked,
            (None, filed) => filed.unwrap_or_default(),
        };
        let surface = self.surface(
            [draft.degree_u, draft.degree_v],
            [draft.knots_u, draft.knots_v],
            draft.control,
            draft.weights,
            millimetres,
        );
        let loops = draft
            .trims
            .into_iter()
            .enumerate()
            .map(|(l, curves)| {
                let curves = curves.into_iter().enumerate();
                TrimLoop { curves: curves.filter_map(|(c, curve)| self.curve(l, c, curve)).collect() }
            })
            .collect();
        Some(TrimmedSurface { surface: surface?, loops, side })
    }

    /// What a part of several faces may and must have.
    fn of_part(&mut self, draft: &SurfaceDraft, faces: &[SurfaceDraft], limit: usize) {
        for &name in &draft.own {
            self.fault(
                &[Step::Field(name)],
                "this belongs to a face: where there is a list of faces it stands in each",
            );
        }
        if faces.is_empty() {
            self.fault(&[Step::Field("faces")], "the list is empty: a part has at least one face");
        }
        let points: usize = faces.iter().filter_map(|face| face.control.as_ref()).map(|net| net.values.len()).sum();
        if points > limit {
            let detail = format!("more than {limit} control points in all faces: this is more than can be worked on");
            self.fault(&[Step::Field("faces")], detail);
        }
    }

    /// Notes that a required field is not there.
    fn require<T>(&mut self, at: &[Step], name: &'static str, field: &Field<T>, what: &str) {
        if field.is_missing() {
            let mut steps = at.to_vec();
            steps.push(Step::Field(name));
            self.fault(&steps, format!("{what} is missing"));
        }
    }

    fn surface(
        &mut self,
        degrees: [Field<usize>; 2],
        knots: [Field<Vec<f64>>; 2],
        control: Field<Rows<DVec3>>,
        weights: Field<Rows<f64>>,
        millimetres: f64,
    ) -> Option<Surface> {
        let names = [("degree_u", "knots_u"), ("degree_v", "knots_v")];
        for (k, (degree, knot)) in names.iter().enumerate() {
            self.require(&[], degree, &degrees[k], "the degree");
            self.require(&[], knot, &knots[k], "the knot vector");
        }
        self.require(&[], "control_points", &control, "the control net");
        let size = control.as_ref().map(|net| [net.count, net.columns]);
        let [knots_u, knots_v] = knots;
        let [degree_u, degree_v] = degrees;
        let even = control.as_ref().is_some_and(|net| net.even);
        let u = self.knots(
            &[Step::Field("knots_u")],
            degree_u.given(),
            size.map(|s| s[0]),
            knots_u.given(),
            "rows of control points",
        );
        let v = self.knots(
            &[Step::Field("knots_v")],
            degree_v.given(),
            size.map(|s| s[1]).filter(|_| even),
            knots_v.given(),
            "control points in a row",
        );
        let weights = match weights {
            Field::Given(w) => {
                if let Some([rows, columns]) = size.filter(|_| even && w.even)
                    && [w.count, w.columns] != [rows, columns]
                {
                    self.fault(
                        &[Step::Field("weights")],
                        format!("{} x {} weights where the control net is {rows} x {columns}", w.count, w.columns),
                    );
                }
                let columns = w.columns.max(1);
                let even = w.even;
                self.weights(&w.values, |i| {
                    let mut steps = vec![Step::Field("weights")];
                    if even {
                        steps.extend([Step::Index(i / columns), Step::Index(i % columns)]);
                    }
                    steps
                });
                Some(w.values)
            }
            Field::Missing | Field::Bad => None,
        };
        let net = control.given()?;
        let columns = net.columns.max(1);
        let mut points = net.values;
        for p in &mut points {
            *p *= millimetres;
        }
        self.coordinates(&points, columns, net.even);
        Surface::new(u?, v?, points, weights).map_err(|e| self.unforeseen(&[], &e)).ok()
    }

    /// An engine type refuses what passed here: said as the engine says it, unless a fault explains it already.
    fn unforeseen(&mut self, at: &[Step], error: &crate::engine::nurbs::NurbsError) {
        if self.faults.is_empty() {
            self.fault(at, error.to_string());
        }
    }

    fn coordinates(&mut self, points: &[DVec3], columns: usize, even: bool) {
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        for (i, p) in points.iter().enumerate() {
            low = low.min(*p);
            high = high.max(*p);
            if p.abs().max_element() > MAX_COORDINATE_MM {
                let mut steps = vec![Step::Field("control_points")];
                if even {
                    steps.extend([Step::Index(i / columns), Step::Index(i % columns)]);
                }
                self.fault(&steps, "this point is more than 1000 km from the origin: check the units");
            }
        }
        if points.iter().any(|p| !p.is_finite()) || points.is_empty() {
            return;
        }
        let extent = (high - low).max_element();
        let size = low.abs().max(high.abs()).max_element();
        if extent < MIN_EXTENT_MM {
            self.fault(
                &[Step::Field("control_points")],
                "the control points all lie in one place: the surface has no extent",
            );
        } else if extent < MIN_EXTENT_RELATIVE * size {
            self.fault(
                &[Step::Field("control_points")],
                "the surface is too small for its distance from the origin to be told apart from rounding: move it closer",
            );
        }
    }

    fn weights(&mut self, weights: &[f64], at: impl Fn(usize) -> Vec<Step>) {
        let mut low = (f64::INFINITY, 0);
        let mut high = 0.0_f64;
        for (i, w) in weights.iter().enumerate() {
            if *w <= 0.0 {
                self.fault(&at(i), "a weight must be greater than 0");
            } else {
                high = high.max(*w);
                if *w < low.0 {
                    low = (*w, i);
                }
            }
        }
        if high > MAX_WEIGHT_RATIO * low.0 {
            self.fault(
                &at(low.1),
                format!("the weights differ by more than a factor of {MAX_WEIGHT_RATIO:e}: this cannot be computed exactly enough"),
            );
        }
    }

    /// Checks a knot vector; completes one without its first and last knot.
    fn knots(
        &mut self,
        at: &[Step],
        degree: Option<usize>,
        count: Option<usize>,
        knots: Option<Vec<f64>>,
        counted: &str,
    ) -> Option<KnotVector> {
        let mut knots = knots?;
        let step = |index: usize| {
            let mut steps = at.to_vec();
            steps.push(Step::Index(index));
            steps
        };
        let mut sound = knots.iter().all(|k| k.is_finite());
        for (i, pair) in knots.windows(2).enumerate() {
            if pair[1] < pair[0] {
                self.fault(
                    &step(i + 1),
                    format!("{} is smaller than the knot before it, {}: knots may not decrease", pair[1], pair[0]),
                );
                sound = false;
            }
        }
        for (i, k) in knots.iter().enumerate() {
            if k.abs() > MAX_PARAMETER {
                self.fault(
                    &step(i),
                    format!("knots beyond {MAX_PARAMETER:e} cannot be worked with: scale the parameters"),
                );
                sound = false;
            }
        }
        let degree = degree?;
        let count = count?;
        if count <= degree {
            self.fault(
                at,
                format!("{count} {counted} are too few for degree {degree}: at least {} are needed", degree + 1),
            );
            return None;
        }
        let full = count + degree + 1;
        if knots.len() == full - 2 && knots.len() >= 2 {
            let (first, last) = (knots[0], knots[knots.len() - 1]);
            knots.insert(0, first);
            knots.push(last);
            let name = pointer("", at);
            self.inferred.push(format!(
                "{name}: {} knots as some programs count them (without the first and the last); these two were added",
                full - 2
            ));
        } else if knots.len() != full {
            self.fault(
                at,
                format!(
                    "{} knots where {count} {counted} of degree {degree} need {full} (control points + degree + 1), \
                     or {} without the first and the last",
                    knots.len(),
                    full - 2
                ),
            );
            return None;
        }
        if !sound {
            return None;
        }
        let (low, high) = (knots[degree], knots[count]);
        let size = low.abs().max(high.abs());
        if high - low <= (MIN_DOMAIN_RELATIVE * size).max(MIN_DOMAIN) {
            self.fault(
                at,
                format!("the domain from {low} to {high} has no length: the parameters cannot be told apart"),
            );
            return None;
        }
        if let Some(i) = knots.windows(degree + 2).position(|w| w[0] == w[degree + 1]) {
            let value = knots[i];
            let times = knots.iter().filter(|k| **k == value).count();
            self.fault(
                at,
                format!("the knot {value} stands {times} times: at most {} (degree + 1) have a meaning", degree + 1),
            );
            return None;
        }
        // The name is for the engine's own messages; ours have their pointer.
        KnotVector::new(degree, knots, "knots").map_err(|e| self.unforeseen(at, &e)).ok()
    }

    fn curve(&mut self, l: usize, c: usize, draft: CurveDraft) -> Option<TrimCurve> {
        if !draft.is_object {
            return None;
        }
        let at = [Step::Field("trims"), Step::Index(l), Step::Index(c)];
        let field = |name: &'static str| {
            let mut steps = at.to_vec();
            steps.push(Step::Field(name));
            steps
        };
        let is_nurbs = !(draft.degree.is_missing() && draft.knots.is_missing() && draft.control.is_missing());
        if !draft.points.is_missing() {
            if is_nurbs || !draft.weights.is_missing() {
                self.fault(
                    &at,
                    "a curve is either a polyline (\"points\") or NURBS (degree, knots, control_points), not both",
                );
                return None;
            }
            let points = draft.points.given()?;
            if points.len() < 2 {
                self.fault(&field("points"), "a polyline has at least 2 points");
                return None;
            }
            self.trim_points(&field("points"), &points);
            return Some(TrimCurve { shape: TrimShape::Polyline(points), reversed: draft.reversed });
        }
        if !is_nurbs {
            self.fault(&at, "a trimming curve needs degree, knots and control_points, or points (a polyline)");
            return None;
        }
        self.require(&at, "degree", &draft.degree, "the degree");
        self.require(&at, "knots", &draft.knots, "the knot vector");
        self.require(&at, "control_points", &draft.control, "the list of control points");
        let count = draft.control.as_ref().map(Vec::len);
        let knots = self.knots(&field("knots"), draft.degree.given(), count, draft.knots.given(), "control points");
        if let Some(points) = draft.control.as_ref() {
            self.trim_points(&field("control_points"), points);
        }
        let weights = draft.weights.given();
        if let Some(w) = &weights {
            if count.is_some_and(|n| n != w.len()) {
                self.fault(&field("weights"), format!("{} weights for {} control points", w.len(), count.unwrap_or(0)));
            }
            self.weights(w, |i| {
                let mut steps = field("weights");
                steps.push(Step::Index(i));
                steps
            });
        }
        let curve = Curve2::new(knots?, draft.control.given()?, weights).map_err(|e| self.unforeseen(&at, &e)).ok()?;
        Some(TrimCurve { shape: TrimShape::Nurbs(curve), reversed: draft.reversed })
    }

    fn trim_points(&mut self, at: &[Step], points: &[DVec2]) {
        for (i, p) in points.iter().enumerate() {
            if p.abs().max_element() > MAX_PARAMETER {
                let mut steps = at.to_vec();
                steps.push(Step::Index(i));
                self.fault(&steps, format!("parameters beyond {MAX_PARAMETER:e} cannot be worked with"));
            }
        }
    }
}

/// The word that stands for a side in files and parameters.
pub(super) const fn side_word(side: Side) -> &'static str {
    match side {
        Side::Normal => "normal",
        Side::Reversed => "reversed",
    }
}
