//! The order of bytes in a Cloud Optimized GeoTIFF: header, all directories from the finest image to the coarsest, then
//! the blocks from the coarsest image to the finest; a reader over a network learns all it needs from the first bytes.
//!
//! The encoder of `tiff` writes what a directory holds before the directory, which leaves the first one too far behind,
//! so directories are written here. Whether offsets have 32 or 64 bits follows from the length of the file.

use std::io::{Result, Write};

/// Numbers of tags.
pub(crate) mod tag {
    pub(crate) const SUBFILE_TYPE: u16 = 254;
    pub(crate) const WIDTH: u16 = 256;
    pub(crate) const LENGTH: u16 = 257;
    pub(crate) const BITS_PER_SAMPLE: u16 = 258;
    pub(crate) const COMPRESSION: u16 = 259;
    pub(crate) const PHOTOMETRIC: u16 = 262;
    pub(crate) const SAMPLES_PER_PIXEL: u16 = 277;
    pub(crate) const PLANAR_CONFIGURATION: u16 = 284;
    pub(crate) const PREDICTOR: u16 = 317;
    pub(crate) const TILE_WIDTH: u16 = 322;
    pub(crate) const TILE_LENGTH: u16 = 323;
    pub(crate) const TILE_OFFSETS: u16 = 324;
    pub(crate) const TILE_BYTE_COUNTS: u16 = 325;
    pub(crate) const SAMPLE_FORMAT: u16 = 339;
    pub(crate) const PIXEL_SCALE: u16 = 33550;
    pub(crate) const TIEPOINT: u16 = 33922;
    pub(crate) const GEO_KEYS: u16 = 34735;
    pub(crate) const GDAL_METADATA: u16 = 42112;
    pub(crate) const GDAL_NODATA: u16 = 42113;
}

/// What a tag says.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    Ascii(String),
    Shorts(Vec<u16>),
    Longs(Vec<u32>),
    Doubles(Vec<f64>),
    /// Places in the file, in as many bits as the file has for them.
    Offsets(Vec<u64>),
}

/// An image of the file: its tags but for those about blocks, and its compressed blocks, row by row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Image {
    pub tags: Vec<(u16, Value)>,
    pub blocks: Vec<Vec<u8>>,
}

/// What follows the header, where GDAL looks for it: each block stands after its length, and its last bytes come twice,
/// so that a reader knows of each block where it ends and whether it was changed. The number is the length of the rest.
const STRUCTURE: &str = "GDAL_STRUCTURAL_METADATA_SIZE=000140 bytes\n\
    LAYOUT=IFDS_BEFORE_DATA\nBLOCK_ORDER=ROW_MAJOR\nBLOCK_LEADER=SIZE_AS_UINT4\n\
    BLOCK_TRAILER=LAST_4_BYTES_REPEATED\nKNOWN_INCOMPATIBLE_EDITION=NO\n ";
/// Bytes of a block's length, and of its repeated end.
const LEADER: u64 = 4;
const TRAILER: u64 = 4;

/// How many bytes counts and offsets have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Ordinary,
    Big,
}

/// Writes a file of images, the finest first.
///
/// # Errors
/// Those of `out`.
pub(crate) fn write(out: &mut impl Write, images: &[Image]) -> Result<()> {
    let ordinary = Layout::of(Kind::Ordinary, images);
    match ordinary.length <= u64::from(u32::MAX) {
        true => ordinary.write(out, images),
        false => Layout::of(Kind::Big, images).write(out, images),
    }
}

/// Where everything lies.
struct Layout {
    kind: Kind,
    /// Place of each image's directory.
    directories: Vec<u64>,
    /// Places of each image's blocks.
    blocks: Vec<Vec<u64>>,
    length: u64,
}

impl Layout {
    fn of(kind: Kind, images: &[Image]) -> Self {
        let mut at = (kind.header_bytes() + STRUCTURE.len() as u64).next_multiple_of(8);
        let mut directories = Vec::with_capacity(images.len());
        for image in images {
            directories.push(at);
            let unplaced = vec![0; image.blocks.len()];
            at = (at + kind.directory(image, &unplaced, at, 0).len() as u64).next_multiple_of(8);
        }
        let mut blocks = vec![Vec::new(); images.len()];
        for (places, image) in blocks.iter_mut().zip(images).rev() {
            for block in &image.blocks {
                places.push(at + LEADER);
                at += LEADER + block.len() as u64 + TRAILER;
            }
        }
        Self { kind, directories, blocks, length: at }
    }

    fn write(&self, out: &mut impl Write, images: &[Image]) -> Result<()> {
        let mut head = self.kind.header(self.directories[0]);
        head.extend_from_slice(STRUCTURE.as_bytes());
        for (index, image) in images.iter().enumerate() {
            let next = self.directories.get(index + 1).copied().unwrap_or(0);
            head.resize(self.directories[index] as usize, 0);
            head.extend(self.kind.directory(image, &self.blocks[index], self.directories[index], next));
        }
        head.resize(head.len().next_multiple_of(8), 0);
        out.write_all(&head)?;
        for block in images.iter().rev().flat_map(|image| &image.blocks) {
            let end = block.last_chunk::<4>().expect("a deflated block has a header and a checksum");
            out.write_all(&(block.len() as u32).to_le_bytes())?;
            out.write_all(block)?;
            out.write_all(end)?;
        }
        Ok(())
    }
}

impl Kind {
    fn header_bytes(self) -> u64 {
        match self {
            Kind::Ordinary => 8,
            Kind::Big => 16,
        }
    }

    /// Bytes of a value that stand in the entry itself, and of an offset.
    fn offset_bytes(self) -> usize {
        match self {
            Kind::Ordinary => 4,
            Kind::Big => 8,
        }
    }

    fn put_offset(self, bytes: &mut Vec<u8>, offset: u64) {
        bytes.extend_from_slice(&offset.to_le_bytes()[..self.offset_bytes()]);
    }

    fn header(self, first_directory: u64) -> Vec<u8> {
        let mut bytes = match self {
            Kind::Ordinary => b"II\x2a\0".to_vec(),
            Kind::Big => b"II\x2b\0\x08\0\0\0".to_vec(),
        };
        self.put_offset(&mut bytes, first_directory);
        bytes
    }

    /// The directory of an image, and behind it the values that have no room in an entry.
    fn directory(self, image: &Image, blocks: &[u64], at: u64, next: u64) -> Vec<u8> {
        let sizes = image.blocks.iter().map(|block| block.len() as u32).collect();
        let mut tags = image.tags.clone();
        tags.push((tag::TILE_OFFSETS, Value::Offsets(blocks.to_vec())));
        tags.push((tag::TILE_BYTE_COUNTS, Value::Longs(sizes)));
        tags.sort_by_key(|(tag, _)| *tag);
        let (count_bytes, room) = (if self == Kind::Big { 8 } else { 2 }, self.offset_bytes());
        let values_at = at + (count_bytes + tags.len() * (4 + 2 * room) + room) as u64;
        let (mut entries, mut values) = (Vec::new(), Vec::new());
        entries.extend_from_slice(&(tags.len() as u64).to_le_bytes()[..count_bytes]);
        for (tag, value) in &tags {
            let (code, count, mut bytes) = self.encoded(value);
            entries.extend_from_slice(&tag.to_le_bytes());
            entries.extend_from_slice(&code.to_le_bytes());
            self.put_offset(&mut entries, count);
            if bytes.len() <= room {
                bytes.resize(room, 0);
                entries.extend_from_slice(&bytes);
            } else {
                self.put_offset(&mut entries, values_at + values.len() as u64);
                values.extend_from_slice(&bytes);
                values.resize(values.len().next_multiple_of(8), 0);
            }
        }
        self.put_offset(&mut entries, next);
        entries.append(&mut values);
        entries
    }

    /// The code of a value's type, how many of these it is, and its bytes.
    fn encoded(self, value: &Value) -> (u16, u64, Vec<u8>) {
        match value {
            Value::Ascii(text) => (2, text.len() as u64 + 1, [text.as_bytes(), b"\0"].concat()),
            Value::Shorts(numbers) => (3, numbers.len() as u64, numbers.iter().flat_map(|n| n.to_le_bytes()).collect()),
            Value::Longs(numbers) => (4, numbers.len() as u64, numbers.iter().flat_map(|n| n.to_le_bytes()).collect()),
            Value::Doubles(numbers) => {
                (12, numbers.len() as u64, numbers.iter().flat_map(|n| n.to_le_bytes()).collect())
            }
            Value::Offsets(numbers) => {
                let mut bytes = Vec::with_capacity(numbers.len() * self.offset_bytes());
                numbers.iter().for_each(|&number| self.put_offset(&mut bytes, number));
                (if self == Kind::Big { 16 } else { 4 }, numbers.len() as u64, bytes)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use tiff::decoder::Decoder;
    use tiff::tags::Tag;

    use super::*;

    /// An image of one block of 16 x 16 bytes for each value, side by side.
    fn image(values: &[u8]) -> Image {
        let tags = vec![
            (tag::WIDTH, Value::Longs(vec![16 * values.len() as u32])),
            (tag::LENGTH, Value::Longs(vec![16])),
            (tag::BITS_PER_SAMPLE, Value::Shorts(vec![8])),
            (tag::COMPRESSION, Value::Shorts(vec![1])),
            (tag::PHOTOMETRIC, Value::Shorts(vec![1])),
            (tag::SAMPLES_PER_PIXEL, Value::Shorts(vec![1])),
            (tag::TILE_WIDTH, Value::Longs(vec![16])),
            (tag::TILE_LENGTH, Value::Longs(vec![16])),
            (tag::GDAL_METADATA, Value::Ascii("longer than an entry has room for".into())),
        ];
        Image { tags, blocks: values.iter().map(|&value| vec![value; 256]).collect() }
    }

    #[test]
    fn directories_come_fine_to_coarse_and_blocks_coarse_to_fine_with_offsets_of_either_length() {
        let images = [image(&[1, 2, 3]), image(&[4, 5]), image(&[6])];
        for kind in [Kind::Ordinary, Kind::Big] {
            let layout = Layout::of(kind, &images);
            let mut bytes = Vec::new();
            layout.write(&mut bytes, &images).unwrap();
            assert_eq!(bytes.len() as u64, layout.length);
            assert!(layout.directories[0] < 300 && layout.directories.is_sorted());
            assert!(layout.directories[2] < layout.blocks[2][0]);
            assert!(layout.blocks[2][0] < layout.blocks[1][0] && layout.blocks[1][1] < layout.blocks[0][0]);
            for &at in layout.blocks.iter().flatten() {
                let at = at as usize;
                assert_eq!(bytes[at - 4..at], 256_u32.to_le_bytes());
                assert_eq!(bytes[at + 256..at + 260], bytes[at + 252..at + 256]);
            }
            let mut decoder = Decoder::new(Cursor::new(bytes)).unwrap();
            for (index, image) in images.iter().enumerate() {
                assert_eq!(decoder.dimensions().unwrap(), (16 * image.blocks.len() as u32, 16));
                let said = decoder.get_tag_ascii_string(Tag::Unknown(tag::GDAL_METADATA)).unwrap();
                assert_eq!(said, "longer than an entry has room for");
                for (place, block) in image.blocks.iter().enumerate() {
                    let chunk = decoder.read_chunk(place as u32).unwrap();
                    let tiff::decoder::DecodingResult::U8(chunk) = chunk else { panic!("bytes were written") };
                    assert_eq!(chunk, *block);
                }
                assert_eq!(decoder.more_images(), index < 2);
                if index < 2 {
                    decoder.next_image().unwrap();
                }
            }
        }
    }

    #[test]
    fn the_note_on_the_order_of_bytes_is_as_long_as_it_says() {
        let (first, rest) = STRUCTURE.split_once('\n').unwrap();
        assert_eq!(first, format!("GDAL_STRUCTURAL_METADATA_SIZE={:06} bytes", rest.len()));
    }
}
