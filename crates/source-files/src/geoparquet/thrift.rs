//! The few numbers of Parquet's own structures that are looked at before the library sees them.
//!
//! The library takes room for as many children, values or bytes as a structure promises, and goes as deep as a schema
//! does. So the structures (Thrift's compact protocol) are walked through here first.

/// Structures in structures: the format's own go 6 deep.
const DEPTH_MAX: usize = 32;
/// Columns in columns.
const SCHEMA_DEPTH_MAX: usize = 32;

/// Kinds of values.
const INTEGER: u8 = 5;
const BINARY: u8 = 8;
const LIST: u8 = 9;
const SET: u8 = 10;
const MAP: u8 = 11;
const STRUCT: u8 = 12;

/// What the header of a page promises.
pub(super) struct Page {
    /// Bytes once unpacked.
    pub bytes: u64,
    /// Values, absent ones included.
    pub values: u64,
    /// Bytes of the header itself.
    pub header: u64,
}

/// Bytes of a structure, walked from the front. All steps are `None` where it is none.
struct Walk<'a> {
    bytes: &'a [u8],
}

/// Whether a footer can be handed to the library: its lists are no longer than it is, its schema is a tree.
pub(super) fn is_sound_footer(bytes: &[u8]) -> bool {
    let mut walk = Walk { bytes };
    let mut children = Vec::new();
    let whole = walk.fields(&mut |field, kind, walk| match (field, kind) {
        (2, LIST) => {
            let (count, element) = walk.list()?;
            for _ in 0..count {
                children.push(if element == STRUCT { walk.children()? } else { None? });
            }
            Some(())
        }
        _ => walk.skip(kind, 0),
    });
    whole.is_some() && is_tree(&children)
}

/// Whether numbers of children, parents first, are those of one tree that is not too deep.
fn is_tree(children: &[u64]) -> bool {
    let mut open: Vec<u64> = Vec::new();
    for (index, &count) in children.iter().enumerate() {
        if 0 < index {
            while open.last() == Some(&0) {
                open.pop();
            }
            match open.last_mut() {
                Some(left) => *left -= 1,
                None => return false,
            }
        }
        if children.len() as u64 <= count || SCHEMA_DEPTH_MAX < open.len() {
            return false;
        }
        open.push(count);
    }
    !children.is_empty() && open.iter().all(|&left| left == 0)
}

/// What the header of a page says, where `bytes` begin with one.
pub(super) fn page(bytes: &[u8]) -> Option<Page> {
    const SIZE: i64 = 2;
    /// Headers of data, of dictionaries, and of data in the format's second version.
    const OF_VALUES: [i64; 3] = [5, 7, 8];
    let mut walk = Walk { bytes };
    let (mut size, mut values) = (0, 0);
    walk.fields(&mut |field, kind, walk| match kind {
        INTEGER if field == SIZE => walk.at_most(&mut size),
        STRUCT if OF_VALUES.contains(&field) => walk.fields(&mut |field, kind, walk| match kind {
            INTEGER if field == 1 => walk.at_most(&mut values),
            _ => walk.skip(kind, 1),
        }),
        _ => walk.skip(kind, 0),
    })?;
    Some(Page { bytes: size, values, header: (bytes.len() - walk.bytes.len()) as u64 })
}

impl Walk<'_> {
    fn byte(&mut self) -> Option<u8> {
        let (&first, rest) = self.bytes.split_first()?;
        self.bytes = rest;
        Some(first)
    }

    fn pass(&mut self, count: u64) -> Option<()> {
        self.bytes = self.bytes.get(usize::try_from(count).ok()?..)?;
        Some(())
    }

    fn varint(&mut self) -> Option<u64> {
        let mut number = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.byte()?;
            number |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Some(number);
            }
        }
        None
    }

    fn number(&mut self) -> Option<i64> {
        let folded = self.varint()?;
        Some((folded >> 1).cast_signed() ^ -(folded & 1).cast_signed())
    }

    /// Takes a number over where it is greater.
    fn at_most(&mut self, most: &mut u64) -> Option<()> {
        *most = (*most).max(u64::try_from(self.number()?).ok()?);
        Some(())
    }

    /// How many elements a list has, each of at least one byte, and of which kind they are.
    fn list(&mut self) -> Option<(u64, u8)> {
        let head = self.byte()?;
        let count = if head >> 4 == 15 { self.varint()? } else { u64::from(head >> 4) };
        (count <= self.bytes.len() as u64).then_some((count, head & 15))
    }

    /// Goes through the fields of a structure, of which `see` passes each one's value by its number and kind.
    fn fields(&mut self, see: &mut dyn FnMut(i64, u8, &mut Self) -> Option<()>) -> Option<()> {
        let mut field = 0_i64;
        loop {
            let head = self.byte()?;
            if head & 15 == 0 {
                return Some(());
            }
            field = if head >> 4 == 0 { self.number()? } else { field.checked_add(i64::from(head >> 4))? };
            see(field, head & 15, self)?;
        }
    }

    /// Passes an element of a schema; how many children it has.
    fn children(&mut self) -> Option<u64> {
        const CHILDREN: i64 = 5;
        let mut children = 0;
        self.fields(&mut |field, kind, walk| match field {
            CHILDREN => {
                children = u64::try_from(walk.number()?).ok()?;
                Some(())
            }
            _ => walk.skip(kind, 1),
        })?;
        Some(children)
    }

    /// Passes a value. Booleans of fields are in their kind, those of lists have a byte each.
    fn skip(&mut self, kind: u8, depth: usize) -> Option<()> {
        if DEPTH_MAX < depth {
            return None;
        }
        match kind {
            1 | 2 => Some(()),
            3 => self.pass(1),
            4..=6 => self.varint().map(|_| ()),
            7 => self.pass(8),
            BINARY => {
                let len = self.varint()?;
                self.pass(len)
            }
            LIST | SET => {
                let (count, element) = self.list()?;
                (0..count).try_for_each(|_| self.skip_element(element, depth + 1))
            }
            MAP => {
                let count = self.varint()?;
                let kinds = if count == 0 { 0 } else { self.byte()? };
                (0..count).try_for_each(|_| {
                    self.skip_element(kinds >> 4, depth + 1)?;
                    self.skip_element(kinds & 15, depth + 1)
                })
            }
            STRUCT => self.fields(&mut |_, kind, walk| walk.skip(kind, depth + 1)),
            _ => None,
        }
    }

    fn skip_element(&mut self, kind: u8, depth: usize) -> Option<()> {
        if matches!(kind, 1 | 2) { self.pass(1) } else { self.skip(kind, depth) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_schema_is_one_tree_that_is_not_too_deep() {
        assert!(is_tree(&[2, 1, 0, 0]) && is_tree(&[0]));
        for bad in [&[][..], &[1], &[1, 0, 0], &[1 << 31, 0], &[2, 0]] {
            assert!(!is_tree(bad), "{bad:?}");
        }
        let deep: Vec<u64> = std::iter::repeat_n(1, 40).chain([0]).collect();
        assert!(!is_tree(&deep));
    }
}
