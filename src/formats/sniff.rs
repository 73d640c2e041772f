//! What a body is, by its first bytes, for clients that do not say it in `Content-Type`.

/// A kind of body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sniffed {
    /// JSON: an object follows after white space or a byte order mark.
    Json,
    /// glTF binary: the magic `glTF`.
    GltfBinary,
}

/// The byte order mark that some Windows programs put before UTF-8.
pub(crate) const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// What `bytes` begin like; `None` when neither JSON nor glTF binary.
#[must_use]
pub fn sniff(bytes: &[u8]) -> Option<Sniffed> {
    if bytes.starts_with(b"glTF") {
        return Some(Sniffed::GltfBinary);
    }
    let text = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
    let first = text.iter().find(|b| !matches!(b, b' ' | b'\t' | b'\n' | b'\r'))?;
    (*first == b'{').then_some(Sniffed::Json)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_is_known_after_white_space_and_a_byte_order_mark() {
        assert_eq!(sniff(b"{}"), Some(Sniffed::Json));
        assert_eq!(sniff(b" \r\n\t{"), Some(Sniffed::Json));
        assert_eq!(sniff(b"\xEF\xBB\xBF{"), Some(Sniffed::Json));
    }

    #[test]
    fn glb_is_known_by_its_magic_and_the_rest_is_unknown() {
        assert_eq!(sniff(b"glTF\x02\0\0\0"), Some(Sniffed::GltfBinary));
        for other in [&b""[..], b"   ", b"[1]", b"solid cube", b"glT", b"\xEF\xBB\xBF"] {
            assert_eq!(sniff(other), None);
        }
    }
}
