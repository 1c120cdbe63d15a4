#!/usr/bin/env bash
# Fuzzes what reads files, ours and others, each for some seconds (600 by default), and stops at the first that fails:
#
#     scripts/fuzz.sh [SECONDS [TARGET…]]
#
# A stable compiler is enough: the engine's instrumentation is a matter of flags, and no sanitizer is needed where there
# is no unsafe code. It takes a C++ compiler. What was found lies in fuzz/artifacts, what was learned in fuzz/corpus;
# seeds are the small files of TIEFORT_DATA, where that is set. A file that fails becomes a named test of source-files.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../fuzz"

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
