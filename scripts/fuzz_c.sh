#!/usr/bin/env bash
# Fuzzes the C interface from a program in C under gcc's AddressSanitizer and UndefinedBehaviorSanitizer, for some
# seconds (1800 by default), with random numbers from FIRST on (1 by default):
#
#     scripts/fuzz_c.sh [SECONDS [FIRST]]
#
# Seeds are the worked examples of FORMAT.md, without a deck and with one, at one to eight levels, and the tiles of a
# small job, with and without levels, if target/debug/tiefort is built. What fails prints its round:
# `fuzz SEEDS WORK ROUND 60 ROUND` repeats it; its files are kept in fuzz/artifacts/c; those that were found and mended
# become files of
# crates/load-module-reader-c/tests/findings, which this asks about first, and `cargo test` does, too.
# Rust's code is not instrumented: the sanitizers see every allocation, every leak and all that C does with answers.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

seconds=${1:-1800}
first=${2:-1}
compiler=${CC:-gcc}
build=${CARGO_TARGET_DIR:-target}
reader=crates/load-module-reader-c

scratch=$(mktemp -d "$([[ -w /dev/shm ]] && echo /dev/shm || echo /tmp)/fuzz_c.XXXXXX")
trap 'rm -rf "$scratch"' EXIT

cargo build -p load-module-reader-c
if ! "$compiler" -std=gnu99 -O1 -g -Wall -Wextra -Werror -fsanitize=address,undefined -fno-sanitize-recover=undefined \
    -I "$reader/include" "$reader/tests/fuzz.c" "$build/debug/libload_module_reader_c.a" -lpthread -ldl -lm \
    -o "$scratch/fuzz"; then
    printf 'skipped: %s has no -fsanitize=address,undefined here, or cannot compile the harness\n' "$compiler" >&2
    exit 1
fi

mkdir "$scratch/seeds"
python3 -B scripts/fuzz_seeds.py docs/FORMAT.md "$scratch/seeds"
if [[ -x $build/debug/tiefort ]]; then
    tiefort=$(realpath "$build/debug/tiefort")
    cp tests/jobs/small.toml "$scratch/plain.toml"
    { cat tests/jobs/small.toml; printf '\n[lod]\nlevels = [{ inner_share = 0.5 }, { inner_share = 0.2 }]\n'; } \
        >"$scratch/levels.toml"
    for job in plain levels; do
        "$tiefort" build "$scratch/$job.toml" --out "$scratch/$job.tdb" --quiet --no-html
        for file in "$scratch/$job.tdb"/modules/*.slm; do
            cp "$file" "$scratch/seeds/$job-${file##*/}"
        done
    done
fi

# More memory than this is more than any of these files holds.
export ASAN_OPTIONS="hard_rss_limit_mb=1024:${ASAN_OPTIONS:-}"
keep() {
    mkdir -p fuzz/artifacts/c
    cp -r "$scratch/seeds" "$scratch/trial/modules" fuzz/artifacts/c/
    printf 'found something: its files are in fuzz/artifacts/c\n' >&2
    exit 1
}
"$scratch/fuzz" "$reader/tests/findings" "$scratch/trial" || keep
"$scratch/fuzz" "$scratch/seeds" "$scratch/trial" "$first" "$seconds" || keep
