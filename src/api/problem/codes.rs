//! The codes that a failed job's problem may have: what went wrong, in a sentence or two.
//!
//! A code refines the type `job-failed` (or `invalid-surface`); it opens as a text under `/problems/{code}` as types do.

/// Code and text, by code.
pub const CODES: &[(&str, &str)] = &[
    (
        "budget-spent",
        "No seed triangle has succeeded in the time that the search was given. Give it more, or name a seed.",
    ),
    ("cancelled", "Somebody cancelled the job before it ended."),
    (
        "circles-miss",
        "The method `mccartney` lays triangles by circles about their neighbours' vertices, and two of these do not meet: the part \
         is too doubly curved for it. `place` says where. Try a coarser mesh, or another method.",
    ),
    ("crashed", "The job ended the whole program, several times; it is not tried again. Tell the operator."),
    ("invalid-nurbs", "Degrees, knots, control points or weights do not make a surface. `place` says where."),
    (
        "lines-tangle",
        "Lines of least and of greatest curvature meet out of order near `place`, so that they make no grid. Follow those of \
         least curvature alone (`families: one`), or take another grid.",
    ),
    ("loop-empty", "A trimming loop encloses nothing. Leave it out."),
    ("loop-gap", "The curves of a trimming loop do not meet. Close the gap that `place` names."),
    ("loop-outside-domain", "A trimming loop leaves the surface's domain."),
    ("loop-self-intersection", "A trimming loop crosses itself, so that it has no inside."),
    ("loops-identical", "Two trimming loops run along each other. Leave one of them out."),
    ("loops-intersect", "Two trimming loops cross each other."),
    (
        "loops-too-intricate",
        "The trimming loops need more points than this service works with. Give a coarser tolerance.",
    ),
    ("mesh-closed", "The mesh is closed: it has no border and must be cut before it can be flattened."),
    ("mesh-handles", "The mesh has a handle, like that of a cup: it must be cut before it can be flattened."),
    ("mesh-non-manifold-edge", "More than two triangles share an edge."),
    ("mesh-not-finite", "A coordinate of the mesh is not a number."),
    (
        "mesh-not-orientable",
        "The mesh has one side only, as a Moebius strip has: it must be cut before it can be flattened.",
    ),
    ("mesh-orientation", "Neighbouring triangles of the mesh are turned opposite ways."),
    ("mesh-pinched-vertex", "Parts of the mesh touch at a vertex only."),
    ("mesh-repeated-vertex", "A triangle of the mesh names a vertex twice."),
    ("mesh-t-junction", "A vertex of the mesh lies within an edge of another triangle: there is a crack."),
    ("mesh-too-large", "The mesh has more triangles than this service works with."),
    ("mesh-vertex-out-of-range", "A triangle of the mesh names a vertex that there is not."),
    ("mesh-zero-area", "A triangle of the mesh has no area."),
    ("no-area", "The part has no area at this density: no triangle of the mesh lies inside its loops."),
    (
        "no-polyline",
        "No line of least curvature runs through the surface's domain from end to end, in strips of any width: the method `ampc` \
         has nothing to go by. Try the other direction, or the method `grid`.",
    ),
    (
        "no-predicted-seed-succeeds",
        "None of the seed triangles that the shape points to flattens the mesh without a flip. Let every seed be tried.",
    ),
    (
        "no-seed-succeeds",
        "A triangle turned over from whichever triangle the flattening began. The part is too doubly curved for the method, or \
         its mesh too dense: try a coarser mesh, another reading, or the domain `trimmed`.",
    ),
    (
        "not-a-disc",
        "The mesh is closed, has a handle, or has parts that only touch: cut it so that it is one piece with a border. Holes are \
         allowed.",
    ),
    ("panicked", "The program has a fault that this job met. Tell the operator; other jobs are not touched by it."),
    ("parameter", "A parameter cannot be worked with on this surface. `detail` names it."),
    ("pin-off-surface", "The point of a pin is not on the part. `detail` says which pin and how far away the part is."),
    ("pins-contradict", "Two pins are at one place of the part and are to lie at two places of the pattern."),
    (
        "pins-not-met",
        "The pinned points cannot all come to lie at their targets without a triangle turning over. `detail` names the one that \
         lacks most. Move the targets nearer to how the points lie in the free pattern.",
    ),
    ("polygon", "A cell of the grid could not be divided into triangles. Try another density."),
    (
        "seed-not-found",
        "The place that was given for the seed lies in no triangle of the mesh, or no triangle has the corners that were given.",
    ),
    ("seed-out-of-range", "The seed is no triangle of the mesh. `detail` says how many there are."),
    ("several-pieces", "The mesh has several pieces that no edge joins, and the flattening begins in one of them."),
    (
        "skew-turns-over",
        "The sampling is skewed so far that triangles of the domain turn over. `place` says which is the first. Take a smaller \
         skew, or another configuration.",
    ),
    (
        "thin-in-part",
        "Thin triangles at the border of the base surface were to be left out, but the part needs some of them. Keep them \
         (`drop_thin: false`).",
    ),
    ("timed-out", "The job took longer than a job may. Try a coarser mesh, or a given seed."),
    (
        "too-curved",
        "The mesh is curved so strongly that no map without a flip can be held in numbers of sixteen digits. Divide the part, or \
         cut darts into it.",
    ),
    ("too-many-triangles", "The density that was asked for needs more triangles than this service works with."),
    (
        "triangle-flipped",
        "A triangle turned over while the part was flattened from the seed that was asked for. `place` says which and at what \
         level. Try another seed (`optimum` tries all), a coarser mesh, or another reading.",
    ),
    ("unreadable", "The stored job or surface cannot be read. Tell the operator."),
];

/// What a code means.
#[must_use]
pub fn meaning(code: &str) -> Option<&'static str> {
    CODES.iter().find(|(name, _)| *name == code).map(|(_, text)| *text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::api::problem::Kind;

    #[test]
    fn codes_are_sorted_and_no_code_is_the_name_of_a_type() {
        assert!(CODES.is_sorted_by(|a, b| a.0 < b.0));
        assert!(CODES.iter().all(|(code, _)| Kind::by_slug(code).is_none()));
    }

    #[test]
    fn every_code_of_the_engine_has_a_text() {
        let sources = [
            include_str!("../../engine/error.rs"),
            include_str!("../../engine/mesh/fault.rs"),
            include_str!("../../engine/nurbs/error.rs"),
            include_str!("../../engine/trimming/error.rs"),
            include_str!("../../engine/triangulation/error.rs"),
            include_str!("../../engine/flattening/error.rs"),
        ];
        let mut found = 0;
        for source in sources {
            let (_, rest) = source.rsplit_once("fn code(&self) -> &'static str {").expect("the codes of an error");
            let (body, _) = rest.split_once("\n    }").expect("the end of a function");
            for code in body.split('"').skip(1).step_by(2) {
                assert!(meaning(code).is_some(), "{code} has no text");
                found += 1;
            }
        }
        assert!(found >= 25, "{found}");
    }
}
