//! What a person is to look at in a flattening: places where it lies on itself, and places of much distortion.

use glam::DVec2;

use super::reports;
use crate::engine::budget::Observer;
use crate::engine::distortion::{
    self, BorderPlace, FlatteningReport, HotSpot, Limits, Overlap, OverlapReport, OverlapSide,
};
use crate::engine::error::EngineError;
use crate::engine::mesh::{Mesh, Topology};

/// The most overlaps whose places are told; all are counted.
const MOST_PLACES: usize = 20;

/// A flattening as it lies in the pattern.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lying<'a> {
    /// The mesh.
    pub mesh: &'a Mesh,
    /// Its topology.
    pub topology: &'a Topology,
    /// The places of its vertices in the pattern.
    pub flat: &'a [DVec2],
    /// True when the pattern shows it mirrored.
    pub mirrored: bool,
    /// The triangles that belong to the part; `None`: all.
    pub part: Option<&'a [bool]>,
}

impl Lying<'_> {
    /// Counts and places the overlaps of the part, where no triangle of the flattening is flipped.
    ///
    /// # Errors
    /// [`EngineError::Cancelled`] when the observer asks for it.
    pub(super) fn overlaps(&self, report: &mut FlatteningReport, observer: &dyn Observer) -> Result<(), EngineError> {
        if report.flips > 0 {
            return Ok(());
        }
        let own;
        let topology = match self.part {
            None => self.topology,
            Some(part) => {
                let triangles: Vec<[u32; 3]> =
                    self.mesh.triangles.iter().zip(part).filter(|(_, belongs)| **belongs).map(|(t, _)| *t).collect();
                let Ok(of_part) = Topology::of_triangles(&triangles, self.mesh.positions.len()) else { return Ok(()) };
                own = of_part;
                &own
            }
        };
        // Winding numbers are those of anticlockwise triangles.
        let sign = DVec2::new(if self.mirrored { -1.0 } else { 1.0 }, 1.0);
        let upright: Vec<DVec2> = self.flat.iter().map(|&p| p * sign).collect();
        let found = distortion::overlaps(&upright, topology, observer)?;
        if found.complete {
            report.overlaps = Some(found.regions.len() as u64);
            report.overlap_places =
                found.regions.iter().take(MOST_PLACES).map(|r| self.overlap(topology, r, sign)).collect();
        }
        Ok(())
    }

    fn overlap(&self, topology: &Topology, region: &Overlap, sign: DVec2) -> OverlapReport {
        let side = |place: &BorderPlace| OverlapSide {
            uv: self.mesh.uv.as_deref().map(|uv| place.of(topology, uv).to_array()),
            xyz_mm: place.of(topology, &self.mesh.positions).to_array(),
        };
        OverlapReport {
            area_mm2: region.area_mm2,
            xy_mm: (region.at * sign).to_array(),
            sides: region.places.iter().map(side).collect(),
        }
    }

    /// The hot spots of the part: what exceeds the stricter of the two limits on strain, or stands out when there are none.
    pub(super) fn hot_spots(&self, limits: &Limits) -> Vec<HotSpot> {
        let limit = [limits.stretch_percent, limits.compression_percent].into_iter().flatten().reduce(f64::min);
        distortion::hot_spots(self.mesh, self.topology, self.flat, self.part, limit)
    }

    /// What the report says of overlaps, in a sentence for the warnings; `None` when there are none. `constrained` says that
    /// there are pins or kept lengths, beside which overlaps cannot be removed.
    pub(super) fn warning(report: &FlatteningReport, constrained: bool) -> Option<String> {
        let count = report.overlaps.filter(|&n| n > 0)?;
        let area: f64 = report.overlap_places.iter().map(|o| o.area_mm2).sum();
        let try_next = if report.injective.is_some() || constrained {
            "divide the part"
        } else if report.solver.is_some() || report.developable.is_some() {
            "`flattening.injective: true` lays it so that it can, or divide the part"
        } else {
            "`flattening.method: isometric` with `flattening.injective: true` lays it so that it can, or divide the part"
        };
        Some(format!(
            "the pattern lies on itself in {count} {} ({area:.3} mm^2): it cannot be cut from one sheet as it is; {try_next}",
            if count == 1 { "place" } else { "places" }
        ))
    }

    /// Principal strains of each triangle, percent.
    pub(super) fn strains(&self) -> Vec<[f64; 2]> {
        reports::strains(self.mesh, self.flat)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use glam::DVec3;

    use crate::engine::budget::Unobserved;
    use crate::engine::distortion::HotSpotKind;
    use crate::engine::job::{JobKind, JobOptions};
    use crate::engine::mesh::Mesh;
    use crate::engine::mesh::test_meshes::{Diagonal, grid};
    use crate::engine::nurbs::shapes::{cylinder, sphere};
    use crate::engine::pattern::View;
    use crate::engine::pipeline::{Outcome, SurfaceMesh, run};
    use crate::engine::trimming::{Side, TrimCurve, TrimLoop, TrimShape, TrimmedSurface};

    /// A ruffled ring cut open: its rays all start at one point and wave up and down, so that the angle between neighbours
    /// sums to more than a full turn.
    fn ruffle(at: DVec3) -> Mesh {
        grid(97, 2, Diagonal::Regular, |u, v| {
            let (turn, rise) = (TAU * u, 0.9 * (3.0 * TAU * u).sin());
            at + DVec3::new(turn.cos() * rise.cos(), turn.sin() * rise.cos(), rise.sin()) * (20.0 - 10.0 * v)
        })
    }

    fn flat(surface: &SurfaceMesh, options: &JobOptions) -> Outcome {
        run(JobKind::Flatten, surface, options, &Unobserved).unwrap()
    }

    #[test]
    fn a_pattern_that_lies_on_itself_says_where() {
        for (view, at) in [(View::Show, DVec3::ZERO), (View::Back, DVec3::new(1e3, -2e3, 5e2))] {
            let mut options = JobOptions::default();
            options.placement.view = view;
            let outcome = flat(&SurfaceMesh { mesh: ruffle(at), side: Side::Normal }, &options);
            let report = outcome.report.flattening.as_ref().unwrap();
            assert_eq!((report.overlaps, report.overlap_places.len()), (Some(1), 1), "{report:?}");
            let place = &report.overlap_places[0];
            // What the strip has in excess of a full turn, as a sector between its radii, within what chords leave out.
            let mesh = ruffle(DVec3::ZERO);
            let angle: f64 = (0..96).map(|k| mesh.positions[k].angle_between(mesh.positions[k + 1])).sum();
            let excess = 0.5 * (20.0_f64.powi(2) - 10.0_f64.powi(2)) * (angle - TAU);
            assert!((place.area_mm2 - excess).abs() < 0.02 * excess, "{} {excess}", place.area_mm2);
            assert!(outcome.report.warnings.iter().any(|w| w.contains("lies on itself in 1 place")));
            // Both sides are on the ring, where it really is, and one of them is near its cut.
            assert_eq!(place.sides.len(), 2);
            for side in &place.sides {
                let r = DVec3::from(side.xyz_mm).distance(at);
                assert!((9.9..20.1).contains(&r), "{side:?}");
            }
            let [low, high] = [[0.0; 2], outcome.report.pattern.as_ref().unwrap().bounding_box_mm];
            assert!((0..2).all(|k| place.xy_mm[k] >= low[k] - 1e-9 && place.xy_mm[k] <= high[k] + 1e-9));
        }
    }

    #[test]
    fn a_pattern_that_lies_on_itself_is_laid_anew_on_request() {
        let surface = SurfaceMesh { mesh: ruffle(DVec3::new(1e3, -2e3, 5e2)), side: Side::Normal };
        let mut options = JobOptions::default();
        let free = flat(&surface, &options);
        assert!(free.report.warnings.iter().any(|w| w.contains("`flattening.injective: true`")));
        assert_eq!(free.report.flattening.unwrap().injective, None);
        options.flattening.injective = Some(true);
        let outcome = flat(&surface, &options);
        let report = outcome.report.flattening.unwrap();
        assert_eq!((report.overlaps, report.flips, report.flattened), (Some(0), 0, 192));
        // The ring lies flat without strain, but not without lying on itself.
        assert_eq!(report.developable, None);
        let (injective, solver) = (report.injective.unwrap(), report.solver.unwrap());
        assert!(injective.continued && injective.rounds > 0 && injective.energy_before < 1e-12);
        assert!(injective.energy_after > 1e-3 && injective.energy_after < 0.1, "{injective:?}");
        assert_eq!((solver.energy, solver.rounds), (injective.energy_after, injective.rounds));
        assert_eq!(outcome.report.warnings, Vec::<String>::new());
    }

    #[test]
    fn a_pattern_that_does_not_lie_on_itself_stays_the_same_to_the_last_bit() {
        use crate::engine::distortion::InjectiveReport;
        let dome = TrimmedSurface { surface: sphere(50.0), loops: Vec::new(), side: Side::Normal };
        let tube = TrimmedSurface { surface: cylinder(10.0, 30.0), loops: Vec::new(), side: Side::Normal };
        let sheet = grid(9, 7, Diagonal::Diamond, |u, v| DVec3::new(10.0 * u, 10.0 * v, 3.0 * u * v));
        let sheet = SurfaceMesh { mesh: sheet, side: Side::Normal };
        let (mut plain, mut asked) = (JobOptions::default(), JobOptions::default());
        plain.triangulation.grid = Some([12, 12]);
        plain.flattening.domain = Some(crate::engine::flattening::FlatteningDomain::Base);
        asked.clone_from(&plain);
        asked.flattening.injective = Some(true);
        let both = |input: crate::engine::pipeline::Input| {
            [&plain, &asked].map(|options| run(JobKind::Flatten, input, options, &Unobserved).unwrap())
        };
        for input in [(&dome).into(), (&tube).into(), (&sheet).into()] {
            let [without, with] = both(input);
            assert_eq!((&without.flat, &without.pattern), (&with.flat, &with.pattern));
            let mut report = with.report.clone();
            let found = report.flattening.as_mut().unwrap().injective.take().unwrap();
            assert_eq!(without.report, report);
            let energy = report.flattening.unwrap().solver.map_or(0.0, |solver| solver.energy);
            let expected = InjectiveReport {
                energy_before: energy,
                energy_after: energy,
                converged: true,
                ..InjectiveReport::default()
            };
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn a_pattern_that_lies_on_itself_never_passes() {
        use crate::engine::distortion::{Verdict, VerdictResult};
        let of = |result, overlaps| Verdict { result, limits: Vec::new() }.of_overlaps(overlaps).result;
        assert_eq!(of(VerdictResult::Pass, Some(1)), VerdictResult::Fail);
        assert_eq!(of(VerdictResult::Pass, Some(0)), VerdictResult::Pass);
        assert_eq!(of(VerdictResult::Unchecked, Some(2)), VerdictResult::Unchecked);
        assert_eq!(of(VerdictResult::Fail, None), VerdictResult::Fail);
    }

    #[test]
    fn what_lies_flat_as_it_is_has_neither_overlaps_nor_hot_spots() {
        let surface = TrimmedSurface { surface: cylinder(10.0, 30.0), loops: Vec::new(), side: Side::Reversed };
        let outcome = run(JobKind::Flatten, &surface, &JobOptions::default(), &Unobserved).unwrap();
        assert_eq!(outcome.report.flattening.unwrap().overlaps, Some(0));
        assert_eq!(outcome.report.distortion.unwrap().hot_spots, []);
        assert_eq!(outcome.report.warnings, Vec::<String>::new());
    }

    #[test]
    fn a_dome_has_hot_spots_on_the_part_where_the_part_is() {
        let at = DVec3::new(100.0, 0.0, 0.0);
        let corners = [[0.4, 0.7], [1.6, 0.7], [1.6, 1.4], [0.4, 1.4], [0.4, 0.7]].map(glam::DVec2::from);
        let trim = TrimCurve { shape: TrimShape::Polyline(corners.to_vec()), reversed: false };
        let surface = TrimmedSurface {
            surface: sphere(50.0).translated(at),
            loops: vec![TrimLoop { curves: vec![trim] }],
            side: Side::Normal,
        };
        let mut options = JobOptions::default();
        options.flattening.domain = Some(crate::engine::flattening::FlatteningDomain::Trimmed);
        let outcome = run(JobKind::Flatten, &surface, &options, &Unobserved).unwrap();
        let distortion = outcome.report.distortion.unwrap();
        assert!(!distortion.hot_spots.is_empty() && distortion.hot_spots.len() <= 10);
        for spot in &distortion.hot_spots {
            assert!((DVec3::from(spot.at.xyz_mm).distance(at) - 50.0).abs() < 1.0, "{spot:?}");
            let [u, v] = spot.at.uv.unwrap();
            assert!((0.4..=1.6).contains(&u) && (0.7..=1.4).contains(&v));
            assert!(spot.area_mm2 > 0.0 && spot.area_mm2 < 4.0 * PI * 2500.0);
            let measured = distortion.part.strain_percent.max.max(-distortion.part.strain_percent.min);
            assert!(
                spot.kind == HotSpotKind::Area
                    || spot.kind == HotSpotKind::Sheared
                    || spot.peak_percent.abs() <= measured
            );
        }
    }
}
