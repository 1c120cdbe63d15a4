//! `modules/r02c03.slm`: the load modules of one tile, as a simulator reads them. `FORMAT.md` is the specification.

use std::path::Path;

use load_module_reader::{
    Block, DECK_ENTRY_BYTES, FIXED_HEADER_BYTES, Header, INDEX_ENTRY_BYTES, LEVELS_MAX, MAGIC, Module, PART_DECKS,
    PART_LINES, PART_OBJECTS, PARTS_ENTRY_BYTES, QUANTA_PER_METRE, ReadError, SlmFile, VERSION, VERSION_OF_GROUND,
    VERSION_WITH_DECKS,
};
use terrain::{
    Decks, GridFrame, LoadModule, ModuleGrid, ModuleId, ModuleLine, ModuleRect, ModuleVertex, Side, Spacing, TileId,
};

use crate::{DatabaseError, Fingerprint};

/// What holds for all load modules of a tile.
#[derive(Clone, Debug, PartialEq)]
pub struct TileModules {
    /// Which tile.
    pub tile: TileId,
    /// The load modules of the whole area.
    pub grid: ModuleGrid,
    /// Those of this tile.
    pub modules: ModuleRect,
    /// Where the working grid lies.
    pub frame: GridFrame,
    /// The coordinate reference system, such as `EPSG:32611`; at most 65,535 bytes.
    pub crs: String,
    /// What heights are above, empty when unknown; at most 65,535 bytes.
    pub vertical_datum: String,
    /// Of all that the load modules were made from.
    pub fingerprint: Fingerprint,
}

impl TileModules {
    /// Length of a load module's side in quanta of 1/128 m.
    fn side(&self) -> i64 {
        i64::from(self.grid.side_cells) * i64::from(self.frame.spacing.quanta_per_post())
    }
}

/// The bytes of the file that holds `modules`, at one level.
///
/// # Panics
/// As [`encode_levels`].
pub fn encode_modules(tile: &TileModules, modules: &[LoadModule]) -> Vec<u8> {
    encode(tile, &[modules])
}

/// The bytes of the file that holds these levels of a tile's load modules, the finest first: of format version 3 if any
/// of them has lines or objects, else of version 2 if any has decks, else of version 1.
///
/// # Panics
/// When there are none or more than eight, or the load modules of one are not exactly those of the tile, row by row
/// from the south-west, each with the tile's side and lists that belong together (and, in debug builds, sound:
/// [`LoadModule::check`]).
pub fn encode_levels(tile: &TileModules, levels: &[Vec<LoadModule>]) -> Vec<u8> {
    encode(tile, &levels.iter().map(Vec::as_slice).collect::<Vec<_>>())
}

fn encode(tile: &TileModules, levels: &[&[LoadModule]]) -> Vec<u8> {
    let level_count = u16::try_from(levels.len()).ok().filter(|count| (1..=LEVELS_MAX).contains(count));
    let level_count = level_count.expect("a tile's file holds one level or a few");
    let header_length = (FIXED_HEADER_BYTES + tile.crs.len() + tile.vertical_datum.len()).next_multiple_of(4) + 4;
    let version = version_of(levels);
    let entry_bytes = INDEX_ENTRY_BYTES
        + match version {
            VERSION => PARTS_ENTRY_BYTES,
            VERSION_WITH_DECKS => DECK_ENTRY_BYTES,
            _ => 0,
        };
    let index_length = levels.len() * tile.modules.count() * entry_bytes + 4;
    let mut index = Vec::with_capacity(index_length);
    let mut sections = Vec::new();
    for (level, modules) in (0..).zip(levels) {
        let is_whole = modules.iter().map(|module| module.id).eq(tile.modules.iter());
        assert!(is_whole, "a tile's file holds all its load modules");
        for module in *modules {
            let id = module.id;
            assert_eq!(i64::from(module.side), tile.side(), "load module {id} has the side of the tile's grid");
            debug_assert_eq!(module.check(), Ok(()), "load module {id} is sound before it is written");
            let start = sections.len();
            put_module(&mut sections, module, level);
            let offset = (header_length + index_length + start) as u64;
            let end = sections.len();
            put_entry(&mut index, module, offset, (end - start) as u32);
            match version {
                VERSION => {
                    put_parts(&mut sections, module, level);
                    put_u32s(&mut index, [(sections.len() - end) as u32]);
                }
                VERSION_WITH_DECKS => {
                    put_deck_entry(&mut index, &module.decks);
                    put_decks(&mut sections, module, level);
                }
                _ => {}
            }
        }
    }
    put_checksum(&mut index, 0);
    let file_length = header_length + index.len() + sections.len();
    let mut file = Vec::with_capacity(file_length);
    put_header(&mut file, tile, [version, level_count], header_length as u32, file_length as u64);
    file.extend_from_slice(&index);
    file.extend_from_slice(&sections);
    file
}

/// The least version of the format that holds all there is.
fn version_of(levels: &[&[LoadModule]]) -> u16 {
    let any = |has: fn(&LoadModule) -> bool| levels.iter().any(|modules| modules.iter().any(has));
    let is_parted = any(|module| !module.lines.is_empty() || !module.objects.is_empty());
    match (is_parted, any(|module| !module.decks.is_empty())) {
        (true, _) => VERSION,
        (false, true) => VERSION_WITH_DECKS,
        (false, false) => VERSION_OF_GROUND,
    }
}

fn put_header(file: &mut Vec<u8>, tile: &TileModules, start: [u16; 2], header_length: u32, file_length: u64) {
    file.extend_from_slice(&MAGIC);
    put_u16s(file, start);
    put_u32s(file, [header_length]);
    file.extend_from_slice(&file_length.to_le_bytes());
    put_u32s(file, [tile.tile.row, tile.tile.col, tile.grid.rows, tile.grid.cols]);
    put_u32s(file, [tile.modules.south, tile.modules.north, tile.modules.west, tile.modules.east]);
    let cells = u32::try_from(tile.grid.side_cells).expect("a load module has a positive number of cells a side");
    let side = u32::try_from(tile.side()).expect("the side equals that of every load module, which is 16 bits");
    put_u32s(file, [side, cells, tile.frame.spacing.sixteenths(), QUANTA_PER_METRE]);
    file.extend_from_slice(&tile.frame.origin_east_m.to_le_bytes());
    file.extend_from_slice(&tile.frame.origin_north_m.to_le_bytes());
    let text_length = |text: &str| u16::try_from(text.len()).expect("texts of the header are short");
    put_u16s(file, [text_length(&tile.crs), text_length(&tile.vertical_datum)]);
    file.extend_from_slice(&tile.fingerprint.0);
    file.extend_from_slice(tile.crs.as_bytes());
    file.extend_from_slice(tile.vertical_datum.as_bytes());
    pad(file, 0);
    put_checksum(file, 0);
}

fn put_entry(index: &mut Vec<u8>, module: &LoadModule, offset: u64, length: u32) {
    index.extend_from_slice(&offset.to_le_bytes());
    put_u32s(index, [length, module.vertices.len() as u32, module.triangles.len() as u32, module.polygon_count]);
    let heights = heights(&module.vertices).expect("a load module has at least its corners");
    heights.iter().for_each(|height| index.extend_from_slice(&height.to_le_bytes()));
}

/// What the entry of a load module says of its decks: zeros where it has none.
fn put_deck_entry(index: &mut Vec<u8>, decks: &Decks) {
    put_u32s(index, [decks.vertices.len() as u32, decks.triangles.len() as u32]);
    heights(&decks.vertices)
        .unwrap_or_default()
        .iter()
        .for_each(|height| index.extend_from_slice(&height.to_le_bytes()));
}

/// Lowest and highest of some vertices.
fn heights(vertices: &[ModuleVertex]) -> Option<[i32; 2]> {
    let heights = || vertices.iter().map(|vertex| vertex.z);
    Some([heights().min()?, heights().max()?])
}

fn put_module(file: &mut Vec<u8>, module: &LoadModule, level: u32) {
    let start = file.len();
    let counts = [module.vertices.len() as u32, module.triangles.len() as u32, module.polygon_count];
    put_u32s(file, [module.id.row, module.id.col, level]);
    put_u32s(file, counts);
    let sides = Side::ALL.map(|side| module.side_vertices(side));
    put_u16s(file, sides.iter().map(|side| side.len() as u16));
    let residual = &module.residual;
    put_u32s(file, [residual.posts, residual.largest]);
    file.extend_from_slice(&residual.sum_abs.to_le_bytes());
    file.extend_from_slice(&residual.sum_squared.to_le_bytes());
    put_vertices(file, &module.vertices);
    put_u16s(file, module.triangles.iter().flatten().copied());
    put_u16s(file, sides.iter().flatten().copied());
    assert_eq!(module.classes.len(), module.triangles.len(), "load module {} has a class per triangle", module.id);
    file.extend_from_slice(&module.classes);
    pad(file, start);
    put_checksum(file, start);
}

/// The part of a load module's decks, where it has any.
fn put_decks(file: &mut Vec<u8>, module: &LoadModule, level: u32) {
    let decks = &module.decks;
    if decks.is_empty() {
        return;
    }
    let start = file.len();
    put_u32s(file, [module.id.row, module.id.col, level]);
    put_u32s(file, [decks.vertices.len() as u32, decks.triangles.len() as u32]);
    put_deck_lists(file, decks);
    pad(file, start);
    put_checksum(file, start);
}

fn put_deck_lists(file: &mut Vec<u8>, decks: &Decks) {
    put_vertices(file, &decks.vertices);
    put_u16s(file, decks.triangles.iter().flatten().copied());
    assert_eq!(decks.classes.len(), decks.triangles.len(), "decks have a class for each triangle");
    file.extend_from_slice(&decks.classes);
}

/// The table of a load module's parts, and the parts; nothing where it has none.
fn put_parts(file: &mut Vec<u8>, module: &LoadModule, level: u32) {
    let mut parts = Vec::new();
    if !module.decks.is_empty() {
        parts.push((PART_DECKS, deck_part(&module.decks)));
    }
    if !module.lines.is_empty() {
        parts.push((PART_LINES, line_part(&module.lines)));
    }
    if !module.objects.is_empty() {
        parts.push((PART_OBJECTS, module.objects.to_part()));
    }
    if parts.is_empty() {
        return;
    }
    let start = file.len();
    put_u32s(file, [module.id.row, module.id.col, level, parts.len() as u32]);
    parts.iter().for_each(|(kind, part)| put_u32s(file, [*kind, part.len() as u32, crc32fast::hash(part)]));
    put_checksum(file, start);
    parts.iter().for_each(|(_, part)| file.extend_from_slice(part));
}

fn deck_part(decks: &Decks) -> Vec<u8> {
    let mut part = Vec::new();
    put_u32s(&mut part, [decks.vertices.len() as u32, decks.triangles.len() as u32]);
    put_deck_lists(&mut part, decks);
    pad(&mut part, 0);
    part
}

fn line_part(lines: &[ModuleLine]) -> Vec<u8> {
    let mut part = Vec::new();
    let vertices: usize = lines.iter().map(|line| line.vertices.len()).sum();
    put_u32s(&mut part, [lines.len() as u32, vertices as u32]);
    for line in lines {
        let flags = u8::from(line.is_kept) | u8::from(line.is_in_ground) << 1 | (line.storey as u8) << 2;
        part.extend([line.class, line.kind as u8, line.form as u8, flags]);
        let count = u16::try_from(line.vertices.len()).expect("a line numbers its vertices in 16 bits");
        put_u16s(&mut part, [line.width, count]);
    }
    lines.iter().for_each(|line| put_vertices(&mut part, &line.vertices));
    part
}

fn put_vertices(file: &mut Vec<u8>, vertices: &[ModuleVertex]) {
    for vertex in vertices {
        put_u16s(file, [vertex.x, vertex.y]);
        file.extend_from_slice(&vertex.z.to_le_bytes());
    }
}

fn put_u16s(file: &mut Vec<u8>, values: impl IntoIterator<Item = u16>) {
    values.into_iter().for_each(|value| file.extend_from_slice(&value.to_le_bytes()));
}

fn put_u32s(file: &mut Vec<u8>, values: impl IntoIterator<Item = u32>) {
    values.into_iter().for_each(|value| file.extend_from_slice(&value.to_le_bytes()));
}

/// Zeros, until the section that begins at `start` is a multiple of four bytes long.
fn pad(file: &mut Vec<u8>, start: usize) {
    let length = (file.len() - start).next_multiple_of(4);
    file.resize(start + length, 0);
}

fn put_checksum(file: &mut Vec<u8>, start: usize) {
    let checksum = crc32fast::hash(&file[start..]);
    file.extend_from_slice(&checksum.to_le_bytes());
}

/// The load modules, at their finest level, in the file at `path` that has these bytes; the reader holds that each
/// is sound.
///
/// # Errors
/// When the file is not as it was written.
pub(crate) fn decode_modules(path: &Path, bytes: &[u8]) -> Result<(TileModules, Vec<LoadModule>), DatabaseError> {
    let (tile, levels) = decode_levels(path, bytes)?;
    let finest = levels.into_iter().next().expect("the reader refuses a file without a level");
    Ok((tile, finest))
}

/// The load modules at every level, the finest first, in the file at `path` that has these bytes; the reader holds
/// that each is sound.
///
/// # Errors
/// When the file is not as it was written.
pub fn decode_levels(path: &Path, bytes: &[u8]) -> Result<(TileModules, Vec<Vec<LoadModule>>), DatabaseError> {
    let file = SlmFile::parse(bytes).map_err(damaged(path))?;
    let levels = (0..file.header().level_count).map(|level| file.level(level).unwrap_or(&[]));
    Ok(of_levels(file.header(), levels))
}

/// The same of the load modules of `part` alone: the others are not looked at.
///
/// # Errors
/// When header, index or a load module of the part are not as they were written.
pub(crate) fn decode_part(
    path: &Path,
    bytes: &[u8],
    ModuleRect { south, west, north, east }: ModuleRect,
) -> Result<(TileModules, Vec<Vec<LoadModule>>), DatabaseError> {
    let part = Block { south, west, north, east };
    let (header, levels) = SlmFile::parse_part(bytes, part).map_err(damaged(path))?;
    Ok(of_levels(&header, levels.iter().map(Vec::as_slice)))
}

fn damaged(path: &Path) -> impl Fn(ReadError) -> DatabaseError {
    move |fault| DatabaseError::Modules { path: path.to_path_buf(), fault: Box::new(fault) }
}

fn of_levels<'a>(header: &Header, levels: impl Iterator<Item = &'a [Module]>) -> (TileModules, Vec<Vec<LoadModule>>) {
    let level = |modules: &[Module]| modules.iter().map(|module| load_module(module, header.side)).collect();
    (tile_of(header), levels.map(level).collect())
}

fn tile_of(header: &Header) -> TileModules {
    let spacing = Spacing::from_sixteenths(header.spacing_sixteenths).expect("the reader refuses a spacing of zero");
    let [origin_east_m, origin_north_m] = header.origin_m;
    TileModules {
        tile: TileId { row: header.tile_row, col: header.tile_col },
        // The reader holds the side in cells below 65,536.
        grid: ModuleGrid { rows: header.area_rows, cols: header.area_cols, side_cells: header.side_cells as i32 },
        modules: ModuleRect { south: header.south, west: header.west, north: header.north, east: header.east },
        frame: GridFrame { origin_east_m, origin_north_m, spacing },
        crs: header.crs.clone(),
        vertical_datum: header.vertical_datum.clone(),
        fingerprint: Fingerprint(header.fingerprint),
    }
}

/// A load module as the reader gives it, whose square has sides of `side` quanta.
pub fn load_module(module: &Module, side: u16) -> LoadModule {
    let Module { row, col, vertices, triangles, classes, polygon_count, residual, decks, lines, objects, .. } =
        module.clone();
    let id = ModuleId { row, col };
    LoadModule { id, side, vertices, triangles, classes, polygon_count, residual, decks, lines, objects }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    fn decode(bytes: &[u8]) -> Result<(TileModules, Vec<LoadModule>), DatabaseError> {
        decode_modules(Path::new("r00c01.slm"), bytes)
    }

    #[test]
    fn load_modules_survive_their_file() {
        let (tile, modules) = (samples::tile_modules(), samples::modules());
        let bytes = encode_modules(&tile, &modules);
        assert_eq!(decode(&bytes).unwrap(), (tile.clone(), modules.clone()));
        assert_eq!(encode_modules(&tile, &modules), bytes);
    }

    #[test]
    fn levels_survive_their_file() {
        let (tile, levels) = (samples::tile_modules(), samples::levels());
        let bytes = encode_levels(&tile, &levels);
        let path = Path::new("r00c01.slm");
        assert_eq!(decode_levels(path, &bytes).unwrap(), (tile.clone(), levels.clone()));
        assert_eq!(decode(&bytes).unwrap(), (tile.clone(), levels[0].clone()));
        assert_eq!(encode_levels(&tile, &levels[..1]), encode_modules(&tile, &levels[0]));
        samples::check_every_damage(&bytes, |bytes| decode_levels(path, bytes).is_err());
    }

    #[test]
    fn decks_survive_their_file_of_version_2() {
        let (tile, levels) = (samples::tile_modules(), samples::levels_with_decks());
        let bytes = encode_levels(&tile, &levels);
        let path = Path::new("r00c01.slm");
        assert_eq!(bytes[8..10], [2, 0]);
        assert_eq!(decode_levels(path, &bytes).unwrap(), (tile.clone(), levels.clone()));
        samples::check_every_damage(&bytes, |bytes| decode_levels(path, bytes).is_err());
    }

    #[test]
    fn lines_survive_their_file_of_version_3() {
        let (tile, levels) = (samples::tile_modules(), samples::levels_with_lines());
        let bytes = encode_levels(&tile, &levels);
        let path = Path::new("r00c01.slm");
        assert_eq!(bytes[8..10], [3, 0]);
        assert_eq!(decode_levels(path, &bytes).unwrap(), (tile.clone(), levels.clone()));
        samples::check_every_damage(&bytes, |bytes| decode_levels(path, bytes).is_err());
        let without = |mut module: LoadModule| {
            module.lines.clear();
            module
        };
        let bare: Vec<Vec<LoadModule>> =
            levels.into_iter().map(|level| level.into_iter().map(without).collect()).collect();
        assert_eq!(bare, samples::levels_with_decks());
    }

    #[test]
    fn a_file_without_decks_is_of_version_1() {
        let (tile, mut levels) = (samples::tile_modules(), samples::levels_with_decks());
        levels.iter_mut().flatten().for_each(|module| module.decks = Decks::default());
        let bytes = encode_levels(&tile, &levels);
        assert_eq!(bytes[8..10], [1, 0]);
        assert_eq!(bytes, encode_levels(&tile, &samples::levels()));
        // What version 1 has always been.
        let hash = Fingerprint::of_bytes(&bytes).to_string();
        assert_eq!(hash, "b633fa11294810a26baa848d8ef4f709b4835895eff5d5a09c6527039973e18c");
    }

    #[test]
    fn every_damage_is_an_error() {
        let bytes = encode_modules(&samples::tile_modules(), &samples::modules());
        samples::check_every_damage(&bytes, |bytes| decode(bytes).is_err());
    }

    #[test]
    fn damage_is_named_by_file_and_section() {
        let mut bytes = encode_modules(&samples::tile_modules(), &samples::modules());
        let last = bytes.len() - 8;
        bytes[last] ^= 64;
        let error = decode(&bytes).unwrap_err().to_string();
        assert!(error.starts_with("r00c01.slm: load module 2,4, offset "), "{error}");
    }

    #[test]
    #[should_panic(expected = "a tile's file holds all its load modules")]
    fn a_missing_load_module_is_not_written() {
        encode_modules(&samples::tile_modules(), &samples::modules()[..1]);
    }
}
