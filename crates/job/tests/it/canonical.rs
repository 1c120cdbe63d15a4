//! The canonical text of a job, byte for byte: databases hold it, and a build compares it with theirs.

use std::path::Path;

use job::Job;

const SHORTEST: &str = "[area]\nname = \"small\"\ncrs = \"EPSG:32611\"\norigin_m = [-500.5, 3875000]\n\
    size_m = [9000, 8500]\nspacing_m = 12.5\n[dem]\n";

/// What follows [`SHORTEST`]: every word of every setting, and every form of a value, once at least.
const REST: [&str; 21] = [
    "source = \"sample\"",
    "source = \"sample\"\nseed = 0x1F\nvoids = { fill_within_posts = 8 }\nvertical_datum = \"EGM \\\"96\\\"\"",
    "source = \"sample\"\nvoids = \"hole\"\nwater = \"w.shp\"",
    "source = \"sample\"\nvoids = \"next_source\"\nwater = { file = \"w.gpkg\", level_m = -0.5, class = \
     \"s\", weight = 0 }",
    "source = \"sample\"\nvoids = { hole = true, next_source = true }\nresampling = \"bilinear\"",
    "source = \"sample\"\nvoids = { next_source = true, fill_within_posts = 3, hole = true }\nresampling = \"cubic\"",
    "sources = [\"a.tif\", { file = \"b.hgt\", crs = \"EPSG:4326\", corner = [35, -117], nodata = -9999, \
     height_unit_m = 0.3048, vertical_datum = \"EGM96\", attribution = \"NASA\" }]\nfeather_m = 5",
    "sources = [\"*.tif\"]\nheight_unit_m = 0.3048\ngeoids = [{ datum = \"EGM96\", file = \"g.gtx\" }]",
    "source = \"sample\"\n[importance]\ndefault = 8\nsmooth = \"none\"\nareas = [{ file = \"a.geojson\", \
     class = \"r\", \
     weight = 0.125 }, { raster = \"c.tif\", value = -3, class = \"l\", weight = 0 }, { sample = \"mountains\", \
     class = \"r\", weight = 65.535 }, { slope_above_percent = 12.5, smooth_m = 400, class = \"s\", weight = 1 }]",
    "source = \"sample\"\n[tiles]\ncolumns = 2\nrows = 3\norder = \"raster\"\nborders = \"regular\"",
    "source = \"sample\"\n[load_modules]\nside_m = 250\nborder_step_m = 62.5\nouter_border = \"fixed\"",
    "source = \"sample\"\n[limits]\ncount = \"polygons\"\nper_load_module = 99\npool = \
     12\nmean_per_load_module = 31.7\n\
     per_4km_square = 2000",
    "source = \"sample\"\n[tin]\nmethod = \"greedy\"\nkey = \"sse\"\nresidual_quantum_m = 0.5\nmax_residual_m = 0",
    "source = \"sample\"\n[tin]\ntarget_rms_m = 1.25\nallocation = \"equal\"\neffort = \"fast\"\nheight_fit = \"l2\"\n\
     lattice = \"post\"",
    "source = \"sample\"\n[tin]\neffort = \"best\"\nheight_fit = \"off\"\nstart = \"p.csv\"\npins = \"p.geojson\"",
    "source = \"sample\"\n[tin]\nmethod = \"paper\"\npoints = 9\nstart = { method = \"highlow\" }\n\
     [load_modules]\nedges = \"clip\"",
    "source = \"sample\"\n[tin]\nmethod = \"paper\"\npoints = 9\nproximity = false\nlast_batch = \"finish\"\n\
     start = { method = \"fowler-little\", points = 5 }\n[load_modules]\nedges = \"clip\"\nclip_heights = \"dem\"",
    "source = \"sample\"\n[tin]\nmethod = \"paper\"\nmax_residual_m = 2.5\nproximity_m = [10, 2.5]\nkey = \"sse\"",
    "source = \"sample\"\n[lod]\nlevels = [{ inner_share = 0.5 }, { inner_share = 2e-1 }]\nborder = \"own\"",
    "source = \"sample\"\n[features]\nsources = [\"sample\"]",
    "source = \"sample\"\n[features]\nsources = [\"r.osm.pbf\", { file = \"h.gpkg\", layer = \"a\", kind = \"lake\" }, \
     { file = \"sample\" }]\nshare_max = 0.25\nclearance_road_m = 4.3\nclearance_rail_m = 7\nclearance_water_m = 0\n\
     bank_m = 0\nrules = [{ where = {}, kind = \"none\" }, { where = { b = [], \"a c\" = \"d\" }, kind = \"rail\", \
     class = \"t\", width_m = 3.5, grade_max_percent = 4, form = \"auto\", z = \"feature\" }]",
];

#[test]
fn the_canonical_text_is_byte_for_byte_as_databases_hold_it() {
    let text = |rest: &&str| {
        let job = Job::from_text(&format!("{SHORTEST}{rest}\n"), Path::new("jobs/x.toml")).unwrap();
        format!("# {}\n{}\n", rest.replace('\n', " | "), job.canonical_text())
    };
    let found: String = REST.iter().map(text).collect();
    let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/canonical.txt");
    if std::env::var_os("UPDATE_GOLDEN").is_some() {
        std::fs::write(&golden, &found).unwrap();
    }
    assert_eq!(found, std::fs::read_to_string(&golden).unwrap(), "UPDATE_GOLDEN=1 rewrites {}", golden.display());
}
