//! Surfaces: the bytes as they were sent, how they are read, and a summary.

use bytes::Bytes;
use serde_json::Value;
use sqlx::sqlite::SqliteRow;
use sqlx::{Row, SqliteConnection};

use super::results::{insert_blob, remove_orphans};
use super::{Digest, MAX_PAGE, Removal, Store, StoreError, SurfaceId, Written};

/// A surface to be stored. Making one digests its bytes, so it is made where they are parsed, not on an async thread.
#[derive(Debug, Clone, PartialEq)]
pub struct NewSurface {
    id: SurfaceId,
    digest: Digest,
    bytes: Bytes,
    /// What people call it.
    pub name: Option<String>,
    /// `nurbs` or `mesh`.
    pub kind: String,
    /// The units its bytes are in.
    pub units: String,
    /// The media type of its bytes.
    pub media: String,
    /// How the bytes are read, canonical: whatever else than the bytes decides what the surface is.
    pub reading: Value,
    /// What the API tells of it.
    pub summary: Value,
}

impl NewSurface {
    /// Digests the bytes and derives the surface's name from them and from `reading`.
    #[must_use]
    pub fn new(
        bytes: Bytes,
        media: impl Into<String>,
        kind: impl Into<String>,
        units: impl Into<String>,
        reading: Value,
    ) -> Self {
        let (media, digest) = (media.into(), Digest::of(&bytes));
        // Object keys are sorted in this form, so equal readings have equal texts.
        let id = SurfaceId::derive(digest, &format!("{media}\n{reading}"));
        Self {
            id,
            digest,
            bytes,
            name: None,
            kind: kind.into(),
            units: units.into(),
            media,
            reading,
            summary: Value::Null,
        }
    }

    /// The name it will have.
    #[must_use]
    pub const fn id(&self) -> &SurfaceId {
        &self.id
    }
}

/// A stored surface without its bytes.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Its place in the order of arrival: what list cursors are made of.
    pub seq: i64,
    /// Its name, derived from content and reading.
    pub id: SurfaceId,
    /// What people call it.
    pub name: Option<String>,
    /// `nurbs` or `mesh`.
    pub kind: String,
    /// The units its bytes are in.
    pub units: String,
    /// The media type of its bytes.
    pub media: String,
    /// How the bytes are read.
    pub reading: Value,
    /// What the API tells of it.
    pub summary: Value,
    /// How many bytes.
    pub length: u64,
    /// Their digest.
    pub digest: Digest,
    /// When it came, microseconds since 1970.
    pub created_us: i64,
}

macro_rules! surface_columns {
    () => {
        "s.seq, s.id, s.name, s.kind, s.units, s.media, s.reading, s.summary, s.created_us, b.length, b.digest"
    };
}
pub(super) const SURFACE: &str = concat!(
    "SELECT ",
    surface_columns!(),
    " FROM surfaces AS s JOIN blobs AS b ON b.digest = s.content WHERE s.id = ?1"
);
pub(super) const CONTENT: &str = concat!(
    "SELECT ",
    surface_columns!(),
    ", b.bytes FROM surfaces AS s JOIN blobs AS b ON b.digest = s.content WHERE s.id = ?1"
);
pub(super) const SURFACES: &str = concat!(
    "SELECT ",
    surface_columns!(),
    " FROM surfaces AS s JOIN blobs AS b ON b.digest = s.content WHERE s.seq < ?1 ORDER BY s.seq DESC LIMIT ?2"
);
const INSERT: &str = "INSERT INTO surfaces (id, name, kind, units, media, reading, summary, content, created_us) \
     VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9) ON CONFLICT (id) DO NOTHING";

impl Store {
    /// Stores a surface. True: it was new. The same content read the same way is never stored twice.
    ///
    /// # Errors
    /// What the database says.
    pub async fn put_surface(&self, new: NewSurface) -> Result<(Surface, bool), StoreError> {
        self.write(new, |context, new, tx| {
            Box::pin(async {
                let inserted = insert_surface(tx, new, context.clock.wall_us()).await?;
                let row = sqlx::query(SURFACE).bind(new.id.as_str()).fetch_one(&mut *tx).await?;
                Ok(Written::keep((surface(&row)?, inserted)))
            })
        })
        .await
    }

    /// A surface without its bytes.
    ///
    /// # Errors
    /// What the database says.
    pub async fn surface(&self, id: &SurfaceId) -> Result<Option<Surface>, StoreError> {
        let row = sqlx::query(SURFACE).bind(id.as_str()).fetch_optional(&self.0.readers).await?;
        row.as_ref().map(surface).transpose()
    }

    /// A surface with its bytes as sent.
    ///
    /// # Errors
    /// What the database says.
    pub async fn surface_content(&self, id: &SurfaceId) -> Result<Option<(Surface, Bytes)>, StoreError> {
        let row = sqlx::query(CONTENT).bind(id.as_str()).fetch_optional(&self.0.readers).await?;
        row.map(|row| Ok((surface(&row)?, Bytes::from(row.try_get::<Vec<u8>, _>("bytes")?)))).transpose()
    }

    /// Surfaces that came before `before` (a `seq`; `None`: from the newest), newest first, at most `limit` and
    /// [`MAX_PAGE`].
    ///
    /// # Errors
    /// What the database says.
    pub async fn surfaces(&self, before: Option<i64>, limit: u32) -> Result<Vec<Surface>, StoreError> {
        let rows = sqlx::query(SURFACES)
            .bind(before.unwrap_or(i64::MAX))
            .bind(limit.min(MAX_PAGE))
            .fetch_all(&self.0.readers)
            .await?;
        rows.iter().map(surface).collect()
    }

    /// Removes a surface unless a job that has not ended needs it.
    ///
    /// # Errors
    /// What the database says.
    pub async fn remove_surface(&self, id: &SurfaceId) -> Result<Removal, StoreError> {
        self.write(id.clone(), |_, id, tx| {
            Box::pin(async {
                let Some(row) = sqlx::query(SURFACE).bind(id.as_str()).fetch_optional(&mut *tx).await? else {
                    return Ok(Written::undo(Removal::Absent));
                };
                let found = surface(&row)?;
                let needed = sqlx::query("SELECT 1 FROM jobs WHERE needs_surface = ?1 LIMIT 1").bind(id.as_str());
                if needed.fetch_optional(&mut *tx).await?.is_some() {
                    return Ok(Written::undo(Removal::InUse));
                }
                sqlx::query("DELETE FROM surfaces WHERE seq = ?1").bind(found.seq).execute(&mut *tx).await?;
                remove_orphans(tx, &[found.digest]).await?;
                Ok(Written::keep(Removal::Removed))
            })
        })
        .await
    }
}

/// Stores a surface within a transaction. True: it was new.
pub(super) async fn insert_surface(tx: &mut SqliteConnection, new: &NewSurface, now: i64) -> Result<bool, StoreError> {
    insert_blob(tx, new.digest, &new.bytes).await?;
    let inserted = sqlx::query(INSERT)
        .bind(new.id.as_str())
        .bind(&new.name)
        .bind(&new.kind)
        .bind(&new.units)
        .bind(&new.media)
        .bind(new.reading.to_string())
        .bind(new.summary.to_string())
        .bind(new.digest.bytes())
        .bind(now)
        .execute(&mut *tx)
        .await?;
    Ok(inserted.rows_affected() == 1)
}

fn surface(row: &SqliteRow) -> Result<Surface, StoreError> {
    let id: &str = row.try_get("id")?;
    Ok(Surface {
        seq: row.try_get("seq")?,
        id: id.parse().map_err(|_| StoreError::Corrupt(format!("surface id {id:?}")))?,
        name: row.try_get("name")?,
        kind: row.try_get("kind")?,
        units: row.try_get("units")?,
        media: row.try_get("media")?,
        reading: serde_json::from_str(row.try_get("reading")?)?,
        summary: serde_json::from_str(row.try_get("summary")?)?,
        length: row.try_get::<i64, _>("length")?.unsigned_abs(),
        digest: Digest::from_bytes(row.try_get("digest")?)?,
        created_us: row.try_get("created_us")?,
    })
}
