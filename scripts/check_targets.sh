#!/usr/bin/env bash
# Compiles the program, the reader for C and the Python module for Windows and macOS, and links them for Windows. Debian
# has Rust's standard library for both as source only, which is compiled, too; Zig is their C compiler and linker.
# Nothing is installed: all lies in target/targets, 4 GB, and is used again. Where Debian's packages are not to be had,
# it says so and ends well.
#
#     scripts/check_targets.sh                                   both
#     scripts/check_targets.sh x86_64-pc-windows-gnu             one
#     TIEFORT=target/release/tiefort scripts/check_targets.sh    and builds an area with tiefort.exe, which has to have
#                                                                the bytes that this program builds; needs wine64
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

mkdir -p "${CARGO_TARGET_DIR:-target}/targets"
home=$(realpath "${CARGO_TARGET_DIR:-target}/targets")
debian=$home/debian tools=$home/tools
if [[ ! -x $debian/usr/bin/rustc ]]; then
    # They conflict with other compilers, so they are unpacked, with what they need and this machine has not.
    mapfile -t packages < <(apt-get install --print-uris --quiet=2 --no-install-recommends rustc-web rust-web-src |
        sed -n "s/^'[^']*' \([^_]*\)_.*/\1/p")
    rm -rf "$home/unpacked" "$home/packages" && mkdir "$home/packages"
    if [[ ${#packages[@]} -eq 0 ]] || ! (cd "$home/packages" && apt-get download --quiet=2 "${packages[@]}"); then
        printf 'left out: rustc-web and rust-web-src are not among the packages of this machine\n' >&2
        exit 0
    fi
    for package in "$home"/packages/*.deb; do dpkg -x "$package" "$home/unpacked"; done
    rm -r "$home/packages"
    mv "$home/unpacked" "$debian"
fi
if [[ ! -x $tools/bin/cargo-zigbuild ]]; then
    python3 -m venv "$tools"
    "$tools/bin/pip" install --quiet --disable-pip-version-check ziglang==0.17.1 cargo-zigbuild==0.24.1
fi

# The compiler is older or newer than this machine's, so it has folders of its own; nothing is run fast or debugged.
export LD_LIBRARY_PATH=$debian/usr/lib/x86_64-linux-gnu RUSTC=$debian/usr/bin/rustc RUSTC_BOOTSTRAP=1
export CARGO_TARGET_DIR=$home CARGO_INCREMENTAL=0 CARGO_PROFILE_DEV_DEBUG=none CARGO_PROFILE_DEV_OPT_LEVEL=0
CARGO_ZIGBUILD_ZIG_PATH=$(echo "$tools"/lib/python3*/site-packages/ziglang/zig)
export CARGO_ZIGBUILD_ZIG_PATH CARGO_ZIGBUILD_CACHE_DIR=$home/zig
export ZIG_GLOBAL_CACHE_DIR=$home/zig ZIG_LOCAL_CACHE_DIR=$home/zig

# What Windows wants beside them: two archives of nothing, since Debian's standard library asks for GCC's protection of
# stacks, which Zig has inside; the one name that the Python module exports, without which Zig exports all of them, more
# than a library can have; and for wine, where Debian's is older than it, the library that random numbers come from.
windows=$home/windows
mkdir -p "$windows" "$home/empty"
for name in libssp.a libssp_nonshared.a; do printf '!<arch>\n' >"$home/empty/$name"; done
export CARGO_TARGET_X86_64_PC_WINDOWS_GNU_RUSTFLAGS="-L native=$home/empty"
c_for_windows() {
    "$CARGO_ZIGBUILD_ZIG_PATH" cc -target x86_64-windows-gnu -x c - "$@"
}
for_windows() {
    c_for_windows -c -o "$windows/exports.o" <<<'
__attribute__((section(".drectve"), used)) static const char names[] = " -export:PyInit__tiefort";'
    c_for_windows -shared -o "$windows/bcryptprimitives.dll" -ladvapi32 <<<'
unsigned char SystemFunction036(void *to, unsigned long count);
__declspec(dllexport) int ProcessPrng(unsigned char *to, unsigned long long count) {
    return SystemFunction036(to, (unsigned long)count);
}'
}

# One command of cargo for a target.
zig() {
    "$tools/bin/cargo-zigbuild" "$1" --quiet --locked -Zbuild-std=std,panic_abort,panic_unwind --target "${@:2}"
}
[[ $# -gt 0 ]] || set -- x86_64-pc-windows-gnu aarch64-apple-darwin
for target; do
    start=$SECONDS
    if [[ $target == *apple* ]]; then
        # Apple's frameworks, which the program is linked with, are Apple's to hand out.
        zig check "$target" -p load-module-reader-c -p tiefort -p tiefort-python
        printf '%s: compiled in %d s\n' "$target" $((SECONDS - start))
        continue
    fi
    zig zigbuild "$target" -p load-module-reader-c -p tiefort
    for_windows
    zig rustc "$target" -p tiefort-python -- -C "link-arg=$windows/exports.o"
    printf '%s: compiled and linked in %d s\n' "$target" $((SECONDS - start))
done

program=$home/x86_64-pc-windows-gnu/debug/tiefort.exe
wine=$(command -v wine64 || command -v /usr/lib/wine/wine64 || true)
if [[ -z ${TIEFORT:-} || -z $wine || ! -f $program ]]; then
    printf 'nothing was run: that needs TIEFORT, wine64 and a tiefort.exe\n'
    exit 0
fi
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
# What is not optimised has frames of megabytes; a release takes less than 200 kB of stack.
export WINEPREFIX=$home/wine WINEDEBUG=-all RUST_MIN_STACK=$((32 << 20))
start=$SECONDS
cp "$home/windows/bcryptprimitives.dll" "${program%/*}"
"$TIEFORT" build tests/jobs/small.toml --out "$scratch/here.tdb" --quiet
"$wine" "$program" build tests/jobs/small.toml --out "$scratch/windows.tdb" --quiet
"$wine" "$program" verify "$scratch/windows.tdb"
for part in tiles modules database.json; do diff -qr "$scratch/here.tdb/$part" "$scratch/windows.tdb/$part"; done
printf 'tiefort.exe builds the same bytes under wine, in %d s\n' $((SECONDS - start))
