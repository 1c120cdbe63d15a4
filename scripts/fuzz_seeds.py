#!/usr/bin/env python3
"""Writes load-module files to begin fuzzing from: the worked example of FORMAT.md, and the same at one to eight levels.

    python3 scripts/fuzz_seeds.py FORMAT.md fuzz/corpus/module_file
"""

import pathlib
import struct
import sys
import zlib

HEADER, ENTRY, SECTION = 144, 32, 124


def sealed(part):
    """The part with the checksum of what is before its last four bytes in these."""
    return part[:-4] + struct.pack("<I", zlib.crc32(part[:-4]))


def worked_example(page):
    block = page.split("```hex\n")[1].split("```")[0]
    words = (line.split("|")[0].split()[1:] for line in block.splitlines())
    return bytes(int(word, 16) for line in words for word in line)


def with_levels(example, count):
    """The file of the example with its load module at so many levels, all alike."""
    header, entry = bytearray(example[:HEADER]), example[HEADER : HEADER + ENTRY]
    section = example[HEADER + ENTRY + 4 :]
    first = HEADER + count * ENTRY + 4
    struct.pack_into("<H", header, 10, count)
    struct.pack_into("<Q", header, 16, first + count * SECTION)
    entries = [struct.pack("<Q", first + level * SECTION) + entry[8:] for level in range(count)]
    sections = [sealed(section[:8] + struct.pack("<I", level) + section[12:]) for level in range(count)]
    return sealed(bytes(header)) + sealed(b"".join(entries) + bytes(4)) + b"".join(sections)


def main():
    page, folder = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    example = worked_example(page.read_text())
    assert with_levels(example, 1) == example, "one level is the example itself"
    folder.mkdir(parents=True, exist_ok=True)
    for count in range(1, 9):
        (folder / f"levels-{count}.slm").write_bytes(with_levels(example, count))


if __name__ == "__main__":
    main()
