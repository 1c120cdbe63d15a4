#!/usr/bin/env bash
# Fuzzes what reads files, ours and others, each for some seconds (600 by default), and stops at the first that fails;
# or the C interface, for 1800 seconds by default, with random numbers from FIRST on (1 by default):
#
#     scripts/fuzz.sh [SECONDS [TARGET…]]
#     scripts/fuzz.sh c [SECONDS [FIRST]]
#
# Readers: a stable compiler is enough, since the engine's instrumentation is a matter of flags, and no sanitizer is
# needed where there is no unsafe code. It takes a C++ compiler. What was found lies in fuzz/artifacts, what was learned
# in fuzz/corpus; seeds are the small files of TIEFORT_DATA, where that is set. A file that fails becomes a named test
# of source-files.
#
# C interface: a program in C under gcc's AddressSanitizer and UndefinedBehaviorSanitizer. Seeds are the worked examples
# of FORMAT.md at one to eight levels, and the tiles of a small job, with and without levels, if target/debug/tiefort is
# built. What fails prints its round: `fuzz SEEDS WORK ROUND 60 ROUND` repeats it; its files are kept in
# fuzz/artifacts/c. Those that were found and mended become files of crates/load-module-reader-c/tests/findings, which
# this asks about first, and `cargo test` does, too. Rust's code is not instrumented: the sanitizers see every
# allocation, every leak and all that C does with answers.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

c_interface() {
    local seconds=${1:-1800} first=${2:-1}
    compiler=${CC:-gcc}
    build=${CARGO_TARGET_DIR:-target}
    reader=crates/load-module-reader-c
    scratch=$(mktemp -d "$([[ -w /dev/shm ]] && echo /dev/shm || echo /tmp)/fuzz_c.XXXXXX")
    trap 'rm -rf "$scratch"' EXIT

    cargo build -p load-module-reader-c
    if ! "$compiler" -std=gnu99 -O1 -g -Wall -Wextra -Werror -fsanitize=address,undefined \
        -fno-sanitize-recover=undefined -I "$reader/include" "$reader/tests/fuzz.c" \
        "$build/debug/libload_module_reader_c.a" -lpthread -ldl -lm -o "$scratch/fuzz"; then
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
}
if [[ ${1:-} == c ]]; then
    c_interface "${@:2}"
    exit
fi

cd fuzz
seconds=${1:-600}
shift || true
targets=("$@")
all=(geotiff rasters raw polygons vectors shapefiles geoid pins module_file tile_file manifest job)
[[ ${#targets[@]} -gt 0 ]] || targets=("${all[@]}")

host=$(rustc -vV | sed -n 's/^host: //p')
build=${CARGO_TARGET_DIR:-target}/fuzz
flags="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4 -Cllvm-args=-sanitizer-coverage-trace-compares"
flags+=" -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table --cfg fuzzing"
RUSTFLAGS="$flags" CARGO_TARGET_DIR="$build" cargo build --release --target "$host" --bins

# Seeds: whatever the readers understand and is small.
seed() {
    local target=$1 ending
    mkdir -p "corpus/$target" "artifacts/$target"
    if [[ $target == module_file ]]; then
        python3 -B ../scripts/fuzz_seeds.py ../docs/FORMAT.md "corpus/$target"
        return 0
    fi
    if [[ $target == shapefiles ]]; then
        python3 -B ../scripts/fuzz_seeds.py shapefiles "corpus/$target"
        return 0
    fi
    [[ -n ${TIEFORT_DATA:-} ]] || return 0
    case $target in
        geotiff) endings=(tif) ;;
        rasters) endings=(dt0 zip gz asc txt hgt) ;;
        raw) endings=(hdr) ;;
        polygons) endings=(geojson shp gpkg) ;;
        pins) endings=(geojson csv) ;;
        vectors) endings=(pbf geojson shp gpkg) ;;
        *) endings=(gtx) ;;
    esac
    for ending in "${endings[@]}"; do
        find "$TIEFORT_DATA" -name "*.$ending" -size -200k -exec cp -n {} "corpus/$target/" \;
    done
}

for target in "${targets[@]}"; do
    seed "$target"
    printf '== %s, %s s\n' "$target" "$seconds" >&2
    "$build/$host/release/$target" "corpus/$target" -max_total_time="$seconds" -timeout=20 -rss_limit_mb=1500 \
        -max_len=300000 -artifact_prefix="artifacts/$target/" -print_final_stats=1
done
