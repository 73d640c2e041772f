//! Which results there are, and in which forms.

use crate::api::answer::Form;

/// A result of a job. Its name is the same in addresses and in the store.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ResultKind {
    /// The mesh in space with its flattening.
    Mesh,
    /// What is cut.
    Pattern,
    /// What is said of it.
    Report,
    /// What became of each seed.
    Seeds,
    /// The mesh's vertices as a table.
    Vertices,
}

impl ResultKind {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Mesh, Self::Pattern, Self::Report, Self::Seeds, Self::Vertices];

    /// Its name.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Pattern => "pattern",
            Self::Report => "report",
            Self::Seeds => "seeds",
            Self::Vertices => "vertices",
        }
    }

    /// The result with this name.
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// The name of the stored result that a form is written from: the tables of triangles and of vertices are
    /// the mesh's.
    #[must_use]
    pub const fn stored_as(self, form: Form) -> &'static str {
        match (self, form) {
            (Self::Report | Self::Vertices, Form::Csv) => Self::Mesh.name(),
            _ => self.name(),
        }
    }

    /// Its forms; the first is the one that a client gets who does not mind.
    #[must_use]
    pub const fn forms(self) -> &'static [Form] {
        match self {
            Self::Mesh => &[Form::Glb, Form::Obj, Form::Stl, Form::Ply, Form::Json],
            Self::Pattern => &[Form::Svg, Form::Dxf, Form::Plt, Form::Json],
            Self::Report | Self::Seeds => &[Form::Json, Form::Csv],
            Self::Vertices => &[Form::Csv],
        }
    }
}
