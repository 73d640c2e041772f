//! A pattern as it is kept. Version 1 had names, outlines and holes alone; it is read as before.
//!
//! Little-endian, without padding, in the order of the fields of [`Pattern`] but that the counts of a piece stand before
//! its contents. Counts are u64, flags and kinds a byte each, coordinates f64. A text is its count of bytes and UTF-8.

use glam::DVec2;

use super::{Reader, StoredError, damaged};
use crate::engine::pattern::{
    Contour, Fit, Fits, Grain, Mark, MarkKind, Pattern, Piece, Seam, SeamSide, Segment, Sense,
};

const MAGIC: [u8; 4] = *b"PLNP";
/// Media type under which an encoded pattern is stored.
pub const PATTERN_MEDIA: &str = "application/vnd.planish.pattern";
/// Version that is written.
const VERSION: u32 = 2;

const LINE: u8 = 0;
const ARC: u8 = 1;
const CUBIC: u8 = 2;

/// Every kind of mark, in the order of its byte.
const KINDS: [MarkKind; 6] =
    [MarkKind::Notch, MarkKind::Drill, MarkKind::Draw, MarkKind::Cut, MarkKind::Text, MarkKind::Fold];

/// Least bytes of what a count may stand before.
mod least {
    pub(super) const POINT: usize = 17;
    pub(super) const SEGMENT: usize = 17;
    /// Counts of a name, holes and outline.
    pub(super) const PIECE: usize = 24;
    /// A count of points and two flags of fits.
    pub(super) const CONTOUR: usize = 8;
    /// Kind, counts of text and points, flags of closing, direction and fits, size.
    pub(super) const MARK: usize = 28;
    /// Count of a name, length, and twice the piece, count of points and length.
    pub(super) const SEAM: usize = 56;
}

/// Encodes a pattern. Corners that do not fit their points or segments are taken as false.
#[must_use]
pub fn encode_pattern(pattern: &Pattern) -> Vec<u8> {
    let mut out = Writer(Vec::new());
    out.0.extend_from_slice(&MAGIC);
    out.0.extend_from_slice(&VERSION.to_le_bytes());
    out.count(pattern.pieces.len());
    pattern.bounding_box_mm.iter().for_each(|x| out.number(*x));
    for piece in &pattern.pieces {
        out.piece(piece);
    }
    out.count(pattern.seams.len());
    for seam in &pattern.seams {
        out.text(&seam.name);
        out.number(seam.length_3d_mm);
        for side in &seam.sides {
            out.0.extend_from_slice(&side.piece.to_le_bytes());
            out.count(side.points.len());
            side.points.iter().for_each(|p| out.point(*p));
            out.number(side.length_mm);
        }
    }
    out.0
}

/// Decodes a pattern.
///
/// # Errors
/// [`StoredError`].
pub fn decode_pattern(bytes: &[u8]) -> Result<Pattern, StoredError> {
    let (mut read, version) = Reader::open(bytes, MAGIC, "pattern", VERSION)?;
    let pieces = read.count(least::PIECE)?;
    let mut pattern = Pattern { bounding_box_mm: [read.f64()?, read.f64()?], ..Pattern::default() };
    for _ in 0..pieces {
        pattern.pieces.push(read.piece(version)?);
    }
    if version > 1 {
        let seams = read.count(least::SEAM)?;
        for _ in 0..seams {
            pattern.seams.push(read.seam()?);
        }
    }
    if read.rest.is_empty() { Ok(pattern) } else { Err(damaged("bytes are left over")) }
}

struct Writer(Vec<u8>);

impl Writer {
    fn count(&mut self, n: usize) {
        self.0.extend_from_slice(&(n as u64).to_le_bytes());
    }

    fn number(&mut self, x: f64) {
        self.0.extend_from_slice(&x.to_le_bytes());
    }

    fn point(&mut self, p: DVec2) {
        self.number(p.x);
        self.number(p.y);
    }

    fn text(&mut self, text: &str) {
        self.count(text.len());
        self.0.extend_from_slice(text.as_bytes());
    }

    fn flag(&mut self, flag: bool) {
        self.0.push(u8::from(flag));
    }

    fn line(&mut self, points: &[DVec2], corners: &[bool]) {
        self.count(points.len());
        for p in points {
            self.point(*p);
        }
        self.corners(corners, points.len());
    }

    fn corners(&mut self, corners: &[bool], count: usize) {
        self.0.extend((0..count).map(|k| u8::from(corners.get(k) == Some(&true))));
    }

    fn contour(&mut self, contour: &Contour) {
        self.line(&contour.points, &contour.corners);
        self.fits(&contour.fits);
    }

    fn fits(&mut self, fits: &Fits) {
        for fit in [&fits.arcs, &fits.spline] {
            self.flag(fit.is_some());
            if let Some(fit) = fit {
                self.fit(fit);
            }
        }
    }

    fn fit(&mut self, fit: &Fit) {
        self.count(fit.segments.len());
        self.point(fit.start);
        for segment in &fit.segments {
            match *segment {
                Segment::Line { to } => {
                    self.0.push(LINE);
                    self.point(to);
                }
                Segment::Arc { to, bulge } => {
                    self.0.push(ARC);
                    self.point(to);
                    self.number(bulge);
                }
                Segment::Cubic { a, b, to } => {
                    self.0.push(CUBIC);
                    for p in [a, b, to] {
                        self.point(p);
                    }
                }
            }
        }
        self.corners(&fit.corners, fit.segments.len());
        self.flag(fit.circle.is_some());
        if let Some((middle, radius)) = fit.circle {
            self.point(middle);
            self.number(radius);
        }
        self.number(fit.deviation_mm);
    }

    fn piece(&mut self, piece: &Piece) {
        self.text(&piece.name);
        self.count(piece.holes.len());
        std::iter::once(&piece.outline).chain(&piece.holes).for_each(|c| self.contour(c));
        self.flag(piece.sew.is_some());
        piece.sew.iter().for_each(|c| self.contour(c));
        self.flag(piece.grain.is_some());
        if let Some(grain) = &piece.grain {
            self.point(grain.from);
            self.point(grain.to);
            self.flag(grain.sense == Sense::OneWay);
        }
        self.count(piece.marks.len());
        for mark in &piece.marks {
            self.0.push(KINDS.iter().position(|k| *k == mark.kind).unwrap_or(0) as u8);
            self.text(&mark.text);
            self.line(&mark.points, &mark.corners);
            self.flag(mark.closed);
            self.flag(mark.inward.is_some());
            mark.inward.iter().for_each(|d| self.point(*d));
            self.number(mark.size_mm);
            self.fits(&mark.fits);
        }
        self.flag(piece.mirrored);
    }
}

impl Reader<'_> {
    fn byte(&mut self) -> Result<u8, StoredError> {
        self.array::<1>().map(|[b]| b)
    }

    fn flag(&mut self) -> Result<bool, StoredError> {
        match self.byte()? {
            0 => Ok(false),
            1 => Ok(true),
            _ => Err(damaged("a flag is neither yes nor no")),
        }
    }

    fn point(&mut self) -> Result<DVec2, StoredError> {
        Ok(DVec2::new(self.f64()?, self.f64()?))
    }

    fn text(&mut self) -> Result<String, StoredError> {
        let length = self.count(1)?;
        let text = std::str::from_utf8(self.take(length)?).map_err(|_| damaged("a text is not UTF-8"))?;
        Ok(text.to_owned())
    }

    fn line(&mut self) -> Result<(Vec<DVec2>, Vec<bool>), StoredError> {
        let count = self.count(least::POINT)?;
        let points = self.points(count)?.map(DVec2::from_array).collect();
        let corners = self.take(count)?.iter().map(|c| *c != 0).collect();
        Ok((points, corners))
    }

    fn contour(&mut self, version: u32) -> Result<Contour, StoredError> {
        let (points, corners) = self.line()?;
        let fits = if version > 1 { self.fits()? } else { Fits::default() };
        Ok(Contour { points, corners, fits })
    }

    fn fits(&mut self) -> Result<Fits, StoredError> {
        let arcs = if self.flag()? { Some(self.fit()?) } else { None };
        let spline = if self.flag()? { Some(self.fit()?) } else { None };
        Ok(Fits { arcs, spline })
    }

    fn fit(&mut self) -> Result<Fit, StoredError> {
        let count = self.count(least::SEGMENT)?;
        let start = self.point()?;
        let segments = (0..count)
            .map(|_| match self.byte()? {
                LINE => Ok(Segment::Line { to: self.point()? }),
                ARC => Ok(Segment::Arc { to: self.point()?, bulge: self.f64()? }),
                CUBIC => Ok(Segment::Cubic { a: self.point()?, b: self.point()?, to: self.point()? }),
                _ => Err(damaged("a segment is neither line, arc nor cubic")),
            })
            .collect::<Result<_, _>>()?;
        let corners = self.take(count)?.iter().map(|c| *c != 0).collect();
        let circle = if self.flag()? { Some((self.point()?, self.f64()?)) } else { None };
        Ok(Fit { start, segments, circle, corners, deviation_mm: self.f64()? })
    }

    fn piece(&mut self, version: u32) -> Result<Piece, StoredError> {
        let name = self.text()?;
        let holes = self.count(least::CONTOUR)?;
        let outline = self.contour(version)?;
        let holes = (0..holes).map(|_| self.contour(version)).collect::<Result<_, _>>()?;
        let mut piece = Piece { name, outline, holes, ..Piece::default() };
        if version > 1 {
            piece.sew = if self.flag()? { Some(self.contour(version)?) } else { None };
            if self.flag()? {
                let (from, to) = (self.point()?, self.point()?);
                let sense = if self.flag()? { Sense::OneWay } else { Sense::Either };
                piece.grain = Some(Grain { from, to, sense });
            }
            let marks = self.count(least::MARK)?;
            piece.marks = (0..marks).map(|_| self.mark()).collect::<Result<_, _>>()?;
            piece.mirrored = self.flag()?;
        }
        Ok(piece)
    }

    fn mark(&mut self) -> Result<Mark, StoredError> {
        let kind = *KINDS.get(usize::from(self.byte()?)).ok_or(damaged("a mark is of no known kind"))?;
        let text = self.text()?;
        let (points, corners) = self.line()?;
        let closed = self.flag()?;
        let inward = if self.flag()? { Some(self.point()?) } else { None };
        Ok(Mark { kind, text, points, corners, closed, inward, size_mm: self.f64()?, fits: self.fits()? })
    }

    fn seam(&mut self) -> Result<Seam, StoredError> {
        let (name, length_3d_mm) = (self.text()?, self.f64()?);
        let mut side = || -> Result<SeamSide, StoredError> {
            let piece = self.u32()?;
            let count = self.count(16)?;
            let points = self.points(count)?.map(DVec2::from_array).collect();
            Ok(SeamSide { piece, points, length_mm: self.f64()? })
        };
        Ok(Seam { name, sides: [side()?, side()?], length_3d_mm })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn point() -> impl Strategy<Value = DVec2> {
        // Not a number does not equal itself; everything else comes back bit for bit.
        [-1e300..1e300, -1.0..1.0].prop_map(DVec2::from_array)
    }

    fn line() -> impl Strategy<Value = (Vec<DVec2>, Vec<bool>)> {
        prop::collection::vec((point(), any::<bool>()), 0..6).prop_map(|v| v.into_iter().unzip())
    }

    fn fit() -> impl Strategy<Value = Fit> {
        let segment = prop_oneof![
            point().prop_map(|to| Segment::Line { to }),
            (point(), -2.0..2.0).prop_map(|(to, bulge)| Segment::Arc { to, bulge }),
            (point(), point(), point()).prop_map(|(a, b, to)| Segment::Cubic { a, b, to }),
        ];
        let segments = prop::collection::vec((segment, any::<bool>()), 0..5);
        let circle = prop::option::of((point(), 0.0..9.0));
        (point(), segments, circle, 0.0..1.0).prop_map(|(start, segments, circle, deviation_mm)| {
            let (segments, corners) = segments.into_iter().unzip();
            Fit { start, segments, circle, corners, deviation_mm }
        })
    }

    fn fits() -> impl Strategy<Value = Fits> {
        (prop::option::of(fit()), prop::option::of(fit())).prop_map(|(arcs, spline)| Fits { arcs, spline })
    }

    fn contour() -> impl Strategy<Value = Contour> {
        (line(), fits()).prop_map(|((points, corners), fits)| Contour { points, corners, fits })
    }

    fn mark() -> impl Strategy<Value = Mark> {
        (prop::sample::select(&KINDS), ".{0,4}", line(), any::<bool>(), prop::option::of(point()), 0.0..9.0, fits())
            .prop_map(|(kind, text, (points, corners), closed, inward, size_mm, fits)| Mark {
                kind,
                text,
                points,
                corners,
                closed,
                inward,
                size_mm,
                fits,
            })
    }

    fn piece() -> impl Strategy<Value = Piece> {
        let grain = (point(), point(), any::<bool>()).prop_map(|(from, to, nap)| Grain {
            from,
            to,
            sense: if nap { Sense::OneWay } else { Sense::Either },
        });
        let holes = prop::collection::vec(contour(), 0..3);
        let marks = prop::collection::vec(mark(), 0..3);
        let sew = prop::option::of(contour());
        (".{0,5}", contour(), holes, sew, prop::option::of(grain), marks, any::<bool>()).prop_map(
            |(name, outline, holes, sew, grain, marks, mirrored)| Piece {
                name,
                outline,
                holes,
                sew,
                grain,
                marks,
                mirrored,
            },
        )
    }

    fn pattern() -> impl Strategy<Value = Pattern> {
        let side = || {
            (any::<u32>(), prop::collection::vec(point(), 0..4), 0.0..9.0)
                .prop_map(|(piece, points, length_mm)| SeamSide { piece, points, length_mm })
        };
        let seam = (".{0,3}", [side(), side()], 0.0..9.0).prop_map(|(name, sides, length_3d_mm)| Seam {
            name,
            sides,
            length_3d_mm,
        });
        let pieces = prop::collection::vec(piece(), 0..3);
        (pieces, prop::collection::vec(seam, 0..3), [0.0..9.0, 0.0..9.0])
            .prop_map(|(pieces, seams, bounding_box_mm)| Pattern { pieces, seams, bounding_box_mm })
    }

    proptest! {
        #[test]
        fn a_pattern_comes_back_as_it_was(pattern in pattern()) {
            let bytes = encode_pattern(&pattern);
            prop_assert_eq!(decode_pattern(&bytes).unwrap(), pattern);
            prop_assert!(decode_pattern(&bytes[..bytes.len() - 1]).is_err());
        }

        #[test]
        fn damage_gives_an_error_or_other_values_never_a_panic(pattern in pattern(), at in any::<prop::sample::Index>(), bits in 1..=255_u8) {
            let mut bytes = encode_pattern(&pattern);
            let at = at.index(bytes.len());
            bytes[at] ^= bits;
            let _ = decode_pattern(&bytes);
        }

        #[test]
        fn arbitrary_bytes_are_no_pattern(mut bytes in prop::collection::vec(any::<u8>(), 0..200), version in 1..=2_u8) {
            let _ = decode_pattern(&bytes);
            bytes.splice(0..0, [b'P', b'L', b'N', b'P', version, 0, 0, 0]);
            let _ = decode_pattern(&bytes);
        }
    }

    #[test]
    fn a_pattern_of_the_first_version_is_still_read() {
        let mut bytes = b"PLNP".to_vec();
        bytes.extend(1_u32.to_le_bytes());
        bytes.extend(1_u64.to_le_bytes());
        bytes.extend([30.0_f64, 4.0].map(f64::to_le_bytes).concat());
        bytes.extend(1_u64.to_le_bytes());
        bytes.push(b'a');
        bytes.extend(0_u64.to_le_bytes());
        bytes.extend(3_u64.to_le_bytes());
        bytes.extend([0.0_f64, 0.0, 30.0, 0.0, 0.0, 4.0].map(f64::to_le_bytes).concat());
        bytes.extend([1, 1, 0]);
        let outline = Contour {
            points: vec![DVec2::ZERO, DVec2::new(30.0, 0.0), DVec2::new(0.0, 4.0)],
            corners: vec![true, true, false],
            fits: Fits::default(),
        };
        let piece = Piece { name: "a".into(), outline, ..Piece::default() };
        let pattern = Pattern { pieces: vec![piece], bounding_box_mm: [30.0, 4.0], ..Pattern::default() };
        assert_eq!(decode_pattern(&bytes), Ok(pattern));
    }

    #[test]
    fn another_version_is_refused_by_its_number() {
        let mut bytes = encode_pattern(&Pattern::default());
        bytes[4] = 9;
        assert_eq!(decode_pattern(&bytes), Err(StoredError::Version { what: "pattern", found: 9, newest: 2 }));
    }
}
