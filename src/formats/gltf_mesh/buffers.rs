//! The bytes that views look at: the binary chunk, or what a `data:` URI holds. Other addresses are refused: nothing is
//! fetched or opened.

use super::Faults;
use super::container::Container;
use super::document::{Document, whole};
use super::limits::MeshLimits;

/// The bytes of every buffer that could be had.
pub(super) struct Buffers<'a> {
    list: Vec<Option<Bytes<'a>>>,
}

enum Bytes<'a> {
    Borrowed(&'a [u8]),
    Owned(Vec<u8>),
}

impl<'a> Buffers<'a> {
    /// Decodes all buffers; what is wrong with one is noted.
    pub(super) fn read(
        document: &Document,
        container: &Container<'a>,
        limits: &MeshLimits,
        faults: &mut Faults,
    ) -> Self {
        let mut left = limits.buffer_bytes;
        let list = (0..document.buffers.len())
            .map(|index| match buffer(document, index, container, &mut left) {
                Ok(bytes) => Some(bytes),
                Err(detail) => {
                    faults.add(&format!("/buffers/{index}"), detail);
                    None
                }
            })
            .collect();
        Self { list }
    }

    /// The bytes of a view with its stride, 0 when it has none.
    ///
    /// # Errors
    /// What is wrong with it, in words; an empty text when its buffer is at fault, which is noted already.
    pub(super) fn view(&self, document: &Document, view: f64) -> Result<(&[u8], u64), String> {
        let index = whole(view).map(|index| index as usize);
        let Some(view) = index.and_then(|index| document.buffer_views.get(index)) else {
            return Err(format!("there is no view {view} among the {} bufferViews", document.buffer_views.len()));
        };
        if let Some(name) = view.extensions.keys().find(|name| name.contains("meshopt_compression")) {
            return Err(format!("its bytes are compressed ({name}). Export the mesh without mesh compression."));
        }
        let buffer = view.buffer.and_then(whole).unwrap_or(u64::MAX);
        let Some(bytes) = usize::try_from(buffer).ok().and_then(|buffer| self.list.get(buffer)) else {
            return Err(format!("its view looks at a buffer that is not among the {}", self.list.len()));
        };
        let Some(bytes) = bytes else { return Err(String::new()) };
        let bytes = match bytes {
            Bytes::Borrowed(bytes) => bytes,
            Bytes::Owned(bytes) => bytes.as_slice(),
        };
        let number = |value: Option<f64>, name: &str| {
            let value = value.unwrap_or(0.0);
            whole(value).ok_or_else(|| format!("{name} of its view is {value}, not a whole number from 0 on"))
        };
        let (from, length) = (number(view.byte_offset, "byteOffset")?, number(view.byte_length, "byteLength")?);
        let stride = number(view.byte_stride, "byteStride")?;
        let range = from.checked_add(length).filter(|end| *end <= bytes.len() as u64);
        match range {
            Some(end) => Ok((&bytes[from as usize..end as usize], stride)),
            None => Err(format!(
                "its view reaches from byte {from} over {length} bytes, and the buffer has {}",
                bytes.len()
            )),
        }
    }
}

fn buffer<'a>(
    document: &Document,
    index: usize,
    container: &Container<'a>,
    left: &mut u64,
) -> Result<Bytes<'a>, String> {
    let buffer = &document.buffers[index];
    let Some(length) = buffer.byte_length.and_then(whole) else {
        return Err("byteLength is a whole number".to_owned());
    };
    let bytes = match &buffer.uri {
        None if index == 0 && container.is_binary => match container.binary {
            Some(binary) => Bytes::Borrowed(binary),
            None => return Err("the file has no binary chunk, where its first buffer should be".to_owned()),
        },
        None => {
            return Err("this buffer has no data. Send a .glb, or a .gltf with embedded buffers.".to_owned());
        }
        Some(uri) => match uri.split_at_checked(5) {
            Some((scheme, rest)) if scheme.eq_ignore_ascii_case("data:") => Bytes::Owned(data_uri(rest, left)?),
            _ => {
                let name: String = uri.chars().take(60).filter(|c| !c.is_control()).collect();
                return Err(format!(
                    "its data is in another file ({name:?}), and other files are not read. Export a .glb, or a .gltf with \
                     embedded buffers."
                ));
            }
        },
    };
    let have = match &bytes {
        Bytes::Borrowed(bytes) => bytes.len(),
        Bytes::Owned(bytes) => bytes.len(),
    };
    if length > have as u64 {
        return Err(format!("byteLength is {length}, and {have} bytes are there: the file was cut off or is damaged"));
    }
    Ok(bytes)
}

/// The bytes of what follows `data:`.
fn data_uri(rest: &str, left: &mut u64) -> Result<Vec<u8>, String> {
    let Some((kind, data)) = rest.split_once(',') else {
        return Err("its data: URI has no comma, and so no data".to_owned());
    };
    if !kind.to_ascii_lowercase().ends_with(";base64") {
        return Err("its data: URI is not base64, the only form that is read".to_owned());
    }
    let bytes = data.len() as u64 / 4 * 3;
    *left = left.checked_sub(bytes).ok_or("the embedded buffers are too large together")?;
    base64(data.as_bytes()).ok_or_else(|| "its data: URI is not sound base64".to_owned())
}

/// Base64 (RFC 4648, section 4), with or without padding at its end.
fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let padding = text.iter().rev().take(2).take_while(|b| **b == b'=').count();
    let text = &text[..text.len() - padding];
    let digit = |b: u8| {
        Some(u32::from(match b {
            b'A'..=b'Z' => b - b'A',
            b'a'..=b'z' => b - b'a' + 26,
            b'0'..=b'9' => b - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        }))
    };
    let mut out = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for group in text.chunks(4) {
        let mut bits = 0;
        for &b in group {
            bits = bits << 6 | digit(b)?;
        }
        let [_, bytes @ ..] = (bits << (6 * (4 - group.len()))).to_be_bytes();
        let count = match group.len() {
            4 => 3,
            3 => 2,
            2 => 1,
            _ => return None,
        };
        out.extend_from_slice(&bytes[..count]);
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_gives_the_bytes_of_the_standard_and_refuses_the_rest() {
        for (text, want) in
            [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYg==", "foob"), ("Zm9vYmE", "fooba")]
        {
            assert_eq!(base64(text.as_bytes()).as_deref(), Some(want.as_bytes()), "{text}");
        }
        for text in ["Z", "Zm9v!", "Zm=v", "===="] {
            assert_eq!(base64(text.as_bytes()), None, "{text}");
        }
    }
}
