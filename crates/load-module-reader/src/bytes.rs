//! A cursor over the bytes of one section: every read is bounded and knows where it stands.

use crate::{ReadError, Section, Vertex};

/// Reads little-endian values of `section` one after the other.
pub(crate) struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Offset of `bytes` in the file.
    base: u64,
    section: Section,
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(bytes: &'a [u8], base: u64, section: Section) -> Self {
        Self { bytes, at: 0, base, section }
    }

    /// Offset in the file of the next value.
    pub(crate) fn offset(&self) -> u64 {
        self.base + self.at as u64
    }

    pub(crate) fn take(&mut self, length: usize) -> Result<&'a [u8], ReadError> {
        let rest = &self.bytes[self.at..];
        match rest.get(..length) {
            Some(taken) => {
                self.at += length;
                Ok(taken)
            }
            None => Err(ReadError::Truncated {
                section: self.section,
                offset: self.offset(),
                found: rest.len() as u64,
                expected: length as u64,
            }),
        }
    }

    pub(crate) fn array<const N: usize>(&mut self) -> Result<[u8; N], ReadError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    pub(crate) fn u16(&mut self) -> Result<u16, ReadError> {
        Ok(u16::from_le_bytes(self.array()?))
    }

    pub(crate) fn u32(&mut self) -> Result<u32, ReadError> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    pub(crate) fn i32(&mut self) -> Result<i32, ReadError> {
        Ok(i32::from_le_bytes(self.array()?))
    }

    pub(crate) fn u64(&mut self) -> Result<u64, ReadError> {
        Ok(u64::from_le_bytes(self.array()?))
    }

    /// A vertex in a square with sides of `side` quanta.
    pub(crate) fn vertex(&mut self, side: u16) -> Result<Vertex, ReadError> {
        let offset = self.offset();
        let vertex = Vertex { x: self.u16()?, y: self.u16()?, z: self.i32()? };
        self.within(offset, "x", i64::from(vertex.x), (0, i64::from(side)))?;
        self.within(offset + 2, "y", i64::from(vertex.y), (0, i64::from(side)))?;
        Ok(vertex)
    }

    /// A number of metres, which must be finite.
    pub(crate) fn metres(&mut self, field: &'static str) -> Result<f64, ReadError> {
        let offset = self.offset();
        let metres = f64::from_le_bytes(self.array()?);
        if metres.is_finite() {
            return Ok(metres);
        }
        Err(ReadError::NotAValue { section: self.section, offset, field, expected: "a finite number" })
    }

    pub(crate) fn text(&mut self, length: u16, field: &'static str) -> Result<String, ReadError> {
        let offset = self.offset();
        let fault = ReadError::NotAValue { section: self.section, offset, field, expected: "UTF-8 text" };
        String::from_utf8(self.take(usize::from(length))?.to_vec()).map_err(|_| fault)
    }

    /// Zeros up to the next multiple of four bytes from the start of the section.
    pub(crate) fn padding(&mut self) -> Result<(), ReadError> {
        while !self.at.is_multiple_of(4) {
            let offset = self.offset();
            let [byte] = self.array()?;
            self.expect(offset, "padding", i64::from(byte), 0)?;
        }
        Ok(())
    }

    /// A `u32` that can have one value only.
    pub(crate) fn expect_u32(&mut self, field: &'static str, expected: u32) -> Result<(), ReadError> {
        let offset = self.offset();
        let found = self.u32()?;
        self.expect(offset, field, i64::from(found), i64::from(expected))
    }

    /// A value read at `offset` that can be `expected` only.
    pub(crate) fn expect(&self, offset: u64, field: &'static str, found: i64, expected: i64) -> Result<(), ReadError> {
        if found == expected {
            return Ok(());
        }
        Err(ReadError::WrongValue { section: self.section, offset, field, found, expected })
    }

    /// A value read at `offset` that must lie between `low` and `high`, both allowed.
    pub(crate) fn within(
        &self,
        offset: u64,
        field: &'static str,
        found: i64,
        (low, high): (i64, i64),
    ) -> Result<(), ReadError> {
        if low <= found && found <= high {
            return Ok(());
        }
        Err(ReadError::OutOfRange { section: self.section, offset, field, found, low, high })
    }

    /// The checksum that ends a section: CRC-32 of all its bytes before.
    pub(crate) fn checksum(&mut self) -> Result<(), ReadError> {
        let (offset, found) = (self.offset(), crc32fast::hash(&self.bytes[..self.at]));
        let expected = self.u32()?;
        if found == expected {
            return Ok(());
        }
        Err(ReadError::WrongChecksum { section: self.section, offset, found, expected })
    }
}

/// Checks the checksum that ends `section`, before any of its values is trusted.
///
/// # Errors
/// When the section is shorter than a checksum or its bytes are not those written.
pub(crate) fn check_section(bytes: &[u8], base: u64, section: Section) -> Result<(), ReadError> {
    let mut cursor = Cursor::new(bytes, base, section);
    cursor.take(bytes.len().saturating_sub(4))?;
    cursor.checksum()
}
