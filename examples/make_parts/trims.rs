//! Trimming loops: polygons with sharp or rounded corners, ellipses, smooth curves through points.

use glam::DVec2;
use planish::engine::nurbs::Curve2;
use planish::engine::trimming::{TrimCurve, TrimLoop, TrimShape};

use super::shapes::{knots, tidy};

fn points(list: &[DVec2]) -> Vec<DVec2> {
    let size = list.iter().map(|p| p.abs().max_element()).fold(f64::MIN_POSITIVE, f64::max);
    // One size for a whole part's loops would be better still; powers of ten are coarse enough to agree at joints.
    list.iter().map(|p| DVec2::new(tidy(p.x, size), tidy(p.y, size))).collect()
}

fn nurbs(degree: usize, vector: Vec<f64>, control: &[DVec2], weights: Option<Vec<f64>>) -> TrimCurve {
    let weights = weights.map(|w| w.into_iter().map(|w| tidy(w, 1.0)).collect());
    let curve = Curve2::new(knots(degree, vector), points(control), weights).expect("the example's curve is sound");
    TrimCurve { shape: TrimShape::Nurbs(curve), reversed: false }
}

fn line(from: DVec2, to: DVec2) -> TrimCurve {
    nurbs(1, vec![0.0, 0.0, 1.0, 1.0], &[from, to], None)
}

/// A closed polygon as one polyline.
pub(crate) fn polygon(corners: &[[f64; 2]]) -> TrimLoop {
    let mut list: Vec<DVec2> = corners.iter().map(|p| DVec2::from_array(*p)).collect();
    list.push(list[0]);
    TrimLoop { curves: vec![TrimCurve { shape: TrimShape::Polyline(points(&list)), reversed: false }] }
}

/// A polygon with each corner rounded by an arc of the given radius, lines and exact arcs in turn.
pub(crate) fn rounded(corners: &[[f64; 2]], radius: f64) -> TrimLoop {
    let list: Vec<DVec2> = corners.iter().map(|p| DVec2::from_array(*p)).collect();
    let count = list.len();
    let arcs: Vec<[DVec2; 3]> = (0..count)
        .map(|i| {
            let (before, corner, after) = (list[(i + count - 1) % count], list[i], list[(i + 1) % count]);
            let (a, b) = ((before - corner).normalize(), (after - corner).normalize());
            let half = 0.5 * a.angle_to(b).abs();
            let reach = radius / half.tan();
            [corner + a * reach, corner, corner + b * reach]
        })
        .collect();
    let mut curves = Vec::new();
    for i in 0..count {
        let [from, corner, to] = arcs[i];
        // The weight of the middle point is the cosine of half the arc's angle: the sine of half the corner's.
        let half = 0.5 * (from - corner).angle_to(to - corner).abs();
        curves.push(nurbs(
            2,
            vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0],
            &[from, corner, to],
            Some(vec![1.0, half.sin(), 1.0]),
        ));
        curves.push(line(to, arcs[(i + 1) % count][0]));
    }
    TrimLoop { curves }
}

/// A rectangle's corners, anticlockwise.
pub(crate) fn rectangle(low: [f64; 2], high: [f64; 2]) -> [[f64; 2]; 4] {
    [low, [high[0], low[1]], high, [low[0], high[1]]]
}

/// An ellipse with its axes along u and v, exact, as one closed curve.
pub(crate) fn ellipse(centre: [f64; 2], radii: [f64; 2]) -> TrimLoop {
    let square = [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]];
    let control: Vec<DVec2> = square
        .iter()
        .map(|p| DVec2::from_array(centre) + DVec2::from_array(radii) * DVec2::new(f64::from(p[0]), f64::from(p[1])))
        .collect();
    let weights = (0..9).map(|i| if i % 2 == 0 { 1.0 } else { std::f64::consts::FRAC_1_SQRT_2 }).collect();
    let vector = vec![0.0, 0.0, 0.0, 0.25, 0.25, 0.5, 0.5, 0.75, 0.75, 1.0, 1.0, 1.0];
    TrimLoop { curves: vec![nurbs(2, vector, &control, Some(weights))] }
}

/// A circle.
pub(crate) fn circle(centre: [f64; 2], radius: f64) -> TrimLoop {
    ellipse(centre, [radius; 2])
}

/// A smooth closed curve through points: cubic pieces whose tangents are parallel to their neighbours' chord.
pub(crate) fn smooth(through: &[[f64; 2]]) -> TrimLoop {
    let list: Vec<DVec2> = through.iter().map(|p| DVec2::from_array(*p)).collect();
    let count = list.len();
    let at = |i: usize| list[i % count];
    let curves = (0..count)
        .map(|i| {
            let (from, to) = (at(i), at(i + 1));
            let (start, end) = ((to - at(i + count - 1)) / 6.0, (at(i + 2) - from) / 6.0);
            nurbs(3, vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], &[from, from + start, to - end, to], None)
        })
        .collect();
    TrimLoop { curves }
}
