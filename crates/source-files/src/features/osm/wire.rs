//! Protocol buffers as they lie in a block: numbered fields, one after the other, read where they are.
//!
//! Read here and not by a library: the two that know the format (`osmpbf`, `osmpbfreader`) turn a block whole into
//! objects, so that a file of 33 KB asks for 1.3 GB, and the first panics on a kind of member that it does not know.
//! Nothing here allocates.

use crate::limits::OSM_NUMBERS_MAX;

/// Why a message cannot be read.
pub(super) type Fault = &'static str;

const CUT: Fault = "a field that is cut short";

/// What a field holds.
#[derive(Clone, Copy, Debug)]
pub(super) enum Value<'a> {
    Number(u64),
    Bytes(&'a [u8]),
    /// Four or eight bytes: no field of the format that matters here has them.
    Fixed,
}

impl<'a> Value<'a> {
    pub(super) fn number(self) -> Result<u64, Fault> {
        let Value::Number(number) = self else { return Err("a field that is no number where one should be") };
        Ok(number)
    }

    pub(super) fn bytes(self) -> Result<&'a [u8], Fault> {
        let Value::Bytes(bytes) = self else { return Err("a number where a text or a message should be") };
        Ok(bytes)
    }

    /// Appends what a repeated number holds: many packed together, or one by itself.
    pub(super) fn append_to<T>(self, all: &mut Vec<T>, of: impl Fn(u64) -> T) -> Result<(), Fault> {
        let mut add = |number: u64| {
            if OSM_NUMBERS_MAX <= all.len() {
                return Err("a list of more than a million numbers, as no way, relation or block of nodes has");
            }
            all.push(of(number));
            Ok(())
        };
        match self {
            Value::Number(number) => add(number)?,
            Value::Bytes(mut bytes) => {
                while !bytes.is_empty() {
                    add(varint(&mut bytes)?)?;
                }
            }
            Value::Fixed => return Err("a field that is no number where one should be"),
        }
        Ok(())
    }
}

/// The fields of a message, from the front.
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Iterator for Fields<'a> {
    type Item = Result<(u64, Value<'a>), Fault>;

    fn next(&mut self) -> Option<Self::Item> {
        (!self.0.is_empty()).then(|| self.field().inspect_err(|_| self.0 = &[]))
    }
}

impl<'a> Fields<'a> {
    fn field(&mut self) -> Result<(u64, Value<'a>), Fault> {
        let key = varint(&mut self.0)?;
        let value = match key & 7 {
            0 => Value::Number(varint(&mut self.0)?),
            1 => self.take(8).map(|_| Value::Fixed)?,
            2 => {
                let count = varint(&mut self.0)?;
                Value::Bytes(self.take(usize::try_from(count).map_err(|_| CUT)?)?)
            }
            5 => self.take(4).map(|_| Value::Fixed)?,
            _ => return Err("a field of a kind that is no longer used"),
        };
        Ok((key >> 3, value))
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], Fault> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or(CUT)?;
        self.0 = rest;
        Ok(taken)
    }
}

/// A number of up to ten bytes, seven bits in each, the lowest first.
fn varint(bytes: &mut &[u8]) -> Result<u64, Fault> {
    let mut number = 0;
    for (index, &byte) in bytes.iter().enumerate().take(10) {
        number |= u64::from(byte & 127) << (7 * index);
        if byte < 128 {
            *bytes = &bytes[index + 1..];
            return Ok(number);
        }
    }
    Err(if bytes.len() < 10 { CUT } else { "a number of more than ten bytes" })
}

/// Numbers of either sign, the lowest bit telling which.
pub(super) fn signed(number: u64) -> i64 {
    (number >> 1).cast_signed() ^ -((number & 1).cast_signed())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fields(bytes: &[u8]) -> Result<Vec<(u64, Value<'_>)>, Fault> {
        Fields(bytes).collect()
    }

    #[test]
    fn numbers_and_bytes_are_read_and_fixed_fields_passed_over() {
        let bytes = [8, 172, 2, 18, 2, 7, 9, 29, 1, 2, 3, 4, 33, 1, 2, 3, 4, 5, 6, 7, 8];
        let found = fields(&bytes).unwrap();
        assert_eq!(found.iter().map(|(field, _)| *field).collect::<Vec<_>>(), [1, 2, 3, 4]);
        assert_eq!(found[0].1.number(), Ok(300));
        assert_eq!(found[1].1.bytes(), Ok(&[7, 9][..]));
    }

    #[test]
    fn whatever_is_cut_short_is_a_fault_and_no_panic() {
        let bytes = [8, 172, 2, 18, 2, 7, 9, 29, 1, 2, 3, 4];
        let borders = [0, 3, 7, 12];
        for end in 0..bytes.len() {
            assert_eq!(fields(&bytes[..end]).is_ok(), borders.contains(&end), "cut at {end}");
        }
        assert!(fields(&[8, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 1]).is_err());
        assert!(fields(&[18, 255, 255, 255, 255, 255, 255, 255, 255, 127]).is_err());
    }

    #[test]
    fn signs_are_in_the_lowest_bit() {
        assert_eq!([0, 1, 2, 3, u64::MAX].map(signed), [0, -1, 1, -2, i64::MIN]);
    }
}
