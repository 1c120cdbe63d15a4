#!/usr/bin/env python3
"""Writes files to begin fuzzing from: load modules, which are the worked examples of FORMAT.md, without a deck, with
one and with lines, at one to eight levels; or Shapefiles, in one piece with what lies beside them.

    python3 scripts/fuzz_seeds.py docs/FORMAT.md fuzz/corpus/module_file
    python3 scripts/fuzz_seeds.py shapefiles fuzz/corpus/shapefiles
"""

import pathlib
import struct
import sys
import zlib

HEADER, SECTION = 144, 124
# Bytes of an entry of the index by version, and of what follows the section.
ENTRIES, BEHIND = {1: 32, 2: 48, 3: 36}, {1: 0, 2: 72, 3: 156}
# Bytes of the table of parts in version 3.
TABLE = 44


def sealed(part):
    """The part with the checksum of what is before its last four bytes in these."""
    return part[:-4] + struct.pack("<I", zlib.crc32(part[:-4]))


def worked_example(page, version):
    """The bytes of an example: of version 1 on the page, of versions 2 and 3 in files beside it."""
    path = [page, page.parent / "format" / "deck.hex", page.parent / "format" / "lines.hex"][version - 1]
    block = path.read_text().split("```hex\n")[-1].split("```")[0]
    words = (line.split("|")[0].split()[1:] for line in block.splitlines())
    return bytes(int(word, 16) for line in words for word in line)


def with_levels(example, count):
    """The file of the example with its load module at so many levels, all alike."""
    size = ENTRIES[example[8]]
    header, entry = bytearray(example[:HEADER]), example[HEADER : HEADER + size]
    both = example[HEADER + size + 4 :]
    assert len(both) == SECTION + BEHIND[example[8]]
    tables = {1: [], 2: [both[SECTION:]], 3: [both[SECTION : SECTION + TABLE]]}[example[8]]
    bare = both[SECTION + TABLE :] if example[8] == 3 else b""
    first = HEADER + count * size + 4
    struct.pack_into("<H", header, 10, count)
    struct.pack_into("<Q", header, 16, first + count * len(both))
    entries = [struct.pack("<Q", first + level * len(both)) + entry[8:] for level in range(count)]
    sections = [
        b"".join(sealed(part[:8] + struct.pack("<I", level) + part[12:]) for part in [both[:SECTION], *tables]) + bare
        for level in range(count)
    ]
    return sealed(bytes(header)) + sealed(b"".join(entries) + bytes(4)) + b"".join(sections)


def record(kind, parts):
    """The content of a record: its parts, all of them with heights where the kind has some."""
    points = [point for part in parts for point in part]
    starts = [sum(len(part) for part in parts[:at]) for at in range(len(parts))]
    body = struct.pack("<I32xII", kind, len(parts), len(points)) + struct.pack(f"<{len(starts)}I", *starts)
    body += b"".join(struct.pack("<2d", *point) for point in points)
    return body + (struct.pack(f"<{2 + len(points)}d", 0, 9, *range(len(points))) if kind in (13, 15) else b"")


def shapefile(records, columns, row, with_index=True):
    """The lengths of the shapes and of their index, these two, and their table."""
    head = struct.pack(">I", 9994) + bytes(96)
    shapes, index = head, head
    for number, content in enumerate(records):
        index += struct.pack(">II", len(shapes) // 2, len(content) // 2)
        shapes += struct.pack(">II", number + 1, len(content) // 2) + content
    fields = b"".join(struct.pack("<11sc4xB15x", name, kind, size) for name, kind, size in columns)
    row_bytes = 1 + sum(size for _, _, size in columns)
    table = struct.pack("<B3xIHH20x", 3, len(records), 33 + len(fields), row_bytes) + fields + b"\r"
    table += row.ljust(row_bytes)[:row_bytes] * len(records) if columns else b""
    index = index if with_index else b""
    return struct.pack("<II", len(shapes), len(index)) + shapes + index + (table if columns else b"")


def write_shapefiles(folder):
    ring = [(500000, 3870000), (500000, 3871000), (501000, 3871000), (500000, 3870000)]
    hole = [(500100, 3870500), (500200, 3870600), (500100, 3870600), (500100, 3870500)]
    places = [(-117, 35), (-116.99, 35.01), (-116.98, 35)]
    highway = [(b"highway", b"C", 9), (b"lanes", b"N", 2), (b"oneway", b"L", 1)]
    for name, content in {
        "lines": shapefile([record(3, [places])] * 2, highway, b" primary  2T"),
        "heights": shapefile([record(13, [ring, hole])], highway, b" track    *F"),
        "rings": shapefile([record(5, [ring, hole]), record(5, [ring])], [(b"natural", b"C", 5)], b" water"),
        "rings-with-heights": shapefile([record(15, [ring])], [(b"other_tags", b"C", 40)], b' "natural"=>"water"'),
        "in-sequence": shapefile([record(3, [places[:2], places[1:]]), bytes(4)], [], b"", with_index=False),
        "points": shapefile([struct.pack("<I2d", 1, 500000, 3870000)], [], b""),
    }.items():
        (folder / name).write_bytes(content)


def main():
    folder = pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    if sys.argv[1] == "shapefiles":
        write_shapefiles(folder)
        return
    page = pathlib.Path(sys.argv[1])
    for version, name in ((1, "levels"), (2, "decks"), (3, "lines")):
        example = worked_example(page, version)
        assert with_levels(example, 1) == example, "one level is the example itself"
        for count in range(1, 9):
            (folder / f"{name}-{count}.slm").write_bytes(with_levels(example, count))


if __name__ == "__main__":
    main()
