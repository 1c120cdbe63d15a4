//! Records of OpenFlight 16.1: big-endian, each with its opcode and its length first.

/// Format revision level: 16.1.
const REVISION: i32 = 1610;
/// Bytes of a palette's own record, before its first vertex.
pub(crate) const PALETTE_BYTES: usize = 8;
/// Bytes of a vertex with colour and normal, and of one with a place in a texture, too.
const VERTEX_BYTES: [usize; 2] = [56, 64];
/// Bytes of the longest record: its length has 16 bits.
const RECORD_BYTES_MAX: usize = 65_532;

mod opcode {
    pub const HEADER: u16 = 1;
    pub const GROUP: u16 = 2;
    pub const OBJECT: u16 = 4;
    pub const FACE: u16 = 5;
    pub const PUSH: u16 = 10;
    pub const POP: u16 = 11;
    pub const COMMENT: u16 = 31;
    pub const LONG_ID: u16 = 33;
    pub const UV_LIST: u16 = 53;
    pub const EXTERNAL: u16 = 63;
    pub const TEXTURE: u16 = 64;
    pub const VERTEX_PALETTE: u16 = 67;
    pub const VERTEX_NORMAL: u16 = 69;
    pub const VERTEX_NORMAL_UV: u16 = 70;
    pub const VERTEX_LIST: u16 = 72;
    pub const LEVEL: u16 = 73;
    pub const MATERIAL: u16 = 113;
}

/// A file in the making.
#[derive(Clone, Debug, Default)]
pub(crate) struct Records {
    bytes: Vec<u8>,
    /// Whether vertices of the palette have places in a texture.
    has_places: bool,
}

/// A vertex of the palette.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FltVertex {
    pub place: [f64; 3],
    pub normal: [f64; 3],
    /// Its place in the texture, from the south-western corner, where there is one.
    pub uv: Option<[f32; 2]>,
}

/// What the header says of the place.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Place {
    /// East and north, in metres, to add to coordinates of the file.
    pub offset_m: [f64; 2],
    /// South-west and north-east corner, longitude first.
    pub corners: [[f64; 2]; 2],
    /// Zone of UTM, negative in the south; `None` for another projection.
    pub utm_zone: Option<i16>,
    /// Radius of the content around its middle, in metres.
    pub radius_m: f64,
}

/// How a face is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Face {
    /// Surface material code, and feature identification.
    pub codes: [i16; 2],
    /// Its place in the palette of materials.
    pub material: i16,
    pub color: [u8; 3],
    /// Whether it is drawn from both sides.
    pub is_seen_from_below: bool,
    /// Whether vehicles stand on it: ground, ways and decks.
    pub is_terrain: bool,
    /// Whether it is seen with the texture of the file.
    pub has_texture: bool,
}

impl Records {
    /// The bytes so far.
    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    fn open(&mut self, opcode: u16, length: usize) {
        let length = u16::try_from(length).expect("records are written shorter than 64 kB");
        self.put(&opcode.to_be_bytes());
        self.put(&length.to_be_bytes());
    }

    fn put(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    fn i16s(&mut self, numbers: &[i16]) {
        numbers.iter().for_each(|number| self.bytes.extend_from_slice(&number.to_be_bytes()));
    }

    fn i32s(&mut self, numbers: &[i32]) {
        numbers.iter().for_each(|number| self.bytes.extend_from_slice(&number.to_be_bytes()));
    }

    fn u32s(&mut self, numbers: &[u32]) {
        numbers.iter().for_each(|number| self.bytes.extend_from_slice(&number.to_be_bytes()));
    }

    fn f64s(&mut self, numbers: &[f64]) {
        numbers.iter().for_each(|number| self.bytes.extend_from_slice(&number.to_be_bytes()));
    }

    fn zeros(&mut self, count: usize) {
        self.bytes.resize(self.bytes.len() + count, 0);
    }

    /// A text in a field of `length` bytes, cut to leave a zero at its end.
    fn text(&mut self, text: &str, length: usize) {
        let fits = text.len().min(length - 1);
        self.put(&text.as_bytes()[..fits]);
        self.zeros(length - fits);
    }

    /// The first record of a file.
    pub(crate) fn header(&mut self, place: &Place) {
        const METRES: u8 = 0;
        const SAVE_NORMALS: u32 = 0x8000_0000;
        const FLAT_EARTH: i32 = 0;
        const UTM: i32 = 4;
        const DOUBLES: i16 = 1;
        const OPEN_FLIGHT: i32 = 100;
        self.open(opcode::HEADER, 324);
        self.text("db", 8);
        self.i32s(&[REVISION, 0]);
        // No date: the same database gives the same file.
        self.zeros(32);
        self.i16s(&[1, 1, 1, 1, 1]);
        self.put(&[METRES, 0]);
        self.u32s(&[SAVE_NORMALS]);
        self.zeros(24);
        self.i32s(&[if place.utm_zone.is_some() { UTM } else { FLAT_EARTH }]);
        self.zeros(28);
        self.i16s(&[1, DOUBLES]);
        self.i32s(&[OPEN_FLIGHT]);
        self.f64s(&[place.offset_m[0], place.offset_m[1], place.offset_m[0], place.offset_m[1]]);
        self.i16s(&[1, 1]);
        self.zeros(8);
        self.i16s(&[1, 1, 1, 1]);
        self.zeros(4);
        let [[west, south], [east, north]] = place.corners;
        let middle = [(south + north) / 2.0, (west + east) / 2.0];
        self.f64s(&[south, west, north, east, middle[0], middle[1], 0.0, 0.0]);
        self.i16s(&[1, 1, 1, 1]);
        self.zeros(8);
        // The ellipsoid of WGS 84.
        self.i32s(&[0]);
        self.i16s(&[1, 1, place.utm_zone.unwrap_or(0)]);
        self.zeros(6);
        self.f64s(&[0.0, place.radius_m]);
        self.i16s(&[1, 1]);
        self.zeros(4);
        self.f64s(&[6_378_137.0, 6_356_752.314_245_179]);
    }

    /// A text about the record before.
    pub(crate) fn comment(&mut self, text: &str) {
        let text: String = text.chars().filter(char::is_ascii).take(RECORD_BYTES_MAX - 8).collect();
        let length = (text.len() + 1).next_multiple_of(4);
        self.open(opcode::COMMENT, 4 + length);
        self.text(&text, length);
    }

    pub(crate) fn push(&mut self) {
        self.open(opcode::PUSH, 4);
    }

    pub(crate) fn pop(&mut self) {
        self.open(opcode::POP, 4);
    }

    /// A node that holds others.
    pub(crate) fn group(&mut self, name: &str) {
        self.open(opcode::GROUP, 44);
        self.text(name, 8);
        self.zeros(32);
        self.long_id(name);
    }

    /// A node that holds faces.
    pub(crate) fn object(&mut self, name: &str) {
        self.open(opcode::OBJECT, 28);
        self.text(name, 8);
        self.zeros(16);
        self.long_id(name);
    }

    /// A node that is shown from one distance of a place to another, in metres.
    pub(crate) fn level(&mut self, name: &str, [near_m, far_m]: [f64; 2], middle: [f64; 3]) {
        const FREEZE_CENTER: u32 = 0x2000_0000;
        self.open(opcode::LEVEL, 80);
        self.text(name, 8);
        self.zeros(4);
        // Switched in when the eye comes as near as the first, out when it comes nearer than the second.
        self.f64s(&[far_m, near_m]);
        self.i16s(&[0, 0]);
        self.u32s(&[FREEZE_CENTER]);
        self.f64s(&middle);
        // One at a time, and no size that tells.
        self.f64s(&[0.0, 0.0]);
    }

    /// The name of the node before, where it is longer than seven bytes.
    fn long_id(&mut self, name: &str) {
        if 7 < name.len() {
            let length = (name.len() + 1).next_multiple_of(4);
            self.open(opcode::LONG_ID, 4 + length);
            self.text(name, length);
        }
    }

    /// The only texture, by its path from this file.
    pub(crate) fn texture(&mut self, path: &str) {
        self.open(opcode::TEXTURE, 216);
        self.text(path, 200);
        // Its index, and where it is shown in an editor's palette.
        self.i32s(&[0, 0, 0]);
    }

    /// The palette of all vertices; all of them have a place in the texture, or none.
    pub(crate) fn vertices(&mut self, vertices: &[FltVertex]) {
        const PACKED_COLOUR: i16 = 0x1000;
        self.has_places = vertices.first().is_some_and(|vertex| vertex.uv.is_some());
        let opcode = if self.has_places { opcode::VERTEX_NORMAL_UV } else { opcode::VERTEX_NORMAL };
        self.open(opcode::VERTEX_PALETTE, PALETTE_BYTES);
        self.u32s(&[(PALETTE_BYTES + vertices.len() * self.vertex_bytes()) as u32]);
        for FltVertex { place, normal, uv } in vertices {
            self.open(opcode, self.vertex_bytes());
            self.i16s(&[0, PACKED_COLOUR]);
            self.f64s(place);
            normal.iter().for_each(|part| self.bytes.extend_from_slice(&(*part as f32).to_be_bytes()));
            uv.iter().flatten().for_each(|part| self.bytes.extend_from_slice(&part.to_be_bytes()));
            self.u32s(&[u32::MAX, 0, 0]);
        }
    }

    fn vertex_bytes(&self) -> usize {
        VERTEX_BYTES[usize::from(self.has_places)]
    }

    /// A material of the palette by its name: white, so that faces keep their colours, and dull.
    pub(crate) fn material(&mut self, index: i32, name: &str) {
        const IS_USED: u32 = 0x8000_0000;
        let floats = |records: &mut Self, numbers: &[f32]| {
            numbers.iter().for_each(|number| records.put(&number.to_be_bytes()));
        };
        self.open(opcode::MATERIAL, 84);
        self.i32s(&[index]);
        self.text(name, 12);
        self.u32s(&[IS_USED]);
        floats(self, &[1.0; 6]);
        // Nothing shines: no highlight, no light of its own, all opaque.
        floats(self, &[0.0; 7]);
        floats(self, &[1.0]);
        self.zeros(4);
    }

    /// A triangle over vertices of the palette; `lane` has places of its corners
    /// across and along a way, for a texture of the first layer above that of the file.
    pub(crate) fn face(&mut self, triangle: [u32; 3], face: Face, lane: Option<[[f32; 2]; 3]>) {
        const FIRST_LAYER: u32 = 0x8000_0000;
        const TERRAIN: u32 = 0x8000_0000;
        const PACKED_COLOUR: u32 = 0x2000_0000 | 0x1000_0000;
        const FACE_COLOUR_WITH_NORMALS: u8 = 2;
        let [red, green, blue] = face.color.map(u32::from);
        self.open(opcode::FACE, 80);
        self.zeros(8 + 4 + 2);
        self.put(&[u8::from(face.is_seen_from_below), 0]);
        self.zeros(4 + 2);
        let [surface, feature] = face.codes;
        // No texture of details.
        self.i16s(&[-1, i16::from(face.has_texture) - 1, face.material, surface, feature]);
        self.zeros(4 + 2 + 2);
        self.u32s(&[PACKED_COLOUR | if face.is_terrain { TERRAIN } else { 0 }]);
        self.put(&[FACE_COLOUR_WITH_NORMALS]);
        self.zeros(7);
        self.u32s(&[0xff00_0000 | blue << 16 | green << 8 | red, 0]);
        self.i16s(&[-1, 0]);
        self.u32s(&[u32::MAX, u32::MAX]);
        self.i16s(&[0, -1]);
        self.push();
        self.open(opcode::VERTEX_LIST, 16);
        let bytes = self.vertex_bytes();
        self.u32s(&triangle.map(|v| (PALETTE_BYTES + v as usize * bytes) as u32));
        if let Some(places) = lane {
            self.open(opcode::UV_LIST, 32);
            self.u32s(&[FIRST_LAYER]);
            places.as_flattened().iter().for_each(|part| self.put(&part.to_be_bytes()));
        }
        self.pop();
    }

    /// A reference to another file, by its path from this one.
    pub(crate) fn external(&mut self, path: &str) {
        self.open(opcode::EXTERNAL, 216);
        self.text(path, 200);
        self.zeros(4);
        // Nothing is overridden.
        self.u32s(&[0]);
        self.i16s(&[0, 0]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Opcode and length of each record.
    fn records(bytes: &[u8]) -> Vec<(u16, usize)> {
        let (mut at, mut found) = (0, Vec::new());
        while at < bytes.len() {
            let word = |at: usize| u16::from_be_bytes([bytes[at], bytes[at + 1]]);
            found.push((word(at), usize::from(word(at + 2))));
            at += found[found.len() - 1].1;
        }
        assert_eq!(at, bytes.len());
        found
    }

    #[test]
    fn every_record_is_as_long_as_it_says() {
        let mut all = Records::default();
        let corners = [[-117.0, 35.0], [-116.9, 35.1]];
        all.header(&Place { offset_m: [5.0e5, 3.9e6], corners, utm_zone: Some(11), radius_m: 2828.0 });
        assert_eq!(all.bytes.len(), 324);
        all.comment("abc");
        all.material(0, "building_wall");
        all.vertices(&[FltVertex { place: [0.0; 3], normal: [0.0, 0.0, 1.0], uv: None }; 3]);
        all.push();
        all.group("a");
        all.object("r0001c0002");
        let face = Face {
            codes: [3, 0],
            material: 0,
            color: [1, 2, 3],
            is_seen_from_below: true,
            is_terrain: true,
            has_texture: false,
        };
        all.level("lod1", [2000.0, 9000.0], [500.0, 250.0, 1000.0]);
        all.face([0, 1, 2], face, Some([[0.0, 0.0], [1.0, 0.0], [1.0, 7.0]]));
        all.external("squares/r00c00.flt");
        all.pop();
        let expected = [
            (1, 324),
            (31, 8),
            (113, 84),
            (67, 8),
            (69, 56),
            (69, 56),
            (69, 56),
            (10, 4),
            (2, 44),
            (4, 28),
            (33, 16),
            (73, 80),
            (5, 80),
            (10, 4),
            (72, 16),
            (53, 32),
            (11, 4),
            (63, 216),
            (11, 4),
        ];
        assert_eq!(records(&all.into_bytes()), expected);
    }

    #[test]
    fn vertices_with_places_in_a_texture_are_longer_and_faces_find_them() {
        let mut all = Records::default();
        all.texture("r00c00.jpg");
        all.vertices(&[FltVertex { place: [0.0; 3], normal: [0.0, 0.0, 1.0], uv: Some([0.25, 0.5]) }; 3]);
        all.face(
            [0, 1, 2],
            Face {
                codes: [3, 0],
                material: 0,
                color: [255; 3],
                is_seen_from_below: false,
                is_terrain: true,
                has_texture: true,
            },
            None,
        );
        let found = records(&all.bytes);
        assert_eq!(found[..5], [(64, 216), (67, 8), (70, 64), (70, 64), (70, 64)]);
        assert_eq!(all.bytes[224 + 44..][..8], [0.25_f32.to_be_bytes(), 0.5_f32.to_be_bytes()].concat());
        let list = all.bytes.len() - 4 - 12;
        assert_eq!(all.bytes[list + 8..][..4], (8_u32 + 128).to_be_bytes());
    }
}
