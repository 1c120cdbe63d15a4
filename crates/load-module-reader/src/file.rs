//! A whole file: header, index, load modules.

use std::io::Read;
use std::path::Path;

use crate::tile_file::open_file;
use crate::{Block, FILE_BYTES_MAX, Header, IndexEntry, Module, ReadError, Section, VERSION, index};

/// All load modules of one tile, decoded and checked.
#[derive(Clone, Debug, PartialEq)]
pub struct SlmFile {
    header: Header,
    index: Vec<IndexEntry>,
    /// Level by level, each row by row from the south-west.
    modules: Vec<Module>,
}

impl SlmFile {
    /// Reads and checks the file at `path`.
    ///
    /// # Errors
    /// When the file cannot be read or anything in it is not as `docs/FORMAT.md` says; the error carries the path.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, ReadError> {
        let path = path.as_ref();
        let unreadable = |source| ReadError::Unreadable { path: path.to_path_buf(), source };
        let file = open_file(path)?;
        let found = file.metadata().map_err(unreadable)?.len();
        let parsed = if FILE_BYTES_MAX < found {
            Err(ReadError::TooLarge { found, limit: FILE_BYTES_MAX })
        } else {
            let mut bytes = Vec::with_capacity(found as usize);
            file.take(FILE_BYTES_MAX).read_to_end(&mut bytes).map_err(unreadable)?;
            Self::parse(&bytes)
        };
        parsed.map_err(|fault| ReadError::InFile { path: path.to_path_buf(), fault: Box::new(fault) })
    }

    /// Decodes and checks a file held in memory.
    ///
    /// # Errors
    /// When anything in it is not as `docs/FORMAT.md` says.
    pub fn parse(bytes: &[u8]) -> Result<Self, ReadError> {
        let (header, index, modules) = parse(bytes, |_, _| true)?;
        let file = Self { header, index, modules };
        file.check_version()?;
        Ok(file)
    }

    /// The header of a file held in memory, and the load modules of a block that are in it, level by level, decoded and
    /// checked; the bytes of no other are looked at.
    ///
    /// # Errors
    /// When header, index or one of these load modules are not as `docs/FORMAT.md` says.
    pub fn parse_part(bytes: &[u8], part: Block) -> Result<(Header, Vec<Vec<Module>>), ReadError> {
        let (header, _, modules) = parse(bytes, |row, col| part.contains(row, col))?;
        let mut levels = vec![Vec::new(); usize::from(header.level_count)];
        modules.into_iter().for_each(|module| levels[usize::from(module.level)].push(module));
        Ok((header, levels))
    }

    /// The same load modules have one file only: with decks alone it is of version 2.
    fn check_version(&self) -> Result<(), ReadError> {
        let more = |module: &Module| {
            !module.lines.is_empty() || !module.objects.is_empty() || !module.unknown_parts.is_empty()
        };
        if self.header.version != VERSION || self.modules.iter().any(more) {
            return Ok(());
        }
        let (section, field) = (Section::Header, "parts other than decks");
        Err(ReadError::WrongValue { section, offset: 8, field, found: 0, expected: 1 })
    }

    /// What holds for all load modules of the file.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// One entry per load module and level: level by level, row by row from the south-west.
    pub fn index(&self) -> &[IndexEntry] {
        &self.index
    }

    /// All load modules at their finest level, row by row from the south-west.
    pub fn modules(&self) -> &[Module] {
        self.level(0).unwrap_or(&[])
    }

    /// All load modules at a level, in the same order; `None` when there is no such level.
    pub fn level(&self, level: u16) -> Option<&[Module]> {
        let count = self.header.module_count() as usize;
        self.modules.chunks(count.max(1)).nth(usize::from(level))
    }

    /// The load module at (`row`, `col`) of the area, at its finest level; `None` when it lies in another tile.
    pub fn module(&self, row: u32, col: u32) -> Option<&Module> {
        self.header.index_of(row, col).and_then(|index| self.modules.get(index))
    }
}

/// Header, index, and of the load modules those that are wanted by row and column, level by level.
fn parse(bytes: &[u8], wanted: impl Fn(u32, u32) -> bool) -> Result<(Header, Vec<IndexEntry>, Vec<Module>), ReadError> {
    let found = bytes.len() as u64;
    if FILE_BYTES_MAX < found {
        return Err(ReadError::TooLarge { found, limit: FILE_BYTES_MAX });
    }
    let (header, header_length) = Header::parse(bytes, found)?;
    let index = index::parse(bytes, &header, header_length, found)?;
    let columns = header.west..header.east;
    let places = || (header.south..header.north).flat_map(|row| columns.clone().map(move |col| (row, col)));
    let of_levels = (0..header.level_count).flat_map(|level| places().map(move |place| (level, place)));
    let modules = of_levels
        .zip(&index)
        .filter(|((_, (row, col)), _)| wanted(*row, *col))
        .map(|((level, place), entry)| Module::parse(section(bytes, entry), &header, entry, level, place))
        .collect::<Result<_, _>>()?;
    Ok((header, index, modules))
}

/// The bytes of one section and of what follows it. The index has been checked against the length of the file.
fn section<'a>(bytes: &'a [u8], entry: &IndexEntry) -> &'a [u8] {
    let start = entry.offset as usize;
    &bytes[start..entry.end() as usize]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;

    #[test]
    fn a_sound_file_is_read_as_written() {
        let file = SlmFile::parse(&sample::file()).unwrap();
        assert_eq!((file.header().tile_row, file.header().tile_col), (0, 1));
        assert_eq!(file.header().crs, "EPSG:32611");
        assert_eq!(file.header().module_origin_m(2, 3), [501_500.0, 3_876_000.25]);
        assert_eq!(file.modules().len(), 2);
        let module = file.module(2, 4).unwrap();
        assert_eq!(module.triangles, [[0, 1, 2], [0, 2, 3], [1, 4, 2], [2, 4, 3]]);
        assert_eq!(module.sides, [vec![0, 1], vec![1, 4], vec![3, 4], vec![0, 3]]);
        assert_eq!(module.classes, [1, 0, 0, 2]);
        assert_eq!(module.residual.rms_m(), Some(1.0));
        assert!(file.module(2, 5).is_none() && file.module(1, 4).is_none());
    }

    #[test]
    fn a_file_of_two_levels_holds_each_load_module_twice() {
        let file = SlmFile::parse(&sample::two_levels()).unwrap();
        assert_eq!((file.header().level_count, file.index().len()), (2, 4));
        let plain = SlmFile::parse(&sample::file()).unwrap();
        assert_eq!((file.modules(), plain.level(1)), (plain.modules(), None));
        let [west, east] = file.level(1).unwrap() else { panic!("two load modules") };
        assert_eq!((west.col, west.level, west.triangles.len()), (3, 1, 2));
        assert_eq!((east.col, east.level, east.triangles.len()), (4, 1, 2));
        assert_eq!(file.level(2), None);
        assert_eq!(file.module(2, 4).map(|module| module.level), Some(0));
    }

    fn samples() -> [Vec<u8>; 5] {
        let (decks, one_deck) = (sample::with_decks(), sample::with_one_deck_of_two_levels());
        [sample::file(), sample::two_levels(), decks, one_deck, sample::with_parts()]
    }

    #[test]
    fn a_file_with_parts_is_of_version_3_and_unknown_kinds_are_passed_over() {
        let file = SlmFile::parse(&sample::with_parts()).unwrap();
        assert_eq!(file.header().version, 3);
        let [west, east] = file.modules() else { panic!("two load modules") };
        let bridged = SlmFile::parse(&sample::with_decks()).unwrap();
        assert_eq!(west.decks, bridged.modules()[0].decks);
        assert_eq!((&west.lines[..], &east.unknown_parts[..]), (&[][..], &[77][..]));
        let told =
            |line: &crate::Line| (line.class, line.kind, line.form, line.storey, line.is_kept, line.is_in_ground);
        use crate::{LineForm, LineKind, LineStorey};
        let (road, river) = (LineKind::Travelled, LineKind::Channel);
        assert_eq!(
            east.lines.iter().map(told).collect::<Vec<_>>(),
            [
                (7, road, LineForm::Nothing, LineStorey::Ground, false, false),
                (7, road, LineForm::Strip, LineStorey::Ground, true, true),
                (7, road, LineForm::Strip, LineStorey::Bridge, true, false),
                (9, river, LineForm::Line, LineStorey::Ground, true, true),
            ]
        );
        assert_eq!((east.lines[1].width, east.lines[3].vertices.len()), (896, 3));
        for (plain, parted) in bridged.modules().iter().zip(file.modules()) {
            assert_eq!((&plain.vertices, &plain.triangles), (&parted.vertices, &parted.triangles));
        }
    }

    #[test]
    fn what_checksums_cannot_know_of_parts_is_checked_too() {
        let check = |damage: &dyn Fn(&mut [u8], usize), expected: &str| {
            let mut bytes = sample::with_parts();
            let entry = SlmFile::parse(&bytes).unwrap().index()[1];
            damage(&mut bytes, (entry.offset + u64::from(entry.length)) as usize);
            sample::mend_checksums(&mut bytes);
            let error = SlmFile::parse(&bytes).unwrap_err().to_string();
            assert!(error.contains(expected), "{error:?} does not say {expected:?}");
        };
        // The table has three entries; lines follow, then what is unknown.
        let lines = 16 + 3 * 12 + 4 + (8 + 8 * 8 + 7 * 4);
        let vertices = lines + 8 + 4 * 8;
        check(&|bytes, at| bytes[at] = 9, "parts of load module 2,4, offset");
        check(&|bytes, at| bytes[at + 8] = 1, "found level 1, expected 0");
        check(&|bytes, at| bytes[at + 12] = 0, "found part count 0, expected 1 to");
        check(&|bytes, at| bytes[at + 14] = 1, "found part count 65539, expected 1 to");
        check(&|bytes, at| bytes[at + 16] = 2, "found kind of a part 2, expected 3 to");
        check(
            &|bytes, at| (bytes[at + 20], bytes[at + 32]) = (bytes[at + 20] - 4, bytes[at + 32] + 4),
            "found length of decks 96, expected 100",
        );
        check(&|bytes, at| bytes[at + 20] -= 4, "found bytes behind the last part 4, expected 0");
        check(&|bytes, at| bytes[at + 20] += 1, "found length of a part, less whole words, 1, expected 0");
        check(&|bytes, at| bytes[at + 23] = 9, "found length of a part 150995044, expected 4 to");
        check(&|bytes, at| bytes[at + lines] = 3, "found length of lines");
        check(&|bytes, at| bytes[at + lines + 8] = 255, "found class of a line 255, expected 0 to 254");
        check(&|bytes, at| bytes[at + lines + 9] = 3, "found kind of a line 3, expected 0 to 2");
        check(&|bytes, at| bytes[at + lines + 10] = 4, "found form of a line 4, expected 0 to 3");
        check(&|bytes, at| bytes[at + lines + 11] = 12, "found flags of a line 12, expected 0 to 11");
        check(&|bytes, at| bytes[at + lines + 11] = 2, "found agreement of form and flags 0, expected 1");
        check(&|bytes, at| bytes[at + lines + 10] = 1, "found agreement of form and flags 0, expected 1");
        check(&|bytes, at| bytes[at + lines + 14] = 1, "found vertex count of a line 1, expected 2 to 65535");
        check(&|bytes, at| bytes[at + lines + 14] = 3, "found vertex count of lines 9, expected 10");
        check(&|bytes, at| bytes[at + vertices + 1] = 0xff, "found x 65");
        check(
            &|bytes, at| bytes.copy_within(at + vertices..at + vertices + 8, at + vertices + 8),
            "found length of a line's piece 0, expected 1",
        );
        check(&|bytes, at| bytes.copy_within(at + lines + 24..at + lines + 32, at + lines + 16), "order of lines");
        let index = 144 + 36 + 32;
        check(&|bytes, _| bytes[index] -= 3, "found length of parts, less whole words, 1, expected 0");
        check(&|bytes, _| bytes[index + 2] = 9, "expected 36 to 280");
        for version in [1, 2] {
            let mut bytes = sample::with_parts();
            bytes[8] = version;
            sample::mend_checksums(&mut bytes);
            assert!(SlmFile::parse(&bytes).is_err(), "version 3 was read as version {version}");
        }
    }

    #[test]
    fn a_file_of_version_3_with_decks_alone_is_refused() {
        // The same load modules have one file only: it is of version 2.
        let error = SlmFile::parse(&sample::with_decks_as_the_only_part()).unwrap_err().to_string();
        assert_eq!(error, "header, offset 8: found parts other than decks 0, expected 1");
    }

    #[test]
    fn a_file_with_decks_is_of_version_2_and_has_the_same_ground() {
        let (plain, bridged) =
            (SlmFile::parse(&sample::file()).unwrap(), SlmFile::parse(&sample::with_decks()).unwrap());
        assert_eq!((plain.header().version, bridged.header().version), (1, 2));
        for (plain, bridged) in plain.modules().iter().zip(bridged.modules()) {
            assert!(plain.decks.is_empty() && !bridged.decks.is_empty());
            assert_eq!(*plain, Module { decks: plain.decks.clone(), ..bridged.clone() });
        }
        let decks = &bridged.module(2, 4).unwrap().decks;
        assert_eq!((decks.vertices.len(), decks.triangles[2], &decks.classes[..]), (8, [2, 3, 5], &[8, 8, 7, 7][..]));
        let levels = SlmFile::parse(&sample::with_one_deck_of_two_levels()).unwrap();
        let has_decks: Vec<bool> = levels.modules.iter().map(|module| !module.decks.is_empty()).collect();
        assert_eq!(has_decks, [false, true, false, false]);
    }

    #[test]
    fn what_checksums_cannot_know_of_decks_is_checked_too() {
        let check = |damage: &dyn Fn(&mut [u8], usize), expected: &str| {
            let mut bytes = sample::with_decks();
            let entry = SlmFile::parse(&bytes).unwrap().index()[1];
            damage(&mut bytes, (entry.offset + u64::from(entry.length)) as usize);
            sample::mend_checksums(&mut bytes);
            let error = SlmFile::parse(&bytes).unwrap_err().to_string();
            assert!(error.contains(expected), "{error:?} does not say {expected:?}");
        };
        let (vertices, triangles, classes) = (20, 20 + 8 * 8, 20 + 8 * 8 + 4 * 6);
        check(&|bytes, at| bytes[at + 4] = 9, "decks of load module 2,4, offset");
        check(&|bytes, at| bytes[at + 8] = 1, "found level 1, expected 0");
        check(&|bytes, at| bytes[at + 12] = 7, "found deck vertex count 7, expected 8");
        check(&|bytes, at| bytes[at + vertices + 1] = 0xff, "found x 65296, expected 0 to 64000");
        check(&|bytes, at| bytes.copy_within(at + vertices..at + vertices + 8, at + vertices + 8), "order of vertices");
        check(&|bytes, at| bytes[at + vertices + 5] = 0x70, "found highest height of decks 28672, expected 5120");
        check(&|bytes, at| bytes[at + triangles] = 8, "found vertex of a triangle 8, expected 0 to 7");
        check(&|bytes, at| bytes.swap(at + triangles + 2, at + triangles + 4), "doubled area of a triangle -");
        check(&|bytes, at| bytes[at + triangles + 8] = 1, "order of triangles");
        check(&|bytes, at| bytes[at + triangles + 10] = 5, "doubled area of a triangle");
        check(&|bytes, at| bytes[at + classes] = 255, "found class of a deck 255, expected 0 to 254");
        // An index that says other things of decks than are there, and a version that is not the file's.
        let index = 144 + 48;
        check(&|bytes, _| bytes[index + 32] = 2, "found deck vertex count 2, expected 3 to 65535");
        check(&|bytes, _| bytes[index + 36] = 0, "found deck triangle count 0, expected 1 to 131070");
        check(&|bytes, _| bytes[index + 32..][..4].fill(0), "found deck triangle count 4, expected 0");
        check(&|bytes, _| bytes[index + 38] = 1, "found length of decks");
        check(&|bytes, _| bytes[index + 41] = 0xff, "found lowest height of decks 65280");
        let mut bytes = sample::file();
        bytes[8] = 2;
        sample::mend_checksums(&mut bytes);
        assert!(SlmFile::parse(&bytes).is_err(), "version 1 was read as version 2");
        let mut bytes = sample::with_decks();
        bytes[8] = 1;
        sample::mend_checksums(&mut bytes);
        assert!(SlmFile::parse(&bytes).is_err(), "version 2 was read as version 1");
    }

    #[test]
    fn a_file_of_version_2_without_a_deck_is_refused() {
        // The same load modules have one file only: it is of version 1.
        let good = sample::with_decks();
        let entries = SlmFile::parse(&good).unwrap().index().to_vec();
        let section = |entry: &IndexEntry| &good[entry.offset as usize..][..entry.length as usize];
        let mut bytes = good[..144 + 2 * 48 + 4].to_vec();
        for (at, entry) in [144, 192].into_iter().zip(&entries) {
            let offset = bytes.len() as u64;
            bytes[at..at + 8].copy_from_slice(&offset.to_le_bytes());
            bytes[at + 32..at + 48].fill(0);
            bytes.extend_from_slice(section(entry));
        }
        let length = bytes.len() as u64;
        bytes[16..24].copy_from_slice(&length.to_le_bytes());
        sample::mend_checksums(&mut bytes);
        let error = SlmFile::parse(&bytes).unwrap_err().to_string();
        assert_eq!(error, "index, offset 144: found decks in some load module 0, expected 1");
    }

    #[test]
    fn every_truncation_is_an_error() {
        for bytes in samples() {
            for length in 0..bytes.len() {
                assert!(SlmFile::parse(&bytes[..length]).is_err(), "the first {length} bytes were accepted");
            }
        }
    }

    #[test]
    fn every_flipped_bit_is_an_error() {
        samples().into_iter().for_each(check_every_flip);
    }

    #[track_caller]
    fn check_every_flip(mut bytes: Vec<u8>) {
        for at in 0..bytes.len() {
            for bit in 0..8 {
                bytes[at] ^= 1 << bit;
                assert!(SlmFile::parse(&bytes).is_err(), "bit {bit} of byte {at} was flipped and accepted");
                bytes[at] ^= 1 << bit;
            }
        }
    }

    #[test]
    fn every_byte_set_to_anything_is_an_error_where_checksums_are_mended() {
        // With the checksums made right again only the checks of meaning are left: none may panic.
        for good in samples() {
            for at in 0..good.len() {
                for value in [0, 1, 0x7f, 0x80, 0xff] {
                    let mut bytes = good.clone();
                    bytes[at] = value;
                    sample::mend_checksums(&mut bytes);
                    let _ = SlmFile::parse(&bytes);
                }
            }
        }
    }

    #[test]
    fn extra_bytes_are_an_error() {
        let mut bytes = sample::file();
        let expected = bytes.len() as u64;
        bytes.push(0);
        let error = SlmFile::parse(&bytes).unwrap_err();
        assert!(matches!(error, ReadError::WrongLength { found, expected: e } if found == e + 1 && e == expected));
    }

    #[test]
    fn another_version_is_named() {
        let mut bytes = sample::file();
        bytes[8] = 4;
        let error = SlmFile::parse(&bytes).unwrap_err();
        assert_eq!(error.to_string(), "header, offset 8: found format version 4, expected 1 to 3");
    }

    #[track_caller]
    fn check_damage(damage: impl FnOnce(&mut [u8], usize), expected: &str) {
        let mut bytes = sample::file();
        let section = SlmFile::parse(&bytes).unwrap().index()[1].offset as usize;
        damage(&mut bytes, section);
        sample::mend_checksums(&mut bytes);
        let error = SlmFile::parse(&bytes).unwrap_err().to_string();
        assert!(error.contains(expected), "{error:?} does not say {expected:?}");
    }

    #[test]
    fn what_checksums_cannot_know_is_checked_too() {
        let triangles = FIXED_AT + 5 * 8;
        check_damage(|bytes, at| bytes[at + 4] = 9, "load module 2,4, offset 340: found column 9, expected 4");
        check_damage(|bytes, at| bytes[at + triangles] = 5, "found vertex of a triangle 5, expected 0 to 4");
        check_damage(|bytes, at| bytes[at + triangles + 2..][..4].copy_from_slice(&[2, 0, 1, 0]), "doubled area");
        check_damage(|bytes, at| bytes[at + triangles + 24] = 1, "found vertex on a side 1, expected 0");
        check_damage(|bytes, at| bytes[at + FIXED_AT + 5] = 90, "highest height");
        check_damage(|bytes, at| bytes[at + FIXED_AT + 3] = 0xff, "found y 65280, expected 0 to 64000");
        check_damage(|bytes, at| bytes[at + 24] = 3, "found length in the index");
        check_damage(|bytes, _| bytes[32] = 2, "header, offset 44: found north 3, expected 1 to 2");
        check_damage(|bytes, at| bytes[at + 8] = 1, "load module 2,4, offset 344: found level 1, expected 0");
        check_damage(|bytes, _| bytes[10] = 0, "header, offset 10: found level count 0, expected 1 to 8");
        check_damage(|bytes, _| bytes[10] = 9, "header, offset 10: found level count 9, expected 1 to 8");
    }

    #[test]
    fn a_level_in_the_place_of_another_is_named() {
        let mut bytes = sample::two_levels();
        let section = SlmFile::parse(&bytes).unwrap().index()[3].offset as usize;
        bytes[section + 8] = 0;
        sample::mend_checksums(&mut bytes);
        let error = SlmFile::parse(&bytes).unwrap_err().to_string();
        assert!(error.starts_with("load module 2,4 at level 1, offset "), "{error}");
        assert!(error.ends_with("found level 0, expected 1"), "{error}");
    }

    const FIXED_AT: usize = crate::FIXED_MODULE_BYTES;

    #[test]
    fn damage_names_the_load_module() {
        let mut bytes = sample::file();
        let last = bytes.len() - 1;
        bytes[last] ^= 1;
        let error = SlmFile::parse(&bytes).unwrap_err();
        assert!(matches!(
            error,
            ReadError::WrongChecksum { section: Section::Module { row: 2, col: 4, level: 0 }, .. }
        ));
    }

    #[test]
    fn a_missing_file_is_named() {
        let error = SlmFile::open("no/such/r00c00.slm").unwrap_err();
        assert!(error.to_string().starts_with("no/such/r00c00.slm: "));
    }
}
