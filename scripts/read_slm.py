#!/usr/bin/env python3
"""Reads a load-module file, as FORMAT.md describes it: prints a summary, everything as JSON, or the heights at a place.

    python3 scripts/read_slm.py ntc.tdb/modules/r00c00.slm
    python3 scripts/read_slm.py --json ntc.tdb/modules/r00c00.slm
    python3 scripts/read_slm.py --at 505250 3875250 ntc.tdb/modules/r00c00.slm
    python3 scripts/read_slm.py --at 505250 3875250 --ceiling 1005 ntc.tdb/modules/r00c00.slm

Written from that page alone, with nothing but the standard library, to show that the page is enough.
Exit codes: 0 read, 1 nothing at that place, 2 damaged or unreadable.
"""

import argparse
import collections
import json
import math
import struct
import sys
import zlib

MAGIC = b"\x89SLM\r\n\x1a\n"
VERSIONS = [1, 2, 3]
FIXED_HEADER_BYTES = 124
ENTRY = struct.Struct("<QIIIIii")
DECK_ENTRY = struct.Struct("<IIii")
SECTION = struct.Struct("<IIIIII4HIIQQ")
DECKS = struct.Struct("<IIIII")
TABLE = struct.Struct("<IIII")
PART = struct.Struct("<III")
LINE = struct.Struct("<BBBBHH")
LINE_KINDS = ["travelled", "channel", "breakline"]
LINE_FORMS = ["nothing", "line", "strip", "bench"]
STOREYS = ["ground", "bridge", "tunnel"]
PRISM = struct.Struct("<QiiBBH")
CANOPY = struct.Struct("<QIBBHHH")
OBJECT_KINDS = ["building", "tower", "wall", "wood", "scrub", "orchard", "row"]
SIDES = ["south", "east", "north", "west"]


class Damaged(Exception):
    """The file is not as docs/FORMAT.md says."""


def expect(holds, part, what):
    if not holds:
        raise Damaged(f"{part}: {what}")


def checked(data, start, length, part):
    """The part of `data` that ends with its checksum, without the checksum."""
    expect(4 <= length and start + length <= len(data), part, f"{length} bytes at {start} of a file of {len(data)}")
    body = data[start : start + length - 4]
    (stored,) = struct.unpack_from("<I", data, start + length - 4)
    found = zlib.crc32(body)
    expect(found == stored, part, f"found checksum {found:08x}, expected {stored:08x}")
    return body


def padded(length):
    return (length + 3) // 4 * 4


def parse(data):
    """The header, and the load modules at every level, in the order of the file."""
    header, header_length = parse_header(data)
    (south, north), (west, east) = header["rows"], header["columns"]
    places = [(row, column) for row in range(south, north) for column in range(west, east)]
    places = [(level, place) for level in range(header["levels"]) for place in places]
    version, each = header["version"], entry_bytes(header)
    index_length = each * len(places) + 4
    index = checked(data, header_length, index_length, "index")
    end = header_length + index_length
    modules = []
    for number, (level, place) in enumerate(places):
        entry = ENTRY.unpack_from(index, each * number)
        expect(entry[0] == end, "index", f"load module {place} begins at {entry[0]}, expected {end}")
        module = parse_module(data, header["side"], level, place, entry)
        end += entry[1]
        if version == 2:
            deck_entry = DECK_ENTRY.unpack_from(index, each * number + ENTRY.size)
            module["decks"], length = parse_decks(data, header["side"], level, place, deck_entry, end)
            end += length
        if version == 3:
            (length,) = struct.unpack_from("<I", index, each * number + ENTRY.size)
            module.update(parse_parts(data, header["side"], level, place, end, length))
            end += length
        modules.append(module)
    expect(end == len(data), "index", f"sections end at {end} of a file of {len(data)}")
    any_decks = any(module.get("decks", {}).get("triangles") for module in modules)
    expect(any_decks or version != 2, "index", "found no decks in a file of version 2")
    others = any(module.get("lines") or module.get("objects") or module.get("unknown_parts") for module in modules)
    expect(others or version != 3, "index", "found no part other than decks in a file of version 3")
    return header, modules


def entry_bytes(header):
    """Bytes of an entry of the index."""
    return ENTRY.size + {1: 0, 2: DECK_ENTRY.size, 3: 4}[header["version"]]


def parse_header(data):
    part = "header"
    expect(FIXED_HEADER_BYTES <= len(data), part, f"found {len(data)} bytes, expected {FIXED_HEADER_BYTES} or more")
    expect(data[:8] == MAGIC, part, f"found {data[:8].hex(' ')}, expected {MAGIC.hex(' ')}")
    version, levels, length, file_length = struct.unpack_from("<HHIQ", data, 8)
    expect(version in VERSIONS, part, f"found version {version}, expected one of {VERSIONS}")
    expect(FIXED_HEADER_BYTES + 4 <= length, part, f"found header length {length}")
    body = checked(data, 0, length, part)
    expect(1 <= levels <= 8, part, f"found {levels} levels, expected 1 to 8")
    expect(file_length == len(data), part, f"found {len(data)} bytes, expected {file_length}")
    tile_row, tile_column, area_rows, area_columns = struct.unpack_from("<4I", body, 24)
    south, north, west, east = struct.unpack_from("<4I", body, 40)
    expect(south < north <= area_rows, part, f"rows {south} to {north} of {area_rows}")
    expect(west < east <= area_columns, part, f"columns {west} to {east} of {area_columns}")
    side, cells, spacing, quanta = struct.unpack_from("<4I", body, 56)
    expect(side == cells * spacing * 8 and 0 < side < 65536, part, f"side {side} of {cells} cells of {spacing}")
    expect(quanta == 128, part, f"found {quanta} quanta per metre, expected 128")
    origin = struct.unpack_from("<2d", body, 72)
    expect(all(map(math.isfinite, origin)), part, f"origin {origin}")
    crs_length, datum_length = struct.unpack_from("<2H", body, 88)
    texts_end = FIXED_HEADER_BYTES + crs_length + datum_length
    expect(len(body) == padded(texts_end) and not any(body[texts_end:]), part, f"texts end at {texts_end}")
    texts = body[FIXED_HEADER_BYTES:texts_end]
    try:
        crs, datum = texts[:crs_length].decode(), texts[crs_length:].decode()
    except UnicodeDecodeError as error:
        raise Damaged(f"{part}: {error}") from error
    return {
        "version": version,
        "levels": levels,
        "tile": [tile_row, tile_column],
        "area_modules": [area_rows, area_columns],
        "rows": [south, north],
        "columns": [west, east],
        "side": side,
        "side_cells": cells,
        "spacing_m": spacing / 16,
        "origin_m": list(origin),
        "crs": crs,
        "vertical_datum": datum,
        "fingerprint": body[92:124].hex(),
    }, length


def parse_module(data, side, level, place, entry):
    part = f"load module {place[0]},{place[1]}" + (f" at level {level}" if level else "")
    offset, length, vertex_count, triangle_count, polygons, lowest, highest = entry
    body = checked(data, offset, length, part)
    expect(SECTION.size <= len(body), part, f"found a section of {length} bytes")
    row, column, found, *counts = SECTION.unpack_from(body)
    expect((row, column, found) == (*place, level), part, f"found row {row}, column {column}, level {found}")
    expect(tuple(counts[:3]) == (vertex_count, triangle_count, polygons), part, f"found counts {counts[:3]}")
    expect(4 <= vertex_count <= 65535 and 1 <= polygons <= triangle_count, part, f"found counts {counts[:3]}")
    side_counts, residual = counts[3:7], counts[7:]
    triangles_at = SECTION.size + 8 * vertex_count
    sides_at = triangles_at + 6 * triangle_count
    classes_at = sides_at + 2 * sum(side_counts)
    end = classes_at + triangle_count
    expect(len(body) == padded(end) and not any(body[end:]), part, f"found {len(body)} bytes, expected {padded(end)}")
    vertices = list(struct.iter_unpack("<HHi", body[SECTION.size : triangles_at]))
    triangles = list(struct.iter_unpack("<3H", body[triangles_at:sides_at]))
    on_sides = list(struct.unpack(f"<{sum(side_counts)}H", body[sides_at:classes_at]))
    sides = {}
    for name, count in zip(SIDES, side_counts):
        sides[name], on_sides = on_sides[:count], on_sides[count:]
    check_vertices(vertices, side, (lowest, highest), part)
    check_triangles(triangles, vertices, side, part)
    check_sides(sides, vertices, side, part)
    return {
        "row": row,
        "column": column,
        "level": level,
        "polygons": polygons,
        "residual": dict(zip(["posts", "largest", "sum_abs", "sum_squared"], residual)),
        "vertices": vertices,
        "triangles": triangles,
        "sides": sides,
        "classes": list(body[classes_at:end]),
    }


def parse_decks(data, side, level, place, entry, start):
    """The decks of a load module, and the bytes of their part, which begins at `start`."""
    vertex_count, triangle_count, lowest, highest = entry
    if vertex_count == 0:
        expect(entry == (0, 0, 0, 0), "index", f"found decks {entry} of load module {place}")
        return {"vertices": [], "triangles": [], "classes": []}, 0
    part = f"decks of load module {place[0]},{place[1]}" + (f" at level {level}" if level else "")
    expect(3 <= vertex_count <= 65535 and 1 <= triangle_count <= 131070, part, f"found counts {entry[:2]}")
    triangles_at = DECKS.size + 8 * vertex_count
    classes_at = triangles_at + 6 * triangle_count
    end = classes_at + triangle_count
    length = padded(end) + 4
    body = checked(data, start, length, part)
    found = DECKS.unpack_from(body)
    expect(found == (*place, level, vertex_count, triangle_count), part, f"found {found}")
    expect(not any(body[end:]), part, "padding is not zero")
    decks = checked_decks(body, side, DECKS.size, (vertex_count, triangle_count), part)
    heights = (min(z for _, _, z in decks["vertices"]), max(z for _, _, z in decks["vertices"]))
    expect(heights == (lowest, highest), part, f"found heights {heights}, expected {(lowest, highest)}")
    return decks, length


def checked_decks(body, side, start, counts, part):
    """The decks whose lists begin at `start` of a part."""
    triangles_at = start + 8 * counts[0]
    classes_at = triangles_at + 6 * counts[1]
    vertices = list(struct.iter_unpack("<HHi", body[start:triangles_at]))
    triangles = list(struct.iter_unpack("<3H", body[triangles_at:classes_at]))
    classes = list(body[classes_at : classes_at + counts[1]])
    places = [(y, x, z) for x, y, z in vertices]
    expect(all(max(x, y) <= side for x, y, _ in vertices), part, "a vertex lies outside the square")
    expect(all(a < b for a, b in zip(places, places[1:])), part, "vertices are not sorted")
    doubled_area(triangles, vertices, part)
    used = {corner for triangle in triangles for corner in triangle}
    expect(used == set(range(counts[0])), part, "a vertex belongs to no triangle")
    expect(max(classes) < 255, part, "a deck has the class of holes")
    return {"vertices": vertices, "triangles": triangles, "classes": classes}


def parse_parts(data, side, level, place, start, length):
    """The parts of a load module, so many bytes from `start` on: decks, lines, objects, kinds that are not known."""
    found = {"decks": {"vertices": [], "triangles": [], "classes": []}, "lines": [], "objects": [], "unknown_parts": []}
    if length == 0:
        return found
    of = f"load module {place[0]},{place[1]}" + (f" at level {level}" if level else "")
    expect(36 <= length and start + length <= len(data), "index", f"found {length} bytes of parts of {of}")
    row, column, found_level, count = TABLE.unpack_from(data, start)
    table_bytes = TABLE.size + PART.size * count + 4
    expect(1 <= count and table_bytes < length, f"parts of {of}", f"found {count} parts in {length} bytes")
    table = checked(data, start, table_bytes, f"parts of {of}")
    expect((row, column, found_level) == (*place, level), f"parts of {of}", f"found {(row, column, found_level)}")
    at, last = start + table_bytes, 0
    for kind, bytes_of_part, checksum in PART.iter_unpack(table[TABLE.size :]):
        part = {1: "decks of ", 2: "lines of ", 3: "objects of "}.get(kind, f"part {kind} of ") + of
        expect(last < kind, part, f"found kind {kind} behind {last}")
        expect(4 <= bytes_of_part and bytes_of_part % 4 == 0, part, f"found a length of {bytes_of_part}")
        expect(at + bytes_of_part <= start + length, part, f"found a length of {bytes_of_part}")
        body = data[at : at + bytes_of_part]
        expect(zlib.crc32(body) == checksum, part, f"found checksum {zlib.crc32(body):08x}, expected {checksum:08x}")
        if kind == 1:
            found["decks"] = parse_deck_part(body, side, part)
        elif kind == 2:
            found["lines"] = parse_lines(body, side, part)
        elif kind == 3:
            found["objects"] = parse_objects(body, side, part)
        else:
            found["unknown_parts"].append(kind)
        at, last = at + bytes_of_part, kind
    expect(at == start + length, f"parts of {of}", f"parts end at {at}, expected {start + length}")
    return found


def parse_deck_part(body, side, part):
    expect(8 <= len(body), part, f"found {len(body)} bytes")
    counts = struct.unpack_from("<II", body)
    expect(3 <= counts[0] <= 65535 and 1 <= counts[1] <= 131070, part, f"found counts {counts}")
    end = 8 + 8 * counts[0] + 7 * counts[1]
    expect(len(body) == padded(end) and not any(body[end:]), part, f"found {len(body)} bytes, expected {padded(end)}")
    return checked_decks(body, side, 8, counts, part)


def parse_lines(body, side, part):
    expect(8 <= len(body), part, f"found {len(body)} bytes")
    line_count, vertex_count = struct.unpack_from("<II", body)
    expect(1 <= line_count and len(body) == 8 + 8 * (line_count + vertex_count), part, f"found {len(body)} bytes")
    vertices_at = 8 + LINE.size * line_count
    vertices = list(struct.iter_unpack("<HHi", body[vertices_at:]))
    records = list(LINE.iter_unpack(body[8:vertices_at]))
    expect(sum(record[-1] for record in records) == vertex_count, part, "lines have other vertices than the part")
    lines, keys = [], []
    for kind_of_class, kind, form, flags, width, count in records:
        expect(kind_of_class < 255 and kind < 3 and form < 4 and flags < 12 and 2 <= count, part, "found no such line")
        kept, in_ground, storey = bool(flags & 1), bool(flags & 2), flags >> 2
        expect(not in_ground or (kept and storey == 0), part, "a line is in the ground and left out")
        expect(form == 0 or in_ground or (kept and storey == 1), part, "a line has a form and is nowhere")
        own, vertices = vertices[:count], vertices[count:]
        expect(all(max(x, y) <= side for x, y, _ in own), part, "a vertex lies outside the square")
        expect(all(a[:2] != b[:2] for a, b in zip(own, own[1:])), part, "two neighbours lie at one place")
        places = [(y, x, z) for x, y, z in own]
        keys.append((kind_of_class, kind, form, storey, kept, in_ground, width, places))
        lines.append({
            "class": kind_of_class,
            "kind": LINE_KINDS[kind],
            "form": LINE_FORMS[form],
            "storey": STOREYS[storey],
            "kept": kept,
            "in_ground": in_ground,
            "width": width,
            "vertices": own,
        })
    expect(all(a < b for a, b in zip(keys, keys[1:])), part, "lines are not sorted")
    return lines


def parse_objects(body, side, part):
    """Prisms, then canopies."""
    expect(24 <= len(body), part, f"found {len(body)} bytes")
    counts = struct.unpack_from("<6I", body)
    prisms, canopies, rings, corners, places, triangles = counts
    sizes = [PRISM.size * prisms, CANOPY.size * canopies, 4 * corners, 4 * places, 2 * rings, 6 * triangles, corners]
    end = 24 + sum(sizes)
    expect(prisms + canopies and len(body) == padded(end), part, f"found {len(body)} bytes, expected {padded(end)}")
    expect(not any(body[end:]), part, "padding is not zero")
    lists, at = [], 24
    for size in sizes:
        lists.append(body[at : at + size])
        at += size
    records = list(PRISM.iter_unpack(lists[0])), list(CANOPY.iter_unpack(lists[1]))
    corners, places = (list(struct.iter_unpack("<HH", some)) for some in lists[2:4])
    lengths = list(struct.unpack(f"<{rings}H", lists[4]))
    triangles, walls = list(struct.iter_unpack("<3H", lists[5])), list(lists[6])
    expect(all(max(place) <= side for place in corners + places), part, "a place lies outside the square")
    expect(sum(record[5] for record in records[0]) == rings and sum(lengths) == len(corners), part, "rings")
    expect(sum(record[6] for record in records[1]) == len(places), part, "places of canopies")
    expect(sum(record[1] for record in records[1]) == len(triangles), part, "triangles of canopies")
    return prisms_of(records[0], lengths, corners, walls, part) + canopies_of(records[1], places, triangles, part)


def prisms_of(records, lengths, corners, walls, part):
    prisms, keys = [], []
    for number, base, roof, kind, zero, count in records:
        expect(kind < 3 and zero == 0 and base < roof and 1 <= count, part, f"found no such prism: {number}")
        own, lengths = lengths[:count], lengths[count:]
        rings = []
        for length in own:
            ring = [(x, y, bool(wall)) for (x, y), wall in zip(corners[:length], walls)]
            area = sum(a[0] * b[1] - a[1] * b[0] for a, b in zip(ring, ring[1:] + ring[:1]))
            expect(3 <= length and (0 < area) == (not rings) and area, part, "a ring runs the wrong way")
            rings.append(ring)
            corners, walls = corners[length:], walls[length:]
        keys.append((number, kind, base, roof, rings))
        prisms.append({"id": number, "kind": OBJECT_KINDS[kind], "base": base, "roof": roof, "rings": rings})
    expect(all(a < b for a, b in zip(keys, keys[1:])), part, "prisms are not sorted")
    return prisms


def canopies_of(records, places, triangles, part):
    canopies, keys = [], []
    for number, count, kind, fullness, height, spacing, place_count in records:
        sound = 3 <= kind < 7 and 1 <= fullness <= 99 and height and spacing and 3 <= place_count and count
        expect(sound, part, f"found no such canopy: {number}")
        own, places = places[:place_count], places[place_count:]
        faces, triangles = triangles[:count], triangles[count:]
        for face in faces:
            expect(max(face) < place_count, part, f"triangle {face} names a place of {place_count}")
            a, b, c = (own[index] for index in face)
            area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            expect(0 < area, part, f"triangle {face} is not counter-clockwise")
        keys.append((number, kind, height, fullness, spacing, own, faces))
        canopies.append({
            "id": number,
            "kind": OBJECT_KINDS[kind],
            "height": height,
            "fullness": fullness,
            "spacing": spacing,
            "places": own,
            "triangles": faces,
        })
    expect(all(a < b for a, b in zip(keys, keys[1:])), part, "canopies are not sorted")
    return canopies


def check_vertices(vertices, side, heights, part):
    places = [(y, x) for x, y, _ in vertices]
    expect(all(max(place) <= side for place in places), part, "a vertex lies outside the square")
    expect(all(a < b for a, b in zip(places, places[1:])), part, "vertices are not sorted")
    found = (min(z for _, _, z in vertices), max(z for _, _, z in vertices))
    expect(found == heights, part, f"found heights {found}, expected {heights}")


def check_triangles(triangles, vertices, side, part):
    total = doubled_area(triangles, vertices, part)
    expect(total == 2 * side * side, part, f"found doubled area {total}, expected {2 * side * side}")
    edges = collections.Counter(edge for a, b, c in triangles for edge in ((a, b), (b, c), (c, a)))
    for (a, b), count in edges.items():
        ends = list(zip(vertices[a], vertices[b]))[:2]
        is_side = any(found == (line, line) for found in ends for line in (0, side))
        expect(is_side or edges[b, a] == count, part, f"the edge from vertex {a} to {b} is torn")


def doubled_area(triangles, vertices, part):
    """Of all triangles, each counter-clockwise and in order."""
    total = 0
    for triangle in triangles:
        expect(max(triangle) < len(vertices), part, f"triangle {triangle} names a vertex of {len(vertices)}")
        expect(triangle[0] < min(triangle[1:]), part, f"triangle {triangle} does not begin with its smallest vertex")
        (ax, ay, _), (bx, by, _), (cx, cy, _) = (vertices[corner] for corner in triangle)
        doubled = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        expect(0 < doubled, part, f"triangle {triangle} is not counter-clockwise")
        total += doubled
    expect(all(a < b for a, b in zip(triangles, triangles[1:])), part, "triangles are not sorted")
    return total


def check_sides(sides, vertices, side, part):
    lies_on = {
        "south": lambda x, y: y == 0,
        "east": lambda x, y: x == side,
        "north": lambda x, y: y == side,
        "west": lambda x, y: x == 0,
    }
    for name, found in sides.items():
        expected = [index for index, (x, y, _) in enumerate(vertices) if lies_on[name](x, y)]
        expect(found == expected, part, f"found {name}ern side {found}, expected {expected}")


def surfaces_at(header, modules, east, north):
    """What lies at a place, at the finest level: (height in metres, class, "ground" or "deck"), the ground first."""
    place = [(metres - origin) * 128 for metres, origin in zip((east, north), header["origin_m"])]
    found = []
    for module in modules:
        x, y = place[0] - module["column"] * header["side"], place[1] - module["row"] * header["side"]
        if module["level"] or not (0 <= x <= header["side"] and 0 <= y <= header["side"]) or found:
            continue
        ground = [(height, kind, "ground") for height, kind in heights_in(module, x, y)][:1]
        found = ground + [(height, kind, "deck") for height, kind in heights_in(module.get("decks"), x, y)]
    return found


def heights_in(mesh, x, y):
    """Height in metres and class of every triangle of a mesh that holds a place in quanta."""
    for triangle, kind in zip(mesh["triangles"], mesh["classes"]) if mesh else []:
        a, b, c = (mesh["vertices"][corner] for corner in triangle)
        shares = [(q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) for p, q in ((b, c), (c, a), (a, b))]
        if min(shares) >= 0:
            yield sum(share * corner[2] for share, corner in zip(shares, (a, b, c))) / sum(shares) / 128, kind


def surface_below(header, modules, east, north, ceiling=math.inf):
    """The topmost of ground and decks at a place that is not above a height in metres; a deck before ground."""
    below = [surface for surface in surfaces_at(header, modules, east, north) if surface[0] <= ceiling]
    return max(below, key=lambda surface: (surface[0], surface[2] == "deck"), default=None)


def summary(header, modules):
    finest = [module for module in modules if module["level"] == 0]
    triangles = [len(module["triangles"]) for module in finest]
    (south, north), (west, east) = header["rows"], header["columns"]
    lines = [
        f"tile           {header['tile'][0]},{header['tile'][1]}",
        f"crs            {header['crs']}, heights above {header['vertical_datum'] or 'an unknown datum'}",
        f"origin         {header['origin_m'][0]} east, {header['origin_m'][1]} north (of the area)",
        f"load modules   {len(finest)}: rows {south} to {north - 1}, columns {west} to {east - 1}",
        f"side           {header['side'] / 128} m, spacing {header['spacing_m']} m",
        f"triangles      {sum(triangles)}, at most {max(triangles)} in a load module",
        f"polygons       {sum(module['polygons'] for module in finest)}",
        f"rms residual   {rms(finest)}",
    ]
    decks = [len(module["decks"]["triangles"]) for module in finest if "decks" in module]
    if decks:
        lines.append(f"decks          {sum(decks)} triangles in {sum(map(bool, decks))} load modules")
    ways = [line for module in finest for line in module.get("lines", [])]
    if ways:
        whole, kept = (sum(map(length_m, some)) / 1000 for some in (ways, [way for way in ways if way["kept"]]))
        lines.append(f"lines          {len(ways)}, {whole:.2f} km, of which {kept:.2f} km are kept")
    objects = [thing for module in finest for thing in module.get("objects", [])]
    if objects:
        kinds = collections.Counter(thing["kind"] for thing in objects)
        lines.append("objects        " + ", ".join(f"{kinds[kind]} {kind}" for kind in OBJECT_KINDS if kinds[kind]))
    for level in range(1, header["levels"]):
        own = [module for module in modules if module["level"] == level]
        count = sum(len(module["triangles"]) for module in own)
        lines.append(f"level {level}        {count} triangles, rms residual {rms(own)}")
    return "\n".join(lines)


def length_m(line):
    pieces = zip(line["vertices"], line["vertices"][1:])
    return sum(math.dist(a[:2], b[:2]) for a, b in pieces) / 128


def rms(modules):
    posts = sum(module["residual"]["posts"] for module in modules)
    squares = sum(module["residual"]["sum_squared"] for module in modules)
    return f"{math.sqrt(squares / posts) / 128:.3f} m over {posts} posts" if posts else "of no posts"


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("file", help="a file of modules/, such as ntc.tdb/modules/r00c00.slm")
    arguments.add_argument("--json", action="store_true", help="print everything as JSON")
    arguments.add_argument("--at", nargs=2, type=float, metavar=("EAST", "NORTH"), help="print heights at a place, m")
    arguments.add_argument("--ceiling", type=float, default=math.inf, help="with --at: only what is not above, m")
    options = arguments.parse_args()
    try:
        with open(options.file, "rb") as file:
            header, modules = parse(file.read())
    except (Damaged, OSError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        print(f"{options.file}: {reason}", file=sys.stderr)
        return 2
    if options.at:
        ground = next(iter(surfaces_at(header, modules, *options.at)), None)
        topmost = surface_below(header, modules, *options.at, options.ceiling)
        for name, surface in [("ground", ground), ("topmost", topmost)]:
            print(f"{name:14} {'{:.3f} m, class {}, {}'.format(*surface) if surface else 'none'}")
        return 0 if topmost else 1
    print(json.dumps({"header": header, "modules": modules}) if options.json else summary(header, modules))
    return 0


if __name__ == "__main__":
    sys.exit(main())
