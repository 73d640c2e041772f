//! Accessors: positions and indices out of views, every offset and count checked against the bytes that are there before
//! anything is read or allocated.

use super::buffers::Buffers;
use super::document::{Accessor, Document, SparsePart, whole};

/// A kind of number in a buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: Option<f64>) -> Option<Self> {
        Some(match code.and_then(whole)? {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    const fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number at the start of `b`, which has as many bytes as this kind takes; normalised numbers lie in [-1, 1].
    fn number(self, b: &[u8], normalized: bool) -> f64 {
        let (value, greatest) = match (self, b) {
            (Self::I8, [a, ..]) => (f64::from(i8::from_le_bytes([*a])), 127.0),
            (Self::U8, [a, ..]) => (f64::from(*a), 255.0),
            (Self::I16, [a, b, ..]) => (f64::from(i16::from_le_bytes([*a, *b])), 32767.0),
            (Self::U16, [a, b, ..]) => (f64::from(u16::from_le_bytes([*a, *b])), 65535.0),
            (Self::U32, [a, b, c, d, ..]) => (f64::from(u32::from_le_bytes([*a, *b, *c, *d])), 1.0),
            (Self::F32, [a, b, c, d, ..]) => (f64::from(f32::from_le_bytes([*a, *b, *c, *d])), 1.0),
            _ => (f64::NAN, 1.0),
        };
        if normalized { (value / greatest).max(-1.0) } else { value }
    }
}

/// How many elements an accessor has, before its bytes are looked at.
pub(super) fn count(document: &Document, accessor: f64) -> Result<u64, String> {
    let count = find(document, accessor)?.1.count.unwrap_or(f64::NAN);
    whole(count).filter(|count| *count >= 1).ok_or_else(|| format!("count is {count}, not a whole number from 1 on"))
}

/// Positions, in the file's own units. All are finite.
///
/// # Errors
/// What is wrong with the accessor, in words; an empty text when a buffer is at fault, which is noted already.
pub(super) fn positions(document: &Document, buffers: &Buffers, accessor: f64) -> Result<Vec<[f64; 3]>, String> {
    let (_, found) = find(document, accessor)?;
    let component = Component::of(found.component_type)
        .filter(|component| *component != Component::U32)
        .ok_or("positions are floats, or quantized bytes or shorts; componentType says something else")?;
    if found.kind.as_deref() != Some("VEC3") {
        return Err(format!("positions are of type VEC3; this says {:?}", found.kind.as_deref().unwrap_or("nothing")));
    }
    if found.buffer_view.is_none() && found.sparse.is_none() {
        return Err("it has no data: all positions would be zero".to_owned());
    }
    let count = count(document, accessor)?;
    let normalized = found.normalized && component != Component::F32;
    let read = |element: &[u8]| {
        let size = component.bytes();
        std::array::from_fn(|k| component.number(&element[k * size..], normalized))
    };
    let mut list: Vec<[f64; 3]> = match found.buffer_view {
        Some(view) => elements(document, buffers, view, found.byte_offset, count, 3 * component.bytes(), true)?
            .map(read)
            .collect(),
        None => vec![[0.0; 3]; zeros(count, found)?],
    };
    for (place, element) in sparse(document, buffers, found, count, 3 * component.bytes())? {
        list[place] = read(element);
    }
    if let Some(k) = list.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        let bad = list.iter().filter(|p| !p.iter().all(|x| x.is_finite())).count();
        let more = if bad > 1 { format!(", and {} others are not either", bad - 1) } else { String::new() };
        return Err(format!("position {k} is not a finite number{more}"));
    }
    Ok(list)
}

/// Indices.
///
/// # Errors
/// As [`positions`].
pub(super) fn indices(document: &Document, buffers: &Buffers, accessor: f64) -> Result<Vec<u32>, String> {
    let (_, found) = find(document, accessor)?;
    let component = index_component(found.component_type)?;
    if found.kind.as_deref() != Some("SCALAR") {
        return Err(format!("indices are of type SCALAR; this says {:?}", found.kind.as_deref().unwrap_or("nothing")));
    }
    let count = count(document, accessor)?;
    let read = |element: &[u8]| component.number(element, false) as u32;
    let mut list: Vec<u32> = match found.buffer_view {
        Some(view) => {
            elements(document, buffers, view, found.byte_offset, count, component.bytes(), true)?.map(read).collect()
        }
        None => vec![0; zeros(count, found)?],
    };
    for (place, element) in sparse(document, buffers, found, count, component.bytes())? {
        list[place] = read(element);
    }
    Ok(list)
}

fn index_component(code: Option<f64>) -> Result<Component, String> {
    Component::of(code)
        .filter(|component| matches!(component, Component::U8 | Component::U16 | Component::U32))
        .ok_or_else(|| "indices are unsigned bytes, shorts or ints; componentType says something else".to_owned())
}

fn find(document: &Document, accessor: f64) -> Result<(usize, &Accessor), String> {
    whole(accessor)
        .and_then(|index| Some((index as usize, document.accessors.get(usize::try_from(index).ok()?)?)))
        .ok_or_else(|| format!("there is no accessor {accessor} among the {}", document.accessors.len()))
}

/// How many zeros stand for an accessor without a view. Only sparse ones come without; since nothing in the file backs
/// that number, it must not be larger than what is set times a small factor.
fn zeros(count: u64, accessor: &Accessor) -> Result<usize, String> {
    let set = accessor.sparse.as_ref().and_then(|sparse| sparse.count).and_then(whole).unwrap_or(0);
    if count > set.saturating_mul(ZEROS_PER_VALUE) {
        return Err(format!("it has {count} elements, of which {set} are set and the others are zero by default"));
    }
    Ok(count as usize)
}

/// A sparse accessor without a view may have so many elements for each that it sets. Zeros are places at the origin: more
/// of them mean nothing, and would let a small file ask for much memory.
const ZEROS_PER_VALUE: u64 = 16;

/// `count` elements of `size` bytes.
fn elements<'a>(
    document: &Document,
    buffers: &'a Buffers,
    view: f64,
    offset: Option<f64>,
    count: u64,
    size: usize,
    strided: bool,
) -> Result<impl Iterator<Item = &'a [u8]>, String> {
    let (bytes, stride) = buffers.view(document, view)?;
    let offset = offset.unwrap_or(0.0);
    let from = whole(offset).ok_or_else(|| format!("byteOffset is {offset}, not a whole number from 0 on"))?;
    let stride = match (stride, strided) {
        (0, _) | (_, false) => size as u64,
        (stride, true) if stride < size as u64 => {
            return Err(format!("byteStride of its view is {stride}, less than the {size} bytes of an element"));
        }
        (stride, true) => stride,
    };
    // The last element need not be padded to the stride.
    let end = count
        .checked_sub(1)
        .and_then(|steps| steps.checked_mul(stride))
        .and_then(|run| run.checked_add(size as u64))
        .and_then(|run| run.checked_add(from))
        .filter(|end| *end <= bytes.len() as u64);
    if end.is_none() {
        return Err(format!(
            "{count} elements of {size} bytes, {stride} bytes apart, from byte {from} on do not fit into the {} bytes of its \
             view",
            bytes.len()
        ));
    }
    let bytes = &bytes[from as usize..];
    Ok((0..count as usize).map(move |k| &bytes[k * stride as usize..k * stride as usize + size]))
}

/// The places and values that a sparse accessor sets.
fn sparse<'a>(
    document: &Document,
    buffers: &'a Buffers,
    accessor: &Accessor,
    count: u64,
    size: usize,
) -> Result<Vec<(usize, &'a [u8])>, String> {
    let Some(sparse) = &accessor.sparse else { return Ok(Vec::new()) };
    let many = sparse.count.and_then(whole).filter(|many| (1..=count).contains(many));
    let many = many.ok_or_else(|| format!("its sparse count is not from 1 to its count, {count}"))?;
    let component = index_component(sparse.indices.component_type)?;
    let part = |part: &SparsePart, size: usize| {
        let view = part.buffer_view.ok_or_else(|| "a sparse part names no view".to_owned())?;
        elements(document, buffers, view, part.byte_offset, many, size, false)
    };
    let places = part(&sparse.indices, component.bytes())?.map(|element| component.number(element, false) as u64);
    let values = part(&sparse.values, size)?;
    places
        .zip(values)
        .map(|(place, value)| {
            if place < count {
                Ok((place as usize, value))
            } else {
                Err(format!("its sparse part sets element {place}, and it has {count}"))
            }
        })
        .collect()
}
