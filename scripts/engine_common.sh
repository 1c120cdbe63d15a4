# What the scripts that run real engines share: a job of 36 tiles, its bytes from a local build, and the comparison.
# Sourced with `scratch` and `tiefort` set.

# The job: 18 km x 18 km of the sample terrain, or `SIZE_M` metres, with its roads, washes and lakes unless `FEATURES`
# is empty.
make_job() {
    local size=${SIZE_M:-18000}
    sed -e "s/size_m = \[4000, 4000\]/size_m = [$size, $size]/" -e 's/columns = 2/columns = 6/' \
        -e 's/rows = 2/rows = 6/' "$root/tests/jobs/small.toml" > "$scratch/job.toml"
    if [[ -n ${FEATURES-sample} ]]; then printf '\n[features]\nsources = ["sample"]\n' >> "$scratch/job.toml"; fi
    "$tiefort" build "$scratch/job.toml" --out "$scratch/local.tdb" --quiet
}

# The bytes must be those of the local build, and nothing may be left over.
compare() {
    local database=$1 part
    for part in tiles modules measured survey database.json; do
        diff -r "$scratch/local.tdb/$part" "$database/$part"
    done
    if [[ -n $(find "$database" -name '.*' -not -path "$database") || -e $database/work ]]; then
        echo "left over in $database" >&2
        return 1
    fi
    "$tiefort" verify "$database"
}

# Seconds since the script began, and a line of the log.
tell() { printf '%6.1f s  %s\n' "$(( ($(date +%s%N) - began) / 100000000 ))e-1" "$*"; }
