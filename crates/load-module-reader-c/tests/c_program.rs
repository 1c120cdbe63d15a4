//! A program in C, compiled against the header and linked with the static library, asks everything there is to ask.

// A test that unwraps says by its line what failed.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};
use std::process::Command;

use load_module_reader::{Canopy, Corner, ObjectKind, Objects, Prism};

/// The worked example of `docs/FORMAT.md` without a deck, byte by byte.
fn worked_example() -> Vec<u8> {
    example_of_version(1)
}

/// That with a deck.
fn with_a_deck() -> Vec<u8> {
    example_of_version(2)
}

/// That with lines too.
fn with_lines() -> Vec<u8> {
    example_of_version(3)
}

/// That with a tower and a wood too.
fn with_objects() -> Vec<u8> {
    let corner = |x: u16, y: u16, has_wall: bool| Corner { x, y, has_wall };
    let outer = [[51_200, 9_600], [64_000, 9_600], [64_000, 16_000], [51_200, 16_000]];
    let court = [[56_320, 11_000], [56_320, 12_000], [58_000, 12_000], [58_000, 11_000]];
    let tower = Prism {
        id: 7,
        kind: ObjectKind::Tower,
        base: 990 * 128,
        roof: 1020 * 128,
        rings: vec![
            outer.iter().map(|&[x, y]| corner(x, y, [x, y] != outer[1])).collect(),
            court.iter().map(|&[x, y]| corner(x, y, true)).collect(),
        ],
    };
    let wood = Canopy {
        id: 9,
        kind: ObjectKind::Wood,
        height: 15 * 128,
        fullness: 90,
        spacing: 4 * 128,
        places: vec![[6_400, 44_800], [19_200, 44_800], [19_200, 57_600], [6_400, 57_600]],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let part = Objects { prisms: vec![tower], canopies: vec![wood] }.to_part();
    let mut file = with_lines();
    // One more entry in the table of parts, before its checksum, and the part behind the others.
    let (index, parts, table_end) = (144..184, 308, 348);
    let mut entry = [3, part.len() as u32, 0].map(u32::to_le_bytes).concat();
    entry[8..].copy_from_slice(&checksum(&part));
    file.splice(table_end..table_end, entry);
    file[320] = 3;
    seal(&mut file[parts..table_end + 16]);
    file.extend(&part);
    let length = (file.len() - parts) as u32;
    file[176..180].copy_from_slice(&length.to_le_bytes());
    seal(&mut file[index]);
    let length = file.len() as u64;
    file[16..24].copy_from_slice(&length.to_le_bytes());
    seal(&mut file[..144]);
    file
}

fn example_of_version(version: usize) -> Vec<u8> {
    let page = include_str!("../../../docs/FORMAT.md").split("```hex").nth(1).unwrap().split("```").next().unwrap();
    let (deck, lines) = (include_str!("../../../docs/format/deck.hex"), include_str!("../../../docs/format/lines.hex"));
    let hex = [page, deck, lines][version - 1];
    let lines = hex.lines().filter_map(|line| line.split('|').next());
    // The first number of a line is its offset.
    lines.flat_map(|line| line.split_whitespace().skip(1)).map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

/// The same load module at two levels, the coarser one a metre higher.
fn two_levels() -> Vec<u8> {
    let one = worked_example();
    let (header, entry, section) = (144, 32, 124);
    let mut file = one[..header + entry].to_vec();
    file.extend_from_slice(&one[header..header + entry + 4]);
    for level in 0..2u8 {
        file.extend_from_slice(&one[header + entry + 4..]);
        let start = file.len() - section;
        file[start + 8] = level;
        for vertex in 0..4 {
            let at = start + 56 + 8 * vertex + 4;
            raise(&mut file[at..at + 4], 128 * i32::from(level));
        }
        seal(&mut file[start..]);
    }
    file[10] = 2;
    let length = file.len() as u64;
    file[16..24].copy_from_slice(&length.to_le_bytes());
    seal(&mut file[..header]);
    for level in 0..2 {
        let at = header + entry * level;
        let offset = header + 2 * entry + 4 + section * level;
        file[at..at + 8].copy_from_slice(&(offset as u64).to_le_bytes());
        raise(&mut file[at + 24..at + 28], 128 * level as i32);
        raise(&mut file[at + 28..at + 32], 128 * level as i32);
    }
    seal(&mut file[header..header + 2 * entry + 4]);
    file
}

fn raise(bytes: &mut [u8], by: i32) {
    let number = i32::from_le_bytes(bytes.try_into().unwrap()) + by;
    bytes.copy_from_slice(&number.to_le_bytes());
}

/// Puts the CRC-32 of what is before them into the last four bytes.
fn seal(part: &mut [u8]) {
    let (body, last) = part.split_last_chunk_mut::<4>().unwrap();
    *last = checksum(body);
}

fn checksum(body: &[u8]) -> [u8; 4] {
    let bit = |sum: u32| if sum & 1 == 1 { sum >> 1 ^ 0xedb8_8320 } else { sum >> 1 };
    let sum = body.iter().fold(u32::MAX, |sum, &byte| (0..8).fold(sum ^ u32::from(byte), |sum, _| bit(sum)));
    (!sum).to_le_bytes()
}

/// The static library of this crate, newest first: it lies beside the tests, or one folder up.
fn library() -> PathBuf {
    let exe = std::env::current_exe().unwrap();
    let deps = exe.parent().unwrap();
    let ours = |path: &PathBuf| {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        name.starts_with("libload_module_reader_c") && name.ends_with(".a")
    };
    let entries = [deps, deps.parent().unwrap()].into_iter().flat_map(|dir| std::fs::read_dir(dir).unwrap());
    let found = entries.map(|entry| entry.unwrap().path()).filter(ours);
    found.max_by_key(|path| path.metadata().unwrap().modified().unwrap()).expect("cargo has built the static library")
}

/// Compiles a program of this folder with some flags of its own; what the compiler says when it cannot.
fn compile(source: &str, flags: &[&str], program: &Path) -> Result<(), String> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let compiler = std::env::var("CC").unwrap_or_else(|_| "cc".into());
    let compiled = Command::new(compiler)
        .args(["-Wall", "-Wextra", "-Werror"])
        .args(flags)
        .arg("-I")
        .arg(here.join("include"))
        .arg(here.join("tests").join(source))
        .arg(library())
        .args(["-lpthread", "-ldl", "-lm", "-o"])
        .arg(program)
        .output()
        .unwrap();
    if compiled.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&compiled.stderr).into_owned()) }
}

#[test]
fn a_program_in_c_gets_right_answers() {
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("drive");
    compile("drive.c", &["-std=c99", "-pedantic"], &program).unwrap();
    let files = [
        ("1", "0", worked_example()),
        ("2", "0", two_levels()),
        ("1", "1", with_a_deck()),
        ("1", "2", with_lines()),
        ("1", "3", with_objects()),
    ];
    for (levels, decks, file) in files {
        let area = folder.path().join(format!("{levels}-{decks}"));
        std::fs::create_dir_all(area.join("modules")).unwrap();
        std::fs::write(area.join("modules/r00c00.slm"), file).unwrap();
        let ran = Command::new(&program).arg(&area).args([levels, decks]).output().unwrap();
        let said = String::from_utf8_lossy(&ran.stdout);
        assert!(ran.status.success() && said == "0 faults\n", "{said}{}", String::from_utf8_lossy(&ran.stderr));
    }
}

#[test]
fn the_example_of_the_book_compiles_and_runs() {
    let page = include_str!("../../../docs/guides/simulators.md");
    let block = page.split("```c\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (source, program) = (folder.path().join("follow.c"), folder.path().join("follow"));
    std::fs::write(&source, block).unwrap();
    compile(source.to_str().unwrap(), &["-std=c99", "-pedantic"], &program).unwrap();
    let run = || Command::new(&program).current_dir(&folder).output().unwrap();
    // Without a database it says so.
    assert_eq!(run().status.code(), Some(2));
    std::fs::create_dir_all(folder.path().join("mine.tdb/modules")).unwrap();
    std::fs::write(folder.path().join("mine.tdb/modules/r00c00.slm"), worked_example()).unwrap();
    assert!(run().status.success());
}

#[test]
fn damaged_files_and_hostile_arguments_do_no_harm() {
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("fuzz");
    let sanitized = ["-std=gnu99", "-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=undefined"];
    if let Err(why) = compile("fuzz.c", &sanitized, &program) {
        eprintln!("skipped the sanitizers, which this compiler has not: {why}");
        compile("fuzz.c", &["-std=gnu99", "-O1"], &program).unwrap();
    }
    let run = |seeds: &Path, more: &[&str]| {
        let mut command = Command::new(&program);
        // More memory than this is more than any of these files holds.
        command.env("ASAN_OPTIONS", "hard_rss_limit_mb=1024").arg(seeds).arg(folder.path().join("work")).args(more);
        let ran = command.output().unwrap();
        assert!(ran.status.success(), "{seeds:?} {more:?}: {}", String::from_utf8_lossy(&ran.stderr));
    };
    run(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/findings"), &[]);
    let seeds = folder.path().join("seeds");
    std::fs::create_dir(&seeds).unwrap();
    std::fs::write(seeds.join("one.slm"), worked_example()).unwrap();
    std::fs::write(seeds.join("two.slm"), two_levels()).unwrap();
    std::fs::write(seeds.join("deck.slm"), with_a_deck()).unwrap();
    std::fs::write(seeds.join("objects.slm"), with_objects()).unwrap();
    let (first, last, seconds) = ("1", "400", "3");
    run(&seeds, &[first, seconds, last]);
}
