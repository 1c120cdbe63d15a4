//! Writes baseline JPEGs of which each block of 8 x 8 pixels has one colour, that of its north-western pixel.

/// The first coefficient of a block is eight times its brightness, so that divided by this it is that itself.
const STEP: u8 = 8;
/// Sizes that a first coefficient may have, in bits: each is written as a code of four bits.
const SIZES: u8 = 12;

/// Brightness and two hues of red, green and blue (JFIF 1.02).
pub fn brightness_and_hues([red, green, blue]: [u8; 3]) -> Vec<u8> {
    let [red, green, blue] = [red, green, blue].map(f64::from);
    let parts = [
        0.299 * red + 0.587 * green + 0.114 * blue,
        128.0 - 0.168_736 * red - 0.331_264 * green + 0.5 * blue,
        128.0 + 0.5 * red - 0.418_688 * green - 0.081_312 * blue,
    ];
    parts.map(|part| part.round().clamp(0.0, 255.0) as u8).to_vec()
}

/// A file of tables alone, as `JPEGTables` holds it.
pub fn tables() -> Vec<u8> {
    [&[0xff, 0xd8][..], &bare_tables(), &[0xff, 0xd9]].concat()
}

fn bare_tables() -> Vec<u8> {
    let mut first_code_lengths = [0; 16];
    first_code_lengths[3] = SIZES;
    // All other coefficients are 0, which the one code says, of one bit.
    let mut other_code_lengths = [0; 16];
    other_code_lengths[0] = 1;
    [
        segment(0xdb, &[&[0][..], &[STEP; 64]].concat()),
        segment(0xc4, &[&[0x00][..], &first_code_lengths, &(0..SIZES).collect::<Vec<u8>>()].concat()),
        segment(0xc4, &[&[0x10][..], &other_code_lengths, &[0]].concat()),
    ]
    .concat()
}

fn segment(marker: u8, body: &[u8]) -> Vec<u8> {
    [&[0xff, marker][..], &(body.len() as u16 + 2).to_be_bytes(), body].concat()
}

/// A picture of so many parts; all but the first are `subsampling` times coarser each way.
pub fn encoded(
    [cols, rows]: [u32; 2],
    parts: usize,
    subsampling: u32,
    has_tables: bool,
    pixel: impl Fn(u32, u32) -> Vec<u8>,
) -> Vec<u8> {
    let fine = |part: usize| if part == 0 && 1 < parts { subsampling } else { 1 };
    let mut frame = vec![8];
    frame.extend((rows as u16).to_be_bytes());
    frame.extend((cols as u16).to_be_bytes());
    frame.push(parts as u8);
    frame.extend((0..parts).flat_map(|part| [part as u8 + 1, (fine(part) * 17) as u8, 0]));
    let mut scan = vec![parts as u8];
    scan.extend((0..parts).flat_map(|part| [part as u8 + 1, 0]));
    scan.extend([0, 63, 0]);
    let (mut bits, mut last) = (Bits::default(), vec![0; parts]);
    // A unit has the blocks of all parts for the same pixels.
    let side = 8 * fine(0);
    for north in (0..rows).step_by(side as usize) {
        for west in (0..cols).step_by(side as usize) {
            for (part, last) in last.iter_mut().enumerate() {
                for block in 0..fine(part) * fine(part) {
                    let (col, row) = (west + 8 * (block % fine(part)), north + 8 * (block / fine(part)));
                    let level = i32::from(pixel(col.min(cols - 1), row.min(rows - 1))[part]) - 128;
                    bits.put_level(level - *last);
                    *last = level;
                }
            }
        }
    }
    let tables = if has_tables { bare_tables() } else { Vec::new() };
    [vec![0xff, 0xd8], tables, segment(0xc0, &frame), segment(0xda, &scan), bits.bytes(), vec![0xff, 0xd9]].concat()
}

#[derive(Default)]
struct Bits(Vec<bool>);

impl Bits {
    fn put(&mut self, number: u32, count: u32) {
        self.0.extend((0..count).rev().map(|bit| number >> bit & 1 == 1));
    }

    /// A block by how much its first coefficient differs from that of the block before.
    fn put_level(&mut self, step: i32) {
        let size = 32 - step.unsigned_abs().leading_zeros();
        self.put(size, 4);
        let number = if step < 0 { step + (1 << size) - 1 } else { step };
        self.put(number as u32, size);
        self.put(0, 1);
    }

    /// Filled up with ones; after a byte of ones comes an empty one.
    fn bytes(&self) -> Vec<u8> {
        let byte = |bits: &[bool]| (0..8).fold(0, |sum, at| sum << 1 | u8::from(bits.get(at).is_none_or(|bit| *bit)));
        let all = self.0.chunks(8).map(byte);
        all.flat_map(|byte| if byte == 0xff { vec![0xff, 0] } else { vec![byte] }).collect()
    }
}
