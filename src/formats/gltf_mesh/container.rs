//! The container: a binary file's chunks, or the JSON by itself (glTF 2.0, 4.4).

/// What a file is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Container<'a> {
    /// The JSON text.
    pub(super) json: &'a [u8],
    /// The binary chunk of a `.glb`.
    pub(super) binary: Option<&'a [u8]>,
    /// Whether it is a `.glb`.
    pub(super) is_binary: bool,
}

const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BIN: u32 = u32::from_le_bytes(*b"BIN\0");

/// Finds the parts of a file.
///
/// # Errors
/// What is wrong, in words.
pub(super) fn open(bytes: &[u8]) -> Result<Container<'_>, String> {
    if !bytes.starts_with(b"glTF") {
        return Ok(Container { json: bytes, binary: None, is_binary: false });
    }
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        return Err(format!("the file ends after {} bytes, within its header", bytes.len()));
    };
    if version != 2 {
        return Err(format!("this is binary glTF version {version}; version 2 is read. Export it as glTF 2.0."));
    }
    let length = length as usize;
    if length > bytes.len() {
        return Err(format!(
            "the file says that it has {length} bytes, and {} came: it was cut off. Send it again, whole.",
            bytes.len()
        ));
    }
    let mut rest = bytes.get(HEADER..length).ok_or("the file says that it is shorter than its own header")?;
    let mut found = Container { json: &[], binary: None, is_binary: true };
    let mut number = 0;
    while !rest.is_empty() {
        let (Some(size), Some(kind)) = (word(rest, 0), word(rest, 4)) else {
            return Err(format!("chunk {number} of the file ends within its header"));
        };
        let end = CHUNK_HEADER.checked_add(size as usize);
        let Some((chunk, after)) = end.and_then(|end| rest.split_at_checked(end)) else {
            return Err(format!("chunk {number} of the file says that it has {size} bytes, more than are left"));
        };
        let chunk = &chunk[CHUNK_HEADER..];
        match (number, kind) {
            (0, JSON) => found.json = chunk,
            (0, _) => return Err("the first chunk of the file is not JSON, as glTF wants it".to_owned()),
            (1, BIN) => found.binary = Some(chunk),
            // Chunks of other kinds are there for others.
            _ => {}
        }
        number += 1;
        rest = after;
    }
    if number == 0 { Err("the file has no chunks: it is empty after its header".to_owned()) } else { Ok(found) }
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|b| u32::from_le_bytes(*b))
}
