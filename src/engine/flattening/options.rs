//! How a mesh is to be flattened: the very names that a job uses.

use serde::{Deserialize, Serialize};

use super::constraints::{Keep, PinAt};
use super::energy_release::ReleaseOptions;
use super::isometric::Objective;

/// The method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FlatteningMethod {
    /// The map with the least distortion over all triangles, never with a flip.
    Isometric,
    /// Cader et al. 2005: triangle by triangle in mapping order, averaging (thesis 4.2).
    Cader,
    /// McCartney et al. 1999: laid by circles, then energy released vertex by vertex (thesis 4.1).
    Mccartney,
    /// Wang, Smith, Yuen 2002, our reading: masses and springs come to rest while the mesh is laid.
    Wang,
}

impl FlatteningMethod {
    /// The method's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Isometric => "isometric",
            Self::Cader => "cader",
            Self::Mccartney => "mccartney",
            Self::Wang => "wang",
        }
    }

    /// Whether the mesh is laid triangle by triangle from a seed.
    #[must_use]
    pub const fn is_sequential(self) -> bool {
        match self {
            Self::Isometric => false,
            Self::Cader | Self::Mccartney | Self::Wang => true,
        }
    }

    /// What is flattened where nobody says: the thesis's methods flatten the base, so that the seed's search is that of
    /// 4.4.3; material outside of the part need not be bent to flatten the part best.
    #[must_use]
    pub const fn usual_domain(self) -> FlatteningDomain {
        match self {
            Self::Isometric => FlatteningDomain::Trimmed,
            Self::Cader | Self::Mccartney | Self::Wang => FlatteningDomain::Base,
        }
    }
}

/// What is flattened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FlatteningDomain {
    /// The whole base surface; the trimming loops are mapped on (thesis 4.4.3).
    Base,
    /// The trimmed mesh alone.
    Trimmed,
}

impl FlatteningDomain {
    /// The domain's name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Base => "base",
            Self::Trimmed => "trimmed",
        }
    }
}

/// Order of the triangles within a level of the mapping order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// As discovered.
    Fifo,
    /// By triangle number.
    #[default]
    Index,
}

/// Which shared edge a triangle whose three vertices are placed unfolds over.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Parent {
    /// The one to the neighbour that was flattened first.
    #[default]
    First,
    /// The one to the neighbour that was flattened last.
    Last,
}

/// Which end of the new triangle's own half-edge the position is measured from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Anchor {
    /// Its start.
    Start,
    /// Its end.
    #[default]
    End,
}

/// How several positions of one vertex become one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Average {
    /// (old + new) / 2.
    #[default]
    Pair,
    /// The mean of all positions so far.
    Running,
}

/// Which triangles are tested for a flip, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Check {
    /// Every flattened triangle at the vertex that moved.
    #[default]
    Incident,
    /// The triangle being processed alone.
    Current,
    /// All, at the end.
    Final,
}

/// In what portions the triangles of a level are laid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// One after the other, as the thesis has it: the result depends on their numbering, their corners and on mirroring.
    #[default]
    InTurn,
    /// All at once, and the levels laid last come to rest together: it depends on none of these.
    Symmetric,
}

/// One resolution of what the thesis leaves open in Cader's method. Order, parent, anchor and average are those of
/// [`Scheme::InTurn`]: the other scheme reads none of them, and they cannot be given beside it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(try_from = "AskedReadings", into = "AskedReadings")]
pub struct Readings {
    /// Portions.
    pub scheme: Scheme,
    /// Order within a level.
    pub order: Order,
    /// Shared edge of a triangle whose vertices are all placed.
    pub parent: Parent,
    /// Anchor `p_s`.
    pub anchor: Anchor,
    /// Averaging.
    pub average: Average,
    /// Flip check. By [`Scheme::Symmetric`] `incident` tests all that moved at the end of each level; `current` has no
    /// meaning there and is taken as `final`.
    pub check: Check,
}

impl Readings {
    /// The scheme `symmetric`.
    pub const SYMMETRIC: Self = Self {
        scheme: Scheme::Symmetric,
        order: Order::Index,
        parent: Parent::First,
        anchor: Anchor::End,
        average: Average::Pair,
        check: Check::Incident,
    };
}

/// Readings as a job gives them.
#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct AskedReadings {
    scheme: Scheme,
    #[serde(skip_serializing_if = "Option::is_none")]
    order: Option<Order>,
    #[serde(skip_serializing_if = "Option::is_none")]
    parent: Option<Parent>,
    #[serde(skip_serializing_if = "Option::is_none")]
    anchor: Option<Anchor>,
    #[serde(skip_serializing_if = "Option::is_none")]
    average: Option<Average>,
    check: Check,
}

impl TryFrom<AskedReadings> for Readings {
    type Error = &'static str;

    fn try_from(asked: AskedReadings) -> Result<Self, Self::Error> {
        let AskedReadings { scheme, order, parent, anchor, average, check } = asked;
        if scheme == Scheme::Symmetric {
            if order.is_some() || parent.is_some() || anchor.is_some() || average.is_some() {
                return Err(
                    "the scheme `symmetric` lays a level at once and reads no order, parent, anchor or average: \
                            leave these out, or take the scheme `in-turn`",
                );
            }
            if check == Check::Current {
                return Err("the scheme `symmetric` has no current triangle: take the check `incident` or `final`");
            }
        }
        Ok(Self {
            scheme,
            order: order.unwrap_or_default(),
            parent: parent.unwrap_or_default(),
            anchor: anchor.unwrap_or_default(),
            average: average.unwrap_or_default(),
            check,
        })
    }
}

impl From<Readings> for AskedReadings {
    fn from(readings: Readings) -> Self {
        let Readings { scheme, order, parent, anchor, average, check } = readings;
        let in_turn = scheme == Scheme::InTurn;
        Self {
            scheme,
            order: in_turn.then_some(order),
            parent: in_turn.then_some(parent),
            anchor: in_turn.then_some(anchor),
            average: in_turn.then_some(average),
            check,
        }
    }
}

/// The seed triangle (thesis 4.4.4).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SeedChoice {
    /// `"centre"`: the triangle whose centroid is nearest to the area centroid, lowest index.
    Centre,
    /// `"optimum"`: the one with the least area change (lowest index on ties), every seed tried.
    Optimum,
    /// `"predicted"`: the least area change of a few seeds that the shape points to.
    Predicted,
    /// `{ "uv": [u, v] }`: the triangle that holds this place of the domain.
    Uv([f64; 2]),
    /// `{ "xyz": [x, y, z] }`: the triangle nearest to this place in space, mm.
    Xyz([f64; 3]),
    /// `{ "vertices": [a, b, c] }`: the triangle of the mesh with these corners, in any order, so that meshes whose
    /// triangles are numbered otherwise can be flattened from the same one (thesis 5.2.1).
    Vertices([u32; 3]),
    /// A triangle's index.
    #[serde(untagged)]
    Index(u32),
}

/// How much the change of area and the change of shape weigh.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Weights {
    /// Of area, above 0.
    pub area: f64,
    /// Of shape, above 0.
    pub shape: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Self { area: 1.0, shape: 1.0 }
    }
}

/// The `flattening` object of a job. What is absent has a default that depends on what is there.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FlatteningOptions {
    /// The method. Absent: `cader` where a seed or readings are given, which belong to it, else `isometric`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<FlatteningMethod>,
    /// What is flattened. Absent: the method's [usual domain](FlatteningMethod::usual_domain), but `base` where the mesh is
    /// that of the whole grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub domain: Option<FlatteningDomain>,
    /// Which distortion `isometric` makes least. Absent: `balanced`, unless there are weights.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub objective: Option<Objective>,
    /// In place of an objective: the weights of area and shape.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weights: Option<Weights>,
    /// Whether `isometric` goes on, where its map lies on itself, to one that does not. Absent: no.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub injective: Option<bool>,
    /// Points that `isometric` lays at given places of the pattern.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pins: Option<Vec<PinAt>>,
    /// Boundary curves whose lengths `isometric` keeps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub keep: Option<Vec<Keep>>,
    /// The seed of sequential methods. Absent: by `cader` `optimum` up to 8000 triangles, above `predicted`; else
    /// `centre`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<SeedChoice>,
    /// The readings of `cader`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub readings: Option<Readings>,
    /// How `mccartney` and `wang` release energy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub release: Option<ReleaseOptions>,
}

impl FlatteningOptions {
    /// The method, the default filled in.
    #[must_use]
    pub const fn method(&self) -> FlatteningMethod {
        match self.method {
            Some(method) => method,
            None if self.seed.is_some() || self.readings.is_some() => FlatteningMethod::Cader,
            None => FlatteningMethod::Isometric,
        }
    }

    /// What `isometric` makes least, the default filled in.
    #[must_use]
    pub fn objective(&self) -> Objective {
        match self.weights {
            Some(Weights { area, shape }) => Objective::Weights { area, shape },
            None => self.objective.unwrap_or_default(),
        }
    }

    /// Whether the pattern must not lie on itself, the default filled in.
    #[must_use]
    pub fn injective(&self) -> bool {
        self.injective.unwrap_or(false)
    }

    /// The pins, none where nothing is said.
    #[must_use]
    pub fn pins(&self) -> &[PinAt] {
        self.pins.as_deref().unwrap_or_default()
    }

    /// The kept lengths, none where nothing is said.
    #[must_use]
    pub fn keep(&self) -> &[Keep] {
        self.keep.as_deref().unwrap_or_default()
    }

    /// Whether there are pins or kept lengths.
    #[must_use]
    pub fn is_constrained(&self) -> bool {
        !(self.pins().is_empty() && self.keep().is_empty())
    }

    /// The readings of `cader`, the default filled in.
    #[must_use]
    pub fn readings(&self) -> Readings {
        self.readings.unwrap_or_default()
    }

    /// The same with the defaults of the method.
    #[must_use]
    pub fn filled(&self) -> Self {
        let method = self.method();
        let mut filled = Self { method: Some(method), ..self.clone() };
        match method {
            FlatteningMethod::Isometric if self.weights.is_none() => filled.objective = Some(self.objective()),
            FlatteningMethod::Cader => filled.readings = Some(self.readings()),
            FlatteningMethod::Isometric | FlatteningMethod::Mccartney | FlatteningMethod::Wang => {}
        }
        filled
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_belongs_to_one_method_chooses_it() {
        let none = FlatteningOptions::default();
        assert_eq!(none.method(), FlatteningMethod::Isometric);
        let seeded = FlatteningOptions { seed: Some(SeedChoice::Centre), ..none.clone() };
        let read = FlatteningOptions { readings: Some(Readings::default()), ..none.clone() };
        assert_eq!((seeded.method(), read.method()), (FlatteningMethod::Cader, FlatteningMethod::Cader));
        let named = FlatteningOptions { method: Some(FlatteningMethod::Isometric), ..seeded };
        assert_eq!(named.method(), FlatteningMethod::Isometric);
    }

    #[test]
    fn filling_in_twice_is_filling_in_once_and_weights_stand_for_an_objective() {
        let none = FlatteningOptions::default();
        let weighted = FlatteningOptions { weights: Some(Weights { area: 2.0, shape: 1.0 }), ..none.clone() };
        let cader = FlatteningOptions { method: Some(FlatteningMethod::Cader), ..none.clone() };
        for options in [&none, &weighted, &cader] {
            assert_eq!(options.filled().filled(), options.filled());
            assert_eq!(options.filled().method(), options.method());
        }
        assert_eq!(none.filled().objective, Some(Objective::Balanced));
        assert_eq!(weighted.filled().objective, None);
        assert_eq!(weighted.objective(), Objective::Weights { area: 2.0, shape: 1.0 });
        assert_eq!((cader.filled().objective, cader.filled().readings), (None, Some(Readings::default())));
    }

    #[test]
    fn readings_are_told_with_what_their_scheme_reads() {
        let told = |readings: Readings| serde_json::to_value(readings).unwrap();
        let named = told(Readings::SYMMETRIC);
        assert_eq!(named, serde_json::json!({ "scheme": "symmetric", "check": "incident" }));
        for readings in
            [Readings::SYMMETRIC, Readings::default(), Readings { order: Order::Fifo, ..Readings::default() }]
        {
            assert_eq!(serde_json::from_value::<Readings>(told(readings)).unwrap(), readings);
        }
        for beside in ["order", "parent", "anchor", "average", "check"] {
            let mut asked = named.clone();
            let value = told(Readings { check: Check::Current, ..Readings::default() })[beside].clone();
            asked[beside] = value;
            let refused = serde_json::from_value::<Readings>(asked).unwrap_err().to_string();
            assert!(refused.starts_with("the scheme `symmetric`"), "{refused}");
        }
    }
}
