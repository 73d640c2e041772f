//! Finds a number that is not finite in any serialisable value, before `serde_json` would write it as `null`.
//!
//! A serializer that writes nothing: it walks the value as JSON would and keeps the path.

use serde::ser::{self, Serialize};

use crate::formats::faults::{Step, pointer};

/// JSON Pointer of the first number that is not finite.
pub(in crate::formats) fn first_not_finite(value: &impl Serialize) -> Option<String> {
    let mut walk = Walk { steps: Vec::new() };
    value.serialize(&mut walk).err().map(|found| found.0)
}

struct Walk {
    steps: Vec<Step>,
}

/// The walk ends at what was found.
#[derive(Debug)]
struct Found(String);

impl std::fmt::Display for Found {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Found {}

impl ser::Error for Found {
    fn custom<T: std::fmt::Display>(message: T) -> Self {
        Self(message.to_string())
    }
}

impl Walk {
    fn at(&mut self, step: Step, value: &(impl Serialize + ?Sized)) -> Result<(), Found> {
        self.steps.push(step);
        value.serialize(&mut *self)?;
        self.steps.pop();
        Ok(())
    }
}

macro_rules! passes {
    ($($method:ident: $type:ty),*) => {
        $(fn $method(self, _: $type) -> Result<(), Found> { Ok(()) })*
    };
}

impl<'a> ser::Serializer for &'a mut Walk {
    type Ok = ();
    type Error = Found;
    type SerializeSeq = List<'a>;
    type SerializeTuple = List<'a>;
    type SerializeTupleStruct = List<'a>;
    type SerializeTupleVariant = List<'a>;
    type SerializeMap = Fields<'a>;
    type SerializeStruct = Fields<'a>;
    type SerializeStructVariant = Fields<'a>;

    passes!(serialize_bool: bool, serialize_i8: i8, serialize_i16: i16, serialize_i32: i32, serialize_i64: i64,
        serialize_u8: u8, serialize_u16: u16, serialize_u32: u32, serialize_u64: u64, serialize_char: char,
        serialize_str: &str, serialize_bytes: &[u8], serialize_unit_struct: &'static str);

    fn serialize_f32(self, x: f32) -> Result<(), Found> {
        self.serialize_f64(f64::from(x))
    }

    fn serialize_f64(self, x: f64) -> Result<(), Found> {
        if x.is_finite() { Ok(()) } else { Err(Found(pointer("", &self.steps))) }
    }

    fn serialize_none(self) -> Result<(), Found> {
        Ok(())
    }

    fn serialize_unit(self) -> Result<(), Found> {
        Ok(())
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<(), Found> {
        value.serialize(self)
    }

    fn serialize_unit_variant(self, _: &'static str, _: u32, _: &'static str) -> Result<(), Found> {
        Ok(())
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(self, _: &'static str, value: &T) -> Result<(), Found> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        value: &T,
    ) -> Result<(), Found> {
        self.at(Step::Field(variant), value)
    }

    fn serialize_seq(self, _: Option<usize>) -> Result<List<'a>, Found> {
        Ok(List { walk: self, index: 0, variant: false })
    }

    fn serialize_tuple(self, _: usize) -> Result<List<'a>, Found> {
        self.serialize_seq(None)
    }

    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<List<'a>, Found> {
        self.serialize_seq(None)
    }

    fn serialize_tuple_variant(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        _: usize,
    ) -> Result<List<'a>, Found> {
        self.steps.push(Step::Field(variant));
        Ok(List { walk: self, index: 0, variant: true })
    }

    fn serialize_map(self, _: Option<usize>) -> Result<Fields<'a>, Found> {
        Ok(Fields { walk: self, key: String::new(), variant: false })
    }

    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Fields<'a>, Found> {
        self.serialize_map(None)
    }

    fn serialize_struct_variant(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        _: usize,
    ) -> Result<Fields<'a>, Found> {
        self.steps.push(Step::Field(variant));
        Ok(Fields { walk: self, key: String::new(), variant: true })
    }
}

struct List<'a> {
    walk: &'a mut Walk,
    index: usize,
    variant: bool,
}

impl List<'_> {
    fn element(&mut self, value: &(impl Serialize + ?Sized)) -> Result<(), Found> {
        self.index += 1;
        self.walk.at(Step::Index(self.index - 1), value)
    }

    fn close(self) {
        if self.variant {
            self.walk.steps.pop();
        }
    }
}

struct Fields<'a> {
    walk: &'a mut Walk,
    key: String,
    variant: bool,
}

impl Fields<'_> {
    fn close(self) {
        if self.variant {
            self.walk.steps.pop();
        }
    }
}

macro_rules! list {
    ($($trait:ident: $method:ident),*) => {
        $(impl ser::$trait for List<'_> {
            type Ok = ();
            type Error = Found;
            fn $method<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Found> {
                self.element(value)
            }
            fn end(self) -> Result<(), Found> {
                self.close();
                Ok(())
            }
        })*
    };
}

list!(SerializeSeq: serialize_element, SerializeTuple: serialize_element, SerializeTupleStruct: serialize_field,
    SerializeTupleVariant: serialize_field);

macro_rules! fields {
    ($($trait:ident),*) => {
        $(impl ser::$trait for Fields<'_> {
            type Ok = ();
            type Error = Found;
            fn serialize_field<T: Serialize + ?Sized>(&mut self, key: &'static str, value: &T) -> Result<(), Found> {
                self.walk.at(Step::Field(key), value)
            }
            fn end(self) -> Result<(), Found> {
                self.close();
                Ok(())
            }
        })*
    };
}

fields!(SerializeStruct, SerializeStructVariant);

impl ser::SerializeMap for Fields<'_> {
    type Ok = ();
    type Error = Found;

    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), Found> {
        // Keys of our maps are texts; another key has no name in the path.
        let name = serde_json::to_value(key).ok();
        name.as_ref().and_then(serde_json::Value::as_str).unwrap_or("?").clone_into(&mut self.key);
        Ok(())
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Found> {
        let key = std::mem::take(&mut self.key);
        self.walk.at(Step::Named(key), value)
    }

    fn end(self) -> Result<(), Found> {
        self.close();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use serde::Serialize;

    use super::*;

    #[derive(Serialize)]
    enum Shape {
        Point(f64),
        Pair(f64, f64),
        Box { width: f64 },
        Nothing,
    }

    #[test]
    fn a_number_that_is_not_finite_is_found_wherever_it_hides() {
        let nan = f64::NAN;
        assert_eq!(first_not_finite(&(1.0, [2.0, nan])), Some("/1/1".into()));
        assert_eq!(first_not_finite(&Some(BTreeMap::from([("a/b", nan)]))), Some("/a~1b".into()));
        assert_eq!(first_not_finite(&Shape::Point(nan)), Some("/Point".into()));
        assert_eq!(first_not_finite(&[Shape::Pair(0.0, 0.0), Shape::Pair(0.0, nan)]), Some("/1/Pair/1".into()));
        assert_eq!(
            first_not_finite(&vec![Shape::Nothing, Shape::Box { width: f64::INFINITY }]),
            Some("/1/Box/width".into())
        );
        assert_eq!(first_not_finite(&(1.0, "x", None::<f64>, f32::MAX, [0_u8; 3])), None);
    }
}
