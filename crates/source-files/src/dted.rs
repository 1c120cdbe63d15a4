//! DTED, levels 0, 1 and 2: one record per meridian, west to east, each from south to north.
//!
//! Heights are 16 bits, sign and magnitude, most significant byte first. A partial cell holds fewer records than its
//! header counts; each record says which meridian it is, and the others are void.

use terrain::PostRect;

use crate::SourceError;
use crate::chunk::{Chunk, Header};
use crate::crs::Crs;
use crate::directory::SampleKind;
use crate::frame::{Axes, Facts, SampleScale};
use crate::samples::Samples;
use crate::store::Store;

/// What marks a void post.
const VOID: i16 = -32767;
/// Below this no ground on Earth lies: a writer that did not know of sign and magnitude left two's complement.
const LOWEST: i16 = -16000;
/// Bytes of the three headers: user (80), data set (648), accuracy (2700).
const HEADERS: u64 = 80 + 648 + 2700;
const DATA_SET: usize = 80;
const ACCURACY: usize = 80 + 648;
/// Bytes of a record besides its heights: 8 before them, a checksum of 4 behind.
const AROUND: usize = 12;
/// Records decoded at once.
const COLUMNS_PER_CHUNK: u32 = 64;

/// A DTED cell whose headers were read.
#[derive(Clone, Debug)]
pub(crate) struct Dted {
    store: Store,
    cols: u32,
    rows: u32,
    /// Where each record begins; `None` for a meridian that a partial cell leaves out.
    records: Vec<Option<u64>>,
    strict: bool,
}

/// Where the user header begins, behind the labels of a tape: their 80 bytes come first in some files.
pub(crate) fn start(bytes: &[u8]) -> Option<u64> {
    [0, 80, 160]
        .into_iter()
        .find(|&at| bytes.get(at..).is_some_and(|rest| rest.starts_with(b"UHL1")))
        .map(|at| at as u64)
}

/// What the headers say.
pub(crate) struct Opened {
    pub reader: Dted,
    pub axes: Axes,
    pub facts: Facts,
    pub crs: Result<Crs, String>,
}

impl Dted {
    pub(crate) fn open(store: &Store, start: u64, strict: bool) -> Result<Opened, SourceError> {
        store.holds("the headers", start + HEADERS)?;
        let bytes = store.bytes_at(&mut store.handle()?, start, HEADERS as usize)?;
        let header = HeaderText { store, bytes: &bytes };
        let (cols, rows) = (header.count(47..51, "meridians")?, header.count(51..55, "posts of a meridian")?);
        let step = [header.interval(20..24)?, header.interval(24..28)?];
        let first = [header.angle(4..12)?, header.angle(12..20)?];
        let mut reader = Dted { store: store.clone(), cols, rows, records: Vec::new(), strict };
        reader.find_records(start + HEADERS)?;
        let found = header.text(DATA_SET + 144..DATA_SET + 149);
        let crs = match found.as_str() {
            "WGS84" | "" => Ok(Crs::wgs84()),
            _ => Err(format!("on datum {found}, as DTED is only before 1990")),
        };
        let accuracy_m = header.text(ACCURACY + 7..ACCURACY + 11).parse().ok();
        let vertical_datum = match header.text(DATA_SET + 141..DATA_SET + 144).as_str() {
            "E96" => Some("EGM96".into()),
            "E08" => Some("EGM2008".into()),
            _ => None,
        };
        let facts = Facts { format: "DTED", accuracy_m, vertical_datum };
        Ok(Opened { reader, axes: Axes { first, step }, facts, crs })
    }

    fn record_bytes(&self) -> usize {
        AROUND + 2 * self.rows as usize
    }

    fn find_records(&mut self, start: u64) -> Result<(), SourceError> {
        let (size, cols) = (self.record_bytes() as u64, u64::from(self.cols));
        let room = self.store.len() - start;
        if cols * size <= room {
            self.records = (0..cols).map(|col| Some(start + col * size)).collect();
            return Ok(());
        }
        if !room.is_multiple_of(size) || room == 0 {
            return self.store.holds("the records of all meridians", start + cols * size);
        }
        self.records = vec![None; cols as usize];
        let mut handle = self.store.handle()?;
        for at in (start..start + room).step_by(size as usize) {
            let head = self.store.bytes_at(&mut handle, at, 8)?;
            let col = usize::from(u16::from_be_bytes([head[4], head[5]]));
            let place = self.records.get_mut(col).filter(|place| head[0] == 0xaa && place.is_none());
            let found = || format!("the record of meridian {col} at byte {at}");
            *place.ok_or_else(|| self.store.malformed("a partial cell", found(), "each meridian at most once"))? =
                Some(at);
        }
        Ok(())
    }

    pub(crate) fn header(&self, frame: crate::RasterFrame) -> Header {
        Header { frame, scale: SampleScale::METRES, kind: SampleKind::I16, nodata: Some(VOID.into()), shift: None }
    }

    pub(crate) fn size(&self) -> (u32, u32) {
        (self.cols, self.rows)
    }

    /// The chunks that hold some columns.
    pub(crate) fn chunks_of(&self, west: i32, east: i32) -> std::ops::RangeInclusive<u32> {
        west as u32 / COLUMNS_PER_CHUNK..=east as u32 / COLUMNS_PER_CHUNK
    }

    pub(crate) fn posts_of(&self, chunk: u32) -> PostRect {
        let west = chunk * COLUMNS_PER_CHUNK;
        let east = (west + COLUMNS_PER_CHUNK).min(self.cols) - 1;
        PostRect { south: 0, west: west as i32, north: self.rows as i32 - 1, east: east as i32 }
    }

    pub(crate) fn decode(&self, chunk: u32) -> Result<Chunk, SourceError> {
        let posts = self.posts_of(chunk);
        let wide = posts.posts_wide();
        let mut handle = self.store.handle()?;
        let mut heights = vec![VOID; posts.post_count()];
        let mut notes = Vec::new();
        for (place, col) in (posts.west..=posts.east).enumerate() {
            let Some(at) = self.records[col as usize] else { continue };
            let record = self.store.bytes_at(&mut handle, at, self.record_bytes())?;
            notes.extend(self.check(&record, col)?);
            let (mut complement, samples) = (0, &record[8..record.len() - 4]);
            for (row, bytes) in samples.chunks_exact(2).enumerate() {
                let (height, is_complement) = height([bytes[0], bytes[1]]);
                complement += usize::from(is_complement);
                heights[row * wide + place] = height;
            }
            if 0 < complement {
                let path = self.store.path().display();
                notes.push(format!("{path}: {complement} posts of column {col} are taken for two's complement"));
            }
        }
        Ok(Chunk { posts, stride: wide, south_first: true, samples: Some(Samples::I16(heights)), notes })
    }

    /// What is wrong with a record but need not keep its heights from being used.
    fn check(&self, record: &[u8], col: i32) -> Result<Option<String>, SourceError> {
        let path = self.store.path();
        if record[0] != 0xaa {
            let found = format!("{:#04x}", record[0]);
            return Err(self.store.malformed(&format!("the mark of the record of column {col}"), found, "0xaa"));
        }
        let (summed, stated) = record.split_at(record.len() - 4);
        let expected: u32 = summed.iter().map(|&byte| u32::from(byte)).sum();
        let found = u32::from_be_bytes(stated.try_into().expect("four bytes were split off"));
        match (expected == found, self.strict) {
            (true, _) => Ok(None),
            (false, true) => Err(SourceError::Checksum { path: path.into(), column: col, found, expected }),
            (false, false) => {
                let path = path.display();
                Ok(Some(format!("{path}: the checksum of column {col} is {found}, its bytes add up to {expected}")))
            }
        }
    }
}

/// A height, and whether it had to be read as two's complement.
fn height(bytes: [u8; 2]) -> (i16, bool) {
    let bits = u16::from_be_bytes(bytes);
    let magnitude = (bits & 0x7fff) as i16;
    let height = if bits & 0x8000 == 0 { magnitude } else { -magnitude };
    if height < LOWEST && height != VOID { (bits as i16, true) } else { (height, false) }
}

/// The headers as text.
struct HeaderText<'a> {
    store: &'a Store,
    bytes: &'a [u8],
}

impl HeaderText<'_> {
    fn text(&self, range: std::ops::Range<usize>) -> String {
        String::from_utf8_lossy(&self.bytes[range]).trim().to_owned()
    }

    fn malformed(&self, what: &str, range: std::ops::Range<usize>, expected: &str) -> SourceError {
        self.store.malformed(&format!("the header's {what}"), format!("`{}`", self.text(range)), expected)
    }

    fn count(&self, range: std::ops::Range<usize>, what: &str) -> Result<u32, SourceError> {
        let count = self.text(range.clone()).parse().ok().filter(|&count| 2 <= count);
        count.ok_or_else(|| self.malformed(&format!("number of {what}"), range, "a number of 2 or more"))
    }

    /// Tenths of a second, as degrees.
    fn interval(&self, range: std::ops::Range<usize>) -> Result<f64, SourceError> {
        let tenths: Option<u32> = self.text(range.clone()).parse().ok().filter(|&tenths| 0 < tenths);
        let tenths = tenths.ok_or_else(|| self.malformed("interval", range, "tenths of a second"))?;
        Ok(f64::from(tenths) / 36_000.0)
    }

    /// `DDDMMSSH` as degrees, south and west negative.
    fn angle(&self, range: std::ops::Range<usize>) -> Result<f64, SourceError> {
        let text = self.text(range.clone());
        let parsed = text.is_ascii().then_some(()).and_then(|()| {
            let (digits, side) = text.split_at_checked(text.len().checked_sub(1)?)?;
            let (degrees, rest) = digits.split_at_checked(digits.len().checked_sub(4)?)?;
            let numbers = [degrees, &rest[..2], &rest[2..]].map(|part| part.parse::<u32>().ok());
            let [Some(degrees), Some(minutes), Some(seconds)] = numbers else { return None };
            let seconds = f64::from(minutes * 60 + seconds);
            let angle = f64::from(degrees) + seconds / 3600.0;
            match side {
                "N" | "E" => Some(angle),
                "S" | "W" => Some(-angle),
                _ => None,
            }
        });
        parsed
            .filter(|angle| angle.abs() <= 360.0)
            .ok_or_else(|| self.malformed("origin", range, "degrees, minutes, seconds and a side, as 1210000W"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heights_are_sign_and_magnitude_unless_no_ground_lies_so_low() {
        assert_eq!(height([0x00, 0x05]), (5, false));
        assert_eq!(height([0x80, 0x05]), (-5, false));
        assert_eq!(height([0xff, 0xff]), (VOID, false));
        assert_eq!(height([0xff, 0xfb]), (-5, true));
    }
}
