//! What stands on the ground: buildings, towers and walls as prisms, woods and rows of trees as canopies. A part of a
//! load module in a file of version 3, decoded, checked, and written.

use std::fmt;

use crate::bytes::Cursor;
use crate::{CANOPY_BYTES, FIXED_OBJECTS_BYTES, PRISM_BYTES, ReadError, Section};

/// What an object is.
#[repr(u8)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ObjectKind {
    /// A building, or a part of one.
    Building,
    /// A tower, chimney, silo or the like.
    Tower,
    /// A stretch of a wall.
    Wall,
    /// A wood.
    Wood,
    /// Scrub.
    Scrub,
    /// An orchard or vineyard.
    Orchard,
    /// A stretch of a hedge or of a row of trees.
    Row,
}

impl ObjectKind {
    /// All of them, by their numbers in a file.
    pub const ALL: [Self; 7] =
        [Self::Building, Self::Tower, Self::Wall, Self::Wood, Self::Scrub, Self::Orchard, Self::Row];

    /// Whether objects of this kind are [`Prism`]s; others are [`Canopy`]s.
    pub const fn is_prism(self) -> bool {
        matches!(self, Self::Building | Self::Tower | Self::Wall)
    }

    /// The word for it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Building => "building",
            Self::Tower => "tower",
            Self::Wall => "wall",
            Self::Wood => "wood",
            Self::Scrub => "scrub",
            Self::Orchard => "orchard",
            Self::Row => "row",
        }
    }
}

impl fmt::Display for ObjectKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A corner of a roofline, in quanta from the load module's south-west corner.
// Laid out as C has it, for `load-module-reader-c`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Corner {
    /// East.
    pub x: u16,
    /// North.
    pub y: u16,
    /// Whether a wall runs from here to the next corner: none where the object goes on in the next load module.
    pub has_wall: bool,
}

/// A body with a level roof and upright walls, or the piece of one in the square of one load module.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Prism {
    /// Of all pieces of one object, and of no other object of the area.
    pub id: u64,
    /// One of those that are prisms.
    pub kind: ObjectKind,
    /// Where walls end below, in quanta above the vertical datum: at or under the lowest ground, but for what hangs
    /// above it.
    pub base: i32,
    /// The roof, in quanta above the vertical datum.
    pub roof: i32,
    /// The roofline counter-clockwise, then courtyards clockwise; three corners or more each.
    pub rings: Vec<Vec<Corner>>,
}

/// A layer of leaves over the ground, which light passes through in part, or the piece of one in one load module.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Canopy {
    /// Of all pieces of one object, and of no other object of the area.
    pub id: u64,
    /// One of those that are no prisms.
    pub kind: ObjectKind,
    /// Its top, in quanta above the ground right below.
    pub height: u16,
    /// Per cent of the light that 10 m of it take away, 1 to 99.
    pub fullness: u8,
    /// Quanta between stems.
    pub spacing: u16,
    /// Corners of its triangles in quanta from the load module's south-west corner: x, y.
    pub places: Vec<[u16; 2]>,
    /// Its plan: indices into `places`, counter-clockwise.
    pub triangles: Vec<[u16; 3]>,
}

/// All that stands in the square of one load module.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Objects {
    /// Sorted.
    pub prisms: Vec<Prism>,
    /// Sorted.
    pub canopies: Vec<Canopy>,
}

/// Prisms of a load module at most: their corners are numbered in 16 bits where they are looked for.
pub const PRISMS_MAX: usize = 16_383;

impl Prism {
    /// Its rings without walls, east and north in quanta from the corner of the load module.
    pub fn plan(&self) -> Vec<Vec<[i32; 2]>> {
        self.rings.iter().map(|ring| ring.iter().map(|at| [at.x, at.y].map(i32::from)).collect()).collect()
    }

    /// What it counts against a limit: its roof and each of its walls.
    pub fn polygons(&self) -> usize {
        1 + self.rings.iter().flatten().filter(|corner| corner.has_wall).count()
    }
}

impl Objects {
    /// Whether nothing stands there.
    pub fn is_empty(&self) -> bool {
        self.prisms.is_empty() && self.canopies.is_empty()
    }

    /// What they count against a limit: roofs and walls of prisms, triangles of canopies.
    pub fn polygons(&self) -> usize {
        let of_canopies: usize = self.canopies.iter().map(|canopy| canopy.triangles.len()).sum();
        self.prisms.iter().map(Prism::polygons).sum::<usize>() + of_canopies
    }

    /// What a part holds, in the square of a load module with sides of `side` quanta.
    ///
    /// # Errors
    /// When a promise of the format is broken.
    pub fn of_part(bytes: &[u8], side: u16) -> Result<Self, ReadError> {
        let section = Section::Objects { row: 0, col: 0, level: 0 };
        let mut cursor = Cursor::new(bytes, 0, section);
        let objects = parse(&mut cursor, bytes.len() as u32, side)?;
        cursor.expect(bytes.len() as u64, "bytes behind the objects", bytes.len() as i64, cursor.offset() as i64)?;
        Ok(objects)
    }

    /// The bytes of the part that holds them; a reader takes back what keeps the promises of the fields.
    pub fn to_part(&self) -> Vec<u8> {
        let corners = || self.prisms.iter().flat_map(|prism| prism.rings.iter().flatten());
        let rings = || self.prisms.iter().flat_map(|prism| prism.rings.iter());
        let places = || self.canopies.iter().flat_map(|canopy| canopy.places.iter());
        let triangles = || self.canopies.iter().flat_map(|canopy| canopy.triangles.iter());
        let counts = [self.prisms.len(), self.canopies.len(), rings().count(), corners().count()];
        let mut part = Vec::new();
        for count in counts.into_iter().chain([places().count(), triangles().count()]) {
            part.extend((count as u32).to_le_bytes());
        }
        for Prism { id, kind, base, roof, rings } in &self.prisms {
            part.extend(id.to_le_bytes());
            part.extend(base.to_le_bytes());
            part.extend(roof.to_le_bytes());
            part.extend([*kind as u8, 0]);
            part.extend((rings.len() as u16).to_le_bytes());
        }
        for Canopy { id, kind, height, fullness, spacing, places, triangles } in &self.canopies {
            part.extend(id.to_le_bytes());
            part.extend((triangles.len() as u32).to_le_bytes());
            part.extend([*kind as u8, *fullness]);
            [*height, *spacing, places.len() as u16].iter().for_each(|number| part.extend(number.to_le_bytes()));
        }
        corners().flat_map(|corner| [corner.x, corner.y]).for_each(|at| part.extend(at.to_le_bytes()));
        places().flatten().for_each(|at| part.extend(at.to_le_bytes()));
        rings().for_each(|ring| part.extend((ring.len() as u16).to_le_bytes()));
        triangles().flatten().for_each(|index| part.extend(index.to_le_bytes()));
        part.extend(corners().map(|corner| u8::from(corner.has_wall)));
        part.resize(part.len().next_multiple_of(4), 0);
        part
    }
}

/// Twice the area that places enclose, positive where they run counter-clockwise.
pub(crate) fn doubled_area(ring: impl ExactSizeIterator<Item = [u16; 2]> + Clone) -> i64 {
    let next = ring.clone().cycle().skip(1);
    let wide = |[x, y]: [u16; 2]| [i64::from(x), i64::from(y)];
    ring.zip(next).map(|(a, b)| (wide(a), wide(b))).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
}

/// The objects of a part of `length` bytes, in the square of a load module with sides of `side` quanta.
pub(crate) fn parse(cursor: &mut Cursor, length: u32, side: u16) -> Result<Objects, ReadError> {
    let start = cursor.offset();
    let mut counts = [0_u32; 6];
    for count in &mut counts {
        *count = cursor.u32()?;
    }
    let [prism_count, canopy_count, ring_count, corner_count, place_count, triangle_count] = counts;
    let wide = |count: u32| i64::from(count);
    let lists = FIXED_OBJECTS_BYTES as i64
        + PRISM_BYTES as i64 * wide(prism_count)
        + CANOPY_BYTES as i64 * wide(canopy_count)
        + 2 * wide(ring_count)
        + 5 * wide(corner_count)
        + 4 * wide(place_count)
        + 6 * wide(triangle_count);
    cursor.expect(start, "length of objects", wide(length), (lists + 3) / 4 * 4)?;
    cursor.within(start, "prism count", wide(prism_count), (i64::from(canopy_count == 0), PRISMS_MAX as i64))?;
    // The part is as long as its counts say, so that there is room for no more than it holds.
    let prisms = (0..prism_count).map(|_| read_prism(cursor)).collect::<Result<Vec<_>, _>>()?;
    let mut canopies = (0..canopy_count).map(|_| read_canopy(cursor)).collect::<Result<Vec<_>, _>>()?;
    let sum = |of: &mut dyn Iterator<Item = i64>| of.sum::<i64>();
    let rings = sum(&mut prisms.iter().map(|(_, rings)| i64::from(*rings)));
    cursor.expect(start + 8, "ring count", wide(ring_count), rings)?;
    let places = sum(&mut canopies.iter().map(|(_, [places, _])| wide(*places)));
    cursor.expect(start + 16, "place count", wide(place_count), places)?;
    let triangles = sum(&mut canopies.iter().map(|(_, [_, triangles])| wide(*triangles)));
    cursor.expect(start + 20, "canopy triangle count", wide(triangle_count), triangles)?;
    let corners_at = cursor.offset();
    let corners = read_places(cursor, corner_count, side)?;
    for (canopy, [places, _]) in &mut canopies {
        canopy.places = read_places(cursor, *places, side)?;
    }
    let rings_at = cursor.offset();
    let lengths = (0..ring_count).map(|_| cursor.u16()).collect::<Result<Vec<_>, _>>()?;
    cursor.expect(rings_at, "corners of all rings", lengths.iter().map(|&n| i64::from(n)).sum(), wide(corner_count))?;
    for (canopy, [_, triangles]) in &mut canopies {
        canopy.triangles = read_triangles(cursor, *triangles, canopy)?;
    }
    let walls = read_walls(cursor, corner_count)?;
    cursor.padding()?;
    let mut objects = Objects::default();
    let (mut ring, mut corner) = (0, 0);
    for (mut prism, count) in prisms {
        for number in 0..usize::from(count) {
            let (from, to) = (corner, corner + usize::from(lengths[ring]));
            let offset = corners_at + 4 * from as u64;
            prism.rings.push(ring_of(cursor, offset, &corners[from..to], &walls[from..to], number == 0)?);
            (ring, corner) = (ring + 1, to);
        }
        let sorted = objects.prisms.last().is_none_or(|last| *last < prism);
        cursor.expect(start, "order of prisms", i64::from(sorted), 1)?;
        objects.prisms.push(prism);
    }
    objects.canopies = canopies.into_iter().map(|(canopy, _)| canopy).collect();
    let sorted = objects.canopies.is_sorted_by(|a, b| a < b);
    cursor.expect(start, "order of canopies", i64::from(sorted), 1)?;
    Ok(objects)
}

/// A prism without its rings, and how many it has.
fn read_prism(cursor: &mut Cursor) -> Result<(Prism, u16), ReadError> {
    let offset = cursor.offset();
    let (id, base, roof) = (cursor.u64()?, cursor.i32()?, cursor.i32()?);
    let [kind, zero] = cursor.array()?;
    let rings = cursor.u16()?;
    cursor.within(offset + 12, "roof", i64::from(roof), (i64::from(base) + 1, i64::from(i32::MAX)))?;
    let kind = kind_of(cursor, offset + 16, kind, true)?;
    cursor.expect(offset + 17, "unused byte", i64::from(zero), 0)?;
    cursor.within(offset + 18, "ring count of a prism", i64::from(rings), (1, i64::from(u16::MAX)))?;
    Ok((Prism { id, kind, base, roof, rings: Vec::new() }, rings))
}

/// A canopy without its lists, and how many places and triangles it has.
fn read_canopy(cursor: &mut Cursor) -> Result<(Canopy, [u32; 2]), ReadError> {
    let offset = cursor.offset();
    let (id, triangles) = (cursor.u64()?, cursor.u32()?);
    let [kind, fullness] = cursor.array()?;
    let (height, spacing, places) = (cursor.u16()?, cursor.u16()?, cursor.u16()?);
    let kind = kind_of(cursor, offset + 12, kind, false)?;
    cursor.within(offset + 13, "fullness", i64::from(fullness), (1, 99))?;
    cursor.within(offset + 14, "height of a canopy", i64::from(height), (1, i64::from(u16::MAX)))?;
    cursor.within(offset + 16, "spacing of stems", i64::from(spacing), (1, i64::from(u16::MAX)))?;
    cursor.within(offset + 18, "place count of a canopy", i64::from(places), (3, i64::from(u16::MAX)))?;
    cursor.within(offset + 8, "triangle count of a canopy", i64::from(triangles), (1, 2 * i64::from(u16::MAX)))?;
    let canopy = Canopy { id, kind, height, fullness, spacing, places: Vec::new(), triangles: Vec::new() };
    Ok((canopy, [places.into(), triangles]))
}

fn kind_of(cursor: &Cursor, offset: u64, number: u8, is_prism: bool) -> Result<ObjectKind, ReadError> {
    let first = ObjectKind::ALL.iter().filter(|kind| kind.is_prism()).count() as i64;
    let range = if is_prism { (0, first - 1) } else { (first, ObjectKind::ALL.len() as i64 - 1) };
    cursor.within(offset, "kind of an object", i64::from(number), range)?;
    Ok(ObjectKind::ALL[usize::from(number)])
}

fn read_places(cursor: &mut Cursor, count: u32, side: u16) -> Result<Vec<[u16; 2]>, ReadError> {
    let mut places = Vec::with_capacity(count as usize);
    for _ in 0..count {
        let offset = cursor.offset();
        let place = [cursor.u16()?, cursor.u16()?];
        cursor.within(offset, "x of an object", i64::from(place[0]), (0, i64::from(side)))?;
        cursor.within(offset + 2, "y of an object", i64::from(place[1]), (0, i64::from(side)))?;
        places.push(place);
    }
    Ok(places)
}

fn read_triangles(cursor: &mut Cursor, count: u32, canopy: &Canopy) -> Result<Vec<[u16; 3]>, ReadError> {
    let last = canopy.places.len() as i64 - 1;
    let mut triangles = Vec::with_capacity(count as usize);
    for _ in 0..count {
        let offset = cursor.offset();
        let triangle = [cursor.u16()?, cursor.u16()?, cursor.u16()?];
        for index in triangle {
            cursor.within(offset, "place of a triangle", i64::from(index), (0, last))?;
        }
        let area = doubled_area(triangle.map(|index| canopy.places[usize::from(index)]).into_iter());
        cursor.within(offset, "doubled area of a canopy's triangle", area, (1, i64::MAX))?;
        triangles.push(triangle);
    }
    Ok(triangles)
}

fn read_walls(cursor: &mut Cursor, count: u32) -> Result<Vec<bool>, ReadError> {
    let mut walls = Vec::with_capacity(count as usize);
    for _ in 0..count {
        let offset = cursor.offset();
        let [wall] = cursor.array()?;
        cursor.within(offset, "wall of a corner", i64::from(wall), (0, 1))?;
        walls.push(wall == 1);
    }
    Ok(walls)
}

fn ring_of(
    cursor: &Cursor,
    offset: u64,
    places: &[[u16; 2]],
    walls: &[bool],
    is_outer: bool,
) -> Result<Vec<Corner>, ReadError> {
    cursor.within(offset, "corners of a ring", places.len() as i64, (3, i64::from(u16::MAX)))?;
    let area = doubled_area(places.iter().copied());
    let range = if is_outer { (1, i64::MAX) } else { (i64::MIN, -1) };
    cursor.within(offset, "doubled area of a ring", area, range)?;
    Ok(places.iter().zip(walls).map(|(&[x, y], &has_wall)| Corner { x, y, has_wall }).collect())
}
