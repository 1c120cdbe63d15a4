#!/usr/bin/env python3
"""Writes load-module files to begin fuzzing from: the worked examples of FORMAT.md, without a deck, with one and with
lines, at one to eight levels.

    python3 scripts/fuzz_seeds.py docs/FORMAT.md fuzz/corpus/module_file
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
    block = page.split("```hex\n")[version].split("```")[0]
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


def main():
    page, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    for version, name in ((1, "levels"), (2, "decks"), (3, "lines")):
        example = worked_example(page.read_text(), version)
        assert with_levels(example, 1) == example, "one level is the example itself"
        for count in range(1, 9):
            (folder / f"{name}-{count}.slm").write_bytes(with_levels(example, count))


if __name__ == "__main__":
    main()
