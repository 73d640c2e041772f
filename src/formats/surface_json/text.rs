//! A pull reader of JSON text (RFC 8259): hands out one token at a time, keeps nothing.
//!
//! The surface reader pulls numbers straight into its arrays, knows the place of each, and goes on after a number that
//! JSON does not know (`NaN`, `Infinity`, `1e999`), so that all of a file's faults are found in one go. A general
//! reader stops at the first of these. Memory: the text and the caller's arrays. Nesting: at most [`MAX_DEPTH`].

use std::borrow::Cow;

/// Deepest nesting inside `extra` and other values that are skipped. Skipping recurses: this bounds the stack.
pub(super) const MAX_DEPTH: usize = 128;

/// The text is not JSON.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct SyntaxError {
    /// Byte offset.
    pub(super) at: usize,
    /// What is wrong there.
    pub(super) detail: &'static str,
}

/// What kind of value comes next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Object,
    Array,
    Text,
    Number,
    Bool,
    Null,
}

impl Kind {
    /// The kind in words, for messages.
    pub(super) const fn words(self) -> &'static str {
        match self {
            Self::Object => "an object",
            Self::Array => "a list",
            Self::Text => "a text",
            Self::Number => "a number",
            Self::Bool => "true or false",
            Self::Null => "null",
        }
    }
}

/// A place in a JSON text.
#[derive(Debug)]
pub(super) struct JsonText<'a> {
    text: &'a str,
    at: usize,
}

type Read<T> = Result<T, SyntaxError>;

impl<'a> JsonText<'a> {
    pub(super) const fn new(text: &'a str) -> Self {
        Self { text, at: 0 }
    }

    /// Byte offset of what comes next.
    pub(super) const fn offset(&self) -> usize {
        self.at
    }

    fn fail<T>(&self, detail: &'static str) -> Read<T> {
        Err(SyntaxError { at: self.at, detail })
    }

    fn byte(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    pub(super) fn skip_white(&mut self) {
        while matches!(self.byte(), Some(b' ' | b'\n' | b'\r' | b'\t')) {
            self.at += 1;
        }
    }

    /// The kind of the next value. Words that some programs write for numbers that are not finite count as numbers.
    pub(super) fn kind(&mut self) -> Read<Kind> {
        self.skip_white();
        match self.byte() {
            Some(b'{') => Ok(Kind::Object),
            Some(b'[') => Ok(Kind::Array),
            Some(b'"') => Ok(Kind::Text),
            Some(b'-' | b'+' | b'0'..=b'9' | b'N' | b'I' | b'i' | b'.') => Ok(Kind::Number),
            Some(b't' | b'f') => Ok(Kind::Bool),
            Some(b'n') if self.text.as_bytes()[self.at..].starts_with(b"nan") => Ok(Kind::Number),
            Some(b'n') => Ok(Kind::Null),
            Some(_) => self.fail("a value is expected here"),
            None => self.fail("the text ends before the document does"),
        }
    }

    /// Enters the array that comes next.
    pub(super) fn enter_array(&mut self) -> Read<()> {
        self.expect(b'[', "a list ([) is expected here")
    }

    /// True when an element follows, false when the array has ended. `first` for the first call.
    pub(super) fn next_element(&mut self, first: bool) -> Read<bool> {
        self.skip_white();
        match self.byte() {
            Some(b']') => {
                self.at += 1;
                Ok(false)
            }
            Some(_) if first => Ok(true),
            Some(b',') => {
                self.at += 1;
                self.skip_white();
                if self.byte() == Some(b']') { self.fail("no comma may stand before ]") } else { Ok(true) }
            }
            Some(_) => self.fail("a comma or ] is expected here"),
            None => self.fail("the text ends inside a list"),
        }
    }

    /// Enters the object that comes next.
    pub(super) fn enter_object(&mut self) -> Read<()> {
        self.expect(b'{', "an object ({) is expected here")
    }

    /// The next field's name, or `None` when the object has ended. `first` for the first call.
    pub(super) fn next_field(&mut self, first: bool) -> Read<Option<Cow<'a, str>>> {
        self.skip_white();
        match self.byte() {
            Some(b'}') => {
                self.at += 1;
                return Ok(None);
            }
            Some(_) if first => {}
            Some(b',') => {
                self.at += 1;
                self.skip_white();
                if self.byte() == Some(b'}') {
                    return self.fail("no comma may stand before }");
                }
            }
            Some(_) => return self.fail("a comma or } is expected here"),
            None => return self.fail("the text ends inside an object"),
        }
        if self.byte() != Some(b'"') {
            return self.fail("a field name in double quotes is expected here");
        }
        let name = self.string()?;
        self.skip_white();
        self.expect(b':', "a colon is expected after the field's name")?;
        Ok(Some(name))
    }

    /// Nothing but white space may follow.
    pub(super) fn end(&mut self) -> Read<()> {
        self.skip_white();
        if self.at == self.text.len() { Ok(()) } else { self.fail("something follows after the end of the document") }
    }

    fn expect(&mut self, byte: u8, detail: &'static str) -> Read<()> {
        self.skip_white();
        if self.byte() == Some(byte) {
            self.at += 1;
            Ok(())
        } else {
            self.fail(detail)
        }
    }

    /// The number that comes next, and its text. It is infinite or NaN when its text says so or is out of range.
    pub(super) fn number(&mut self) -> Read<(f64, &'a str)> {
        self.skip_white();
        let start = self.at;
        if let Some(word) = self.word_for_a_number() {
            self.at += word.len();
            let value = if word.contains(['f', 'F']) { f64::INFINITY } else { f64::NAN };
            return Ok((value, word));
        }
        if self.byte() == Some(b'-') {
            self.at += 1;
        }
        let leading = self.at;
        if self.digits() == 0 {
            return self.fail("a digit is expected here");
        }
        if self.text.as_bytes()[leading] == b'0' && self.at - leading > 1 {
            self.at = leading;
            return self.fail("a number may not begin with a superfluous 0");
        }
        if self.byte() == Some(b'.') {
            self.at += 1;
            if self.digits() == 0 {
                return self.fail("a digit is expected after the decimal point");
            }
        }
        if matches!(self.byte(), Some(b'e' | b'E')) {
            self.at += 1;
            if matches!(self.byte(), Some(b'+' | b'-')) {
                self.at += 1;
            }
            if self.digits() == 0 {
                return self.fail("a digit is expected in the exponent");
            }
        }
        let text = &self.text[start..self.at];
        match text.parse() {
            Ok(value) => Ok((value, text)),
            Err(_) => Err(SyntaxError { at: start, detail: "this is not a number" }),
        }
    }

    fn digits(&mut self) -> usize {
        let start = self.at;
        while matches!(self.byte(), Some(b'0'..=b'9')) {
            self.at += 1;
        }
        self.at - start
    }

    /// `NaN`, `inf`, `Infinity` in any case, with or without a sign: what programs write that do not check.
    fn word_for_a_number(&self) -> Option<&'a str> {
        let rest = &self.text[self.at..];
        let sign = usize::from(rest.starts_with(['-', '+']));
        let letters = rest[sign..].bytes().take_while(u8::is_ascii_alphabetic).count();
        let word = &rest[sign..sign + letters];
        ["nan", "inf", "infinity"].iter().any(|w| word.eq_ignore_ascii_case(w)).then(|| &rest[..sign + letters])
    }

    /// The `true` or `false` that comes next.
    pub(super) fn boolean(&mut self) -> Read<bool> {
        self.skip_white();
        if self.literal("true") {
            Ok(true)
        } else if self.literal("false") {
            Ok(false)
        } else {
            self.fail("true or false is expected here")
        }
    }

    /// The `null` that comes next.
    pub(super) fn null(&mut self) -> Read<()> {
        self.skip_white();
        if self.literal("null") { Ok(()) } else { self.fail("a value is expected here") }
    }

    fn literal(&mut self, word: &str) -> bool {
        let found = self.text.as_bytes()[self.at..].starts_with(word.as_bytes());
        if found {
            self.at += word.len();
        }
        found
    }

    /// The string that comes next, its escapes resolved.
    pub(super) fn string(&mut self) -> Read<Cow<'a, str>> {
        self.skip_white();
        self.expect(b'"', "a text in double quotes is expected here")?;
        let start = self.at;
        loop {
            match self.byte() {
                Some(b'"') => {
                    let text = &self.text[start..self.at];
                    self.at += 1;
                    return Ok(Cow::Borrowed(text));
                }
                Some(b'\\') => return self.escaped_string(start),
                Some(0..=0x1F) => return self.fail("a line break or control character may not stand in a text"),
                Some(_) => self.at += 1,
                None => return self.fail("the text ends inside a text in quotes"),
            }
        }
    }

    /// The rest of a string that began at `start` and has an escape here.
    fn escaped_string(&mut self, start: usize) -> Read<Cow<'a, str>> {
        let mut out = self.text[start..self.at].to_owned();
        let mut plain = self.at;
        loop {
            match self.byte() {
                Some(b'"') => {
                    out.push_str(&self.text[plain..self.at]);
                    self.at += 1;
                    return Ok(Cow::Owned(out));
                }
                Some(b'\\') => {
                    out.push_str(&self.text[plain..self.at]);
                    self.at += 1;
                    out.push(self.escape()?);
                    plain = self.at;
                }
                Some(0..=0x1F) => return self.fail("a line break or control character may not stand in a text"),
                Some(_) => self.at += 1,
                None => return self.fail("the text ends inside a text in quotes"),
            }
        }
    }

    fn escape(&mut self) -> Read<char> {
        let plain = match self.byte() {
            Some(c @ (b'"' | b'\\' | b'/')) => char::from(c),
            Some(b'b') => '\u{8}',
            Some(b'f') => '\u{C}',
            Some(b'n') => '\n',
            Some(b'r') => '\r',
            Some(b't') => '\t',
            Some(b'u') => {
                self.at += 1;
                return self.unicode_escape();
            }
            _ => return self.fail("this escape is not known to JSON"),
        };
        self.at += 1;
        Ok(plain)
    }

    fn unicode_escape(&mut self) -> Read<char> {
        let high = self.four_hex_digits()?;
        let code = if (0xD800..0xDC00).contains(&high) {
            if !self.literal("\\u") {
                return self.fail("the second half of a \\u pair is missing");
            }
            let low = self.four_hex_digits()?;
            if !(0xDC00..0xE000).contains(&low) {
                return self.fail("the second half of a \\u pair is missing");
            }
            0x1_0000 + ((high - 0xD800) << 10) + (low - 0xDC00)
        } else {
            high
        };
        char::from_u32(code).map_or_else(|| self.fail("this \\u escape names no character"), Ok)
    }

    fn four_hex_digits(&mut self) -> Read<u32> {
        let digits = self.text.as_bytes().get(self.at..self.at + 4).unwrap_or_default();
        let mut code = 0;
        for digit in digits {
            let Some(value) = char::from(*digit).to_digit(16) else {
                return self.fail("four hexadecimal digits are expected after \\u");
            };
            code = code * 16 + value;
        }
        if digits.len() < 4 {
            return self.fail("four hexadecimal digits are expected after \\u");
        }
        self.at += 4;
        Ok(code)
    }

    /// Passes over the value that comes next, whatever it is.
    pub(super) fn skip(&mut self) -> Read<()> {
        self.skip_at(0)
    }

    fn skip_at(&mut self, depth: usize) -> Read<()> {
        if depth > MAX_DEPTH {
            return self.fail("lists and objects are nested more than 128 deep");
        }
        match self.kind()? {
            Kind::Object => {
                self.enter_object()?;
                let mut first = true;
                while self.next_field(first)?.is_some() {
                    first = false;
                    self.skip_at(depth + 1)?;
                }
                Ok(())
            }
            Kind::Array => {
                self.enter_array()?;
                let mut first = true;
                while self.next_element(first)? {
                    first = false;
                    self.skip_at(depth + 1)?;
                }
                Ok(())
            }
            Kind::Text => self.string().map(drop),
            Kind::Number => self.number().map(drop),
            Kind::Bool => self.boolean().map(drop),
            Kind::Null => self.null(),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn accepts(text: &str) -> bool {
        let mut reader = JsonText::new(text);
        reader.skip().and_then(|()| reader.end()).is_ok()
    }

    #[test]
    fn numbers_are_read_to_the_last_bit() {
        for (text, value) in
            [("0", 0.0), ("-0.1", -0.1), ("1e3", 1000.0), ("0.1e-2", 0.001), ("123456789.125", 123_456_789.125)]
        {
            assert_eq!(JsonText::new(text).number().unwrap().0.to_bits(), f64::to_bits(value));
        }
    }

    #[test]
    fn words_for_numbers_that_are_not_finite_are_read_as_such() {
        for word in ["NaN", "nan", "-nan", "Infinity", "-Infinity", "inf", "-inf", "1e999"] {
            let (value, text) = JsonText::new(word).number().unwrap();
            assert!(!value.is_finite() && text == word, "{word}");
        }
    }

    #[test]
    fn escapes_are_resolved() {
        let (mut reader, want) = (JsonText::new(r#""a\"\\\/\n\u00e4\ud83d\ude00z""#), "a\"\\/\nä😀z");
        assert_eq!(reader.string().unwrap(), want);
        for bad in [r#""\ud83d""#, r#""\ude00""#, r#""\u12"#, r#""\x""#, "\"a\nb\"", "\"abc"] {
            assert!(JsonText::new(bad).string().is_err(), "{bad}");
        }
    }

    #[test]
    fn deep_nesting_is_refused_instead_of_overflowing_the_stack() {
        assert!(accepts(&format!("{}{}", "[".repeat(100), "]".repeat(100))));
        assert!(!accepts(&"[".repeat(1_000_000)));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        #[test]
        fn agrees_with_serde_json_on_what_is_json(text in r#"[\[\]{}:,"0-9eE+\-. a\\u\n]{0,24}"#) {
            let theirs = serde_json::from_str::<serde::de::IgnoredAny>(&text).is_ok();
            prop_assert_eq!(accepts(&text), theirs, "{:?}", text);
        }

        #[test]
        fn never_panics(text in any::<String>()) {
            let _ = accepts(&text);
        }
    }
}
