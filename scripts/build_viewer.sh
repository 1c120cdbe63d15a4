#!/usr/bin/env bash
# Bundles the page of `tiefort view` into crates/tiefort/viewer/dist/viewer.js, which the feature `viewer` builds in.
# Needs Node 20 or newer with npm; versions are those of package-lock.json.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../crates/tiefort/viewer"
npm ci --no-progress
npm run --silent build
