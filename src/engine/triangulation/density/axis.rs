//! One parameter direction as the density rules see it: strips over which needs are sampled, and its kinks.
//!
//! Strips are cut at the knots, so that a strip lies in one polynomial piece; the sample stands at the strip's middle.
//! Parameters are the surface's own. A kink is a knot at which the surface may be continuous only, which is where
//! its multiplicity reaches the degree.

use crate::engine::nurbs::KnotVector;

/// Strips aimed at in one direction when there are few knot spans: more follow a varying curvature more closely and
/// cost second derivatives; what they miss the check on the real cells corrects.
const STRIPS_AIMED: usize = 10;

/// Most strips in one knot span: a polynomial piece of moderate degree varies no more than this resolves.
const STRIPS_PER_SPAN: usize = 8;

/// Strips in one knot span of a degree above three, whose second derivative is curved within the span: its middle alone would
/// tell nothing of its ends. Up to cubic it is at most linear, and the middle is its mean.
const STRIPS_OF_HIGH_DEGREE: usize = 3;

/// Most strips in one direction: a net of thousands of spans is sampled in some of them only.
const STRIPS_MOST: usize = 96;

/// Strips of one direction, from the first edge to the last.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    /// Ends of the strips, strictly increasing; one more than there are strips.
    pub edges: Vec<f64>,
    /// Inner parameters at which the tangent plane may turn.
    pub kinks: Vec<f64>,
    /// The whole domain.
    pub domain: [f64; 2],
    /// True when the surface is a straight line between any two neighbouring knots (degree 1, polynomial).
    pub straight: bool,
}

impl Axis {
    /// Cuts `extents` (a part of the knot vector's domain) into strips.
    pub(super) fn new(knots: &KnotVector, extents: [f64; 2], rational: bool) -> Self {
        let degree = knots.degree();
        let straight = degree == 1 && !rational;
        let mut cuts = vec![extents[0]];
        let mut kinks = Vec::new();
        let all = knots.knots();
        let mut at = 0;
        while at < all.len() {
            let knot = all[at];
            let end = at + all[at..].iter().take_while(|k| **k == knot).count();
            if knot > extents[0] && knot < extents[1] {
                cuts.push(knot);
                if end - at >= degree {
                    kinks.push(knot);
                }
            }
            at = end;
        }
        cuts.push(extents[1]);
        let spans = cuts.len() - 1;
        let edges = if spans > STRIPS_MOST {
            (0..=STRIPS_MOST).map(|k| cuts[k * spans / STRIPS_MOST]).collect()
        } else {
            let least = if degree > 3 { STRIPS_OF_HIGH_DEGREE.min(STRIPS_MOST / spans) } else { 1 };
            let aimed = if straight { 1 } else { STRIPS_AIMED.div_ceil(spans).clamp(least, STRIPS_PER_SPAN) };
            let mut edges = Vec::with_capacity(spans * aimed + 1);
            for w in cuts.windows(2) {
                edges.extend((0..aimed).map(|k| w[0] + (w[1] - w[0]) * k as f64 / aimed as f64));
            }
            edges.push(extents[1]);
            // A span of a few units in the last place cannot be divided: its strips would coincide.
            edges.dedup_by(|later, former| *later <= *former);
            edges
        };
        Self { edges, kinks, domain: knots.domain(), straight }
    }

    /// Number of strips.
    pub(super) fn len(&self) -> usize {
        self.edges.len() - 1
    }

    /// Middle of a strip.
    pub(super) fn middle(&self, strip: usize) -> f64 {
        0.5 * (self.edges[strip] + self.edges[strip + 1])
    }

    /// Width of a strip.
    pub(super) fn width(&self, strip: usize) -> f64 {
        self.edges[strip + 1] - self.edges[strip]
    }

    /// From the first edge to the last.
    pub(super) fn length(&self) -> f64 {
        self.edges[self.len()] - self.edges[0]
    }

    /// The strip that holds a parameter; parameters outside belong to the nearest.
    pub(super) fn strip_of(&self, t: f64) -> usize {
        self.edges.partition_point(|e| *e <= t).clamp(1, self.len()) - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_end_at_knots_and_kinks_are_where_the_multiplicity_reaches_the_degree() {
        let knots = KnotVector::new(2, vec![0.0, 0.0, 0.0, 0.3, 0.5, 0.5, 1.0, 1.0, 1.0], "knots_u").unwrap();
        let axis = Axis::new(&knots, [0.0, 1.0], false);
        assert!(axis.edges.contains(&0.3) && axis.edges.contains(&0.5));
        assert_eq!(axis.kinks, vec![0.5]);
        assert_eq!(axis.len(), 12);
        assert_eq!(axis.strip_of(-1.0), 0);
        assert_eq!(axis.strip_of(1.0), 11);
        let part = Axis::new(&knots, [0.1, 0.4], false);
        assert_eq!((part.edges[0], part.edges[part.len()], part.kinks.len()), (0.1, 0.4, 0));
    }

    #[test]
    fn a_straight_direction_has_one_strip_a_span() {
        let knots = KnotVector::new(1, vec![0.0, 0.0, 0.5, 1.0, 1.0], "knots_v").unwrap();
        let axis = Axis::new(&knots, [0.0, 1.0], false);
        assert_eq!(axis.len(), 2);
        assert_eq!(axis.kinks, vec![0.5]);
    }
}
