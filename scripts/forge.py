"""Damages databases so that every checksum is right: what only a look at the content can find.

Writes load-module files by FORMAT.md, and their lengths and hashes into `database.json`. Needs NumPy for BLAKE3.
"""

import json
import pathlib
import struct
import zlib

import numpy as np

import read_slm

KEY = [0x6A09E667, 0xBB67AE85, 0x3C6EF372, 0xA54FF53A, 0x510E527F, 0x9B05688C, 0x1F83D9AB, 0x5BE0CD19]
ORDER = [2, 6, 3, 10, 7, 0, 4, 13, 1, 11, 12, 5, 9, 14, 15, 8]
STARTS, ENDS, PARENT, ROOT = 1, 2, 4, 8
CHUNK_BYTES, BLOCK_BYTES = 1024, 64
# Where the four words lie that each step of a round mixes.
STEPS = [(0, 4, 8, 12), (1, 5, 9, 13), (2, 6, 10, 14), (3, 7, 11, 15),
         (0, 5, 10, 15), (1, 6, 11, 12), (2, 7, 8, 13), (3, 4, 9, 14)]


def compress(chain, words, counters, length, flags):
    """BLAKE3's compression of many blocks at once: arrays of 8 x n and 16 x n words; returns 8 x n."""
    count = words.shape[1]
    fill = lambda value: np.full(count, value, dtype=np.uint32)
    state = [*chain, *(fill(word) for word in KEY[:4]), counters.astype(np.uint32),
             (counters >> np.uint64(32)).astype(np.uint32), fill(length), fill(flags)]
    turn = lambda word, by: (word >> np.uint32(by)) | (word << np.uint32(32 - by))
    message = list(words)
    for _ in range(7):
        for step, (a, b, c, d) in enumerate(STEPS):
            for part, (far, near) in enumerate(((16, 12), (8, 7))):
                state[a] = state[a] + state[b] + message[2 * step + part]
                state[d] = turn(state[d] ^ state[a], far)
                state[c] = state[c] + state[d]
                state[b] = turn(state[b] ^ state[c], near)
        message = [message[at] for at in ORDER]
    return np.stack([state[at] ^ state[at + 8] for at in range(8)])


def words_of(data):
    return np.frombuffer(data.ljust(BLOCK_BYTES, b"\0"), "<u4").astype(np.uint32).reshape(16, 1)


def start(count):
    return np.repeat(np.array(KEY, dtype=np.uint32)[:, None], count, axis=1)


def blake3(data):
    """The hash in hexadecimal."""
    whole, rest = divmod(len(data), CHUNK_BYTES)
    if rest or not whole:
        last = chunk_tail(data[whole * CHUNK_BYTES :], whole, is_root=whole == 0)
    else:
        whole -= 1
        last = chunk_tail(data[whole * CHUNK_BYTES :], whole, is_root=whole == 0)
    if whole == 0:
        return last.astype("<u4").T.tobytes().hex()
    blocks = np.frombuffer(data[: whole * CHUNK_BYTES], "<u4").astype(np.uint32).reshape(whole, 16, 16)
    chains, counters = start(whole), np.arange(whole, dtype=np.uint64)
    for block in range(16):
        flags = STARTS * (block == 0) | ENDS * (block == 15)
        chains = compress(chains, blocks[:, block].T, counters, BLOCK_BYTES, flags)
    return merged(np.concatenate([chains, last], axis=1), True).astype("<u4").T.tobytes().hex()


def chunk_tail(data, number, is_root):
    chain, counter = start(1), np.array([number], dtype=np.uint64)
    blocks = [data[at : at + BLOCK_BYTES] for at in range(0, len(data), BLOCK_BYTES)] or [b""]
    for at, block in enumerate(blocks):
        is_last = at + 1 == len(blocks)
        flags = STARTS * (at == 0) | (ENDS | ROOT * is_root) * is_last
        chain = compress(chain, words_of(block), counter, len(block), flags)
    return chain


def merged(chains, is_root):
    """The root of a tree whose left side is the largest power of two of chunks that leaves some for the right."""
    count = chains.shape[1]
    if count == 1:
        return chains
    left = 1 << (count - 1).bit_length() - 1
    words = np.concatenate([merged(chains[:, :left], False), merged(chains[:, left:], False)])
    return compress(start(1), words, np.zeros(1, dtype=np.uint64), BLOCK_BYTES, PARENT | ROOT * is_root)


class Forgery:
    """A load-module file, taken apart and put together again."""

    def __init__(self, path):
        self.path = pathlib.Path(path)
        self.data = bytearray(self.path.read_bytes())
        self.header, self.modules = read_slm.parse(bytes(self.data))

    def section(self, number):
        """Where the section of a load module begins in the file, and its length."""
        each = read_slm.entry_bytes(self.header)
        at = struct.unpack_from("<I", self.data, 12)[0] + each * number
        return struct.unpack_from("<QI", self.data, at)

    def set_height(self, number, vertex, height):
        """Puts a vertex of the ground at another height in quanta."""
        start, length = self.section(number)
        struct.pack_into("<i", self.data, start + read_slm.SECTION.size + 8 * vertex + 4, height)
        self.reseal(number, start, length)

    def set_class(self, number, triangle, kind):
        start, length = self.section(number)
        module = self.modules[number]
        at = start + read_slm.SECTION.size + 8 * len(module["vertices"]) + 6 * len(module["triangles"])
        at += 2 * sum(len(side) for side in module["sides"].values()) + triangle
        self.data[at] = kind
        self.reseal(number, start, length)

    def set_residual(self, number, squares):
        start, length = self.section(number)
        struct.pack_into("<Q", self.data, start + 48, squares)
        self.reseal(number, start, length)

    def set_triangles(self, number, triangles):
        """Writes as many triangles as there are, in their order."""
        start, length = self.section(number)
        at = start + read_slm.SECTION.size + 8 * len(self.modules[number]["vertices"])
        for place, triangle in enumerate(triangles):
            struct.pack_into("<3H", self.data, at + 6 * place, *triangle)
        self.reseal(number, start, length)

    def set_deck_height(self, number, vertex, height):
        """Puts a vertex of the decks, behind the section, at another height in quanta."""
        start, length = self.section(number)
        decks = self.modules[number]["decks"]
        at = start + length
        if self.header["version"] == 3:
            # Decks are the first part behind the table, and their checksum stands in it.
            (count,) = struct.unpack_from("<I", self.data, at + 12)
            (size,) = struct.unpack_from("<I", self.data, at + 20)
            table = 16 + 12 * count + 4
            part = at + table
            struct.pack_into("<i", self.data, part + 8 + 8 * vertex + 4, height)
            struct.pack_into("<I", self.data, at + 24, zlib.crc32(bytes(self.data[part : part + size])))
            return seal(self.data, at, table)
        struct.pack_into("<i", self.data, at + read_slm.DECKS.size + 8 * vertex + 4, height)
        heights = [z for _, _, z in decks["vertices"]]
        heights[vertex] = height
        entry = struct.unpack_from("<I", self.data, 12)[0] + read_slm.entry_bytes(self.header) * number
        struct.pack_into("<ii", self.data, entry + read_slm.ENTRY.size + 8, min(heights), max(heights))
        whole = read_slm.padded(read_slm.DECKS.size + 8 * len(heights) + 7 * len(decks["triangles"])) + 4
        seal(self.data, at, whole)
        self.seal_index()

    def seal_index(self):
        at = struct.unpack_from("<I", self.data, 12)[0]
        seal(self.data, at, read_slm.entry_bytes(self.header) * len(self.modules) + 4)

    def reseal(self, number, start, length):
        """Writes lowest and highest height and checksums anew."""
        count = len(self.modules[number]["vertices"])
        heights = [struct.unpack_from("<i", self.data, start + read_slm.SECTION.size + 8 * at + 4)[0]
                   for at in range(count)]
        header_length = struct.unpack_from("<I", self.data, 12)[0]
        each = read_slm.entry_bytes(self.header)
        struct.pack_into("<ii", self.data, header_length + each * number + 24, min(heights), max(heights))
        seal(self.data, start, length)
        self.seal_index()

    def write(self):
        """Writes the file and says so in `database.json`."""
        self.path.write_bytes(self.data)
        list_file(self.path.parent.parent, self.path)


def seal(data, start, length):
    struct.pack_into("<I", data, start + length - 4, zlib.crc32(bytes(data[start : start + length - 4])))


def list_file(folder, path):
    """Writes length and hash of a load-module file into the manifest, and the manifest's own checksum."""
    manifest = folder / "database.json"
    text = manifest.read_text()
    row, column = int(path.stem[1:3]), int(path.stem[4:6])
    [tile] = [tile for tile in json.loads(text)["tiles"] if (tile["row"], tile["col"]) == (row, column)]
    data = path.read_bytes()
    text = text.replace(tile["slm"]["blake3"], blake3(data))
    manifest.write_text(with_checksum(text))


def with_checksum(text):
    """A text of JSON with its last key, `checksum`, made right."""
    value = json.loads(text)["checksum"]
    at = text.index(value)
    key = text.rindex(",", 0, at)
    bare = text[:key] + text[at + len(value) + 1 :]
    return text.replace(value, blake3(bare.encode()))
