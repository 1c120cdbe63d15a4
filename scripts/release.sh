#!/usr/bin/env bash
# Makes the files of a release in target/release-files: source archive, program, wheel and checksums.
# Needs a clean checkout, Node for the page of the viewer, and Python for the wheel; `--no-wheel` leaves that out.
# The program is linked statically: with musl where Rust's target for it and musl-gcc are installed, else with glibc.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

wheel=yes
case ${1:-} in
'') ;;
--no-wheel) wheel=no ;;
*) printf 'found %s, expected --no-wheel\n' "$1" >&2 && exit 2 ;;
esac
if [[ -n $(git status --porcelain) ]]; then
    printf 'the checkout has changes: commit them first, a release names its commit\n' >&2
    exit 2
fi
version=$(sed -n 's/^version = "\(.*\)"$/\1/p' Cargo.toml | head -n 1)
commit=$(git rev-parse --short=12 HEAD)
grep -q "^## $version" CHANGELOG.md || { printf 'CHANGELOG.md has no section %s\n' "$version" >&2 && exit 2; }

out=${CARGO_TARGET_DIR:-target}/release-files
rm -rf "$out" && mkdir -p "$out"
out=$(realpath "$out")
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
# The same commit gives the same archives: no names of users, no clock.
archive=(tar --sort=name --owner=0 --group=0 --numeric-owner --mtime="@$(git log -1 --format=%ct)")

source=tiefort-$version
git archive --prefix="$source/" --add-virtual-file="$source/COMMIT:$commit" HEAD | gzip -n >"$out/$source-source.tar.gz"

host=$(rustc -vV | sed -n 's/^host: //p')
target=$host
musl=${host%-gnu}-musl
if [[ $host == *-linux-gnu && -d $(rustc --print sysroot)/lib/rustlib/$musl ]] && command -v musl-gcc >/dev/null; then
    target=$musl
elif [[ $host == *-linux-gnu ]]; then
    # It looks up no names and loads no libraries, the two things that a static glibc cannot do.
    export RUSTFLAGS="${RUSTFLAGS-} -C target-feature=+crt-static"
else
    printf 'no musl here: the program is linked with the C library of %s\n' "$host" >&2
fi
scripts/build_viewer.sh
cargo build --release --locked -p tiefort --features viewer --target "$target"
tiefort=${CARGO_TARGET_DIR:-target}/$target/release/tiefort

folder=$scratch/tiefort-$version-$target
mkdir -p "$folder/man" "$folder/completions"
cp "$tiefort" README.md CHANGELOG.md LICENSE-APACHE LICENSE-MIT "$folder"
# The manual and completions are printed by the program itself, so it must run here.
"$tiefort" man --out "$folder/man"
"$tiefort" completions bash >"$folder/completions/tiefort"
"$tiefort" completions zsh >"$folder/completions/_tiefort"
"$tiefort" completions fish >"$folder/completions/tiefort.fish"
found=$("$tiefort" --version | sed -n 's/^commit //p')
if [[ $found != "$commit" ]]; then
    printf 'the program names commit %s, expected %s: was something committed meanwhile?\n' "$found" "$commit" >&2
    exit 1
fi
if [[ $host == *-linux-gnu ]] && ldd "$tiefort" 2>/dev/null | grep '=>' >&2; then
    printf 'the program needs libraries, expected none\n' >&2
    exit 1
fi
"${archive[@]}" -C "$scratch" -c "tiefort-$version-$target" | gzip -n >"$out/tiefort-$version-$target.tar.gz"

if [[ $wheel == yes ]]; then
    # A library that Python loads cannot be static.
    env -u RUSTFLAGS scripts/build_wheel.sh
    cp target/wheels/tiefort-*.whl "$out"
fi
(cd "$out" && sha256sum -- * >SHA256SUMS)
ls -l "$out"
