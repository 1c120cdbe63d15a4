//! `tiefort init`: a job for rasters, and for the roads, rivers and lakes on them, with what each of its numbers is.

use std::path::{Path, PathBuf};

use build::BUDGETS;
use build::workbench::{Seen, SeenFeatures, Suggestion};
use clap::{Args, ValueEnum};
use job::Job;

use crate::commands::init_features::{features_section, objects_section, told_of};
use crate::commands::init_limits::{Asked, Limits, choose};
use crate::commands::job_words::{comment, quoted, relative};
use crate::commands::{init_around, init_files};
use crate::failure::{Failure, Outcome};
use crate::terminal;

const AFTER_HELP: &str = "\
Examples:
  tiefort init n35w117.dt2 n35w118.dt2 --out fort.toml
  tiefort init dem/*.hgt > area.toml && tiefort build area.toml
  tiefort init grid.asc --crs EPSG:32611
  tiefort init dem.tif roads.osm.pbf lakes.gpkg --out mine.toml
  tiefort init --around 35.3,-116.6 --km 50 --dem glo30 --out irwin.toml
  tiefort init --around 35.3,-116.6 --dem 3dep13 --vectors overture --release R

The job covers the largest rectangle of whole load modules inside the rasters.
Roads, rivers and lakes become parts of the ground there, buildings, walls and
woods stand on it.";

/// Arguments of `init`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Rasters, or folders of them: GeoTIFF, DTED, HGT, Esri ASCII, raw with a .hdr; also in .gz and .zip; in order of
    /// priority. Roads, water, buildings and woods: .osm.pbf, GeoPackage, Shapefile, GeoJSON, GeoParquet
    #[arg(value_name = "FILES", required_unless_present = "around", conflicts_with = "around")]
    files: Vec<PathBuf>,
    /// Latitude and longitude in degrees: an area around that place, with heights that `tiefort fetch` brings
    #[arg(long, value_name = "LAT,LON", value_parser = init_around::place, requires = "dem",
          conflicts_with_all = ["crs", "rms"], allow_hyphen_values = true)]
    around: Option<[f64; 2]>,
    /// Kilometres of that area from west to east and from south to north
    #[arg(long, value_name = "N", default_value = "50", value_parser = kilometres, requires = "around")]
    km: f64,
    /// Which heights, by a name that `tiefort sources` lists
    #[arg(long, value_name = "NAME", requires = "around")]
    dem: Option<String>,
    /// Which roads, water and buildings, by a name that `tiefort sources` lists
    #[arg(long, value_name = "NAME", requires = "around")]
    vectors: Option<String>,
    /// Which release of them
    #[arg(long, value_name = "RELEASE", requires = "vectors")]
    release: Option<String>,
    /// A file with sources of your own
    #[arg(long, value_name = "FILE.toml", requires = "around")]
    catalogue: Option<PathBuf>,
    /// Where to write the job; it must not exist yet [default: standard output]
    #[arg(long, value_name = "JOB.toml")]
    out: Option<PathBuf>,
    /// Coordinate system of files that do not say
    #[arg(long, value_name = "EPSG:CODE")]
    crs: Option<String>,
    /// Limits of that hardware: 32 triangles a load module on average, 100 at most, 4096 in 4 km [default: what keeps
    /// roads and water whole]
    #[arg(long, value_enum, value_name = "HARDWARE", conflicts_with_all = ["mean", "rms"])]
    limits: Option<Hardware>,
    /// Triangles of a load module on average; at most three times as many, and 128 times in 4 km
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(8..=20_000), conflicts_with = "rms")]
    mean: Option<u32>,
    /// As many triangles as leave this RMS residual in metres, about
    #[arg(long, value_name = "R", value_parser = residual)]
    rms: Option<f64>,
}

/// Hardware whose limits are known.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Hardware {
    /// The image generators of the founding paper
    Simnet,
}

/// Kilometres of a side.
fn kilometres(text: &str) -> Result<f64, String> {
    let km = text.parse().ok().filter(|km| (1.0..=400.0).contains(km));
    km.ok_or_else(|| "expected 1 to 400 km".to_owned())
}

/// A residual in metres.
fn residual(text: &str) -> Result<f64, String> {
    let metres = text.parse().ok().filter(|metres| (0.01..=1000.0).contains(metres));
    metres.ok_or_else(|| "expected 0.01 to 1000 metres".to_owned())
}

impl Arguments {
    fn asked(&self) -> Asked {
        match (self.limits, self.mean, self.rms) {
            (Some(Hardware::Simnet), ..) => Asked::Simnet,
            (_, Some(mean), _) => Asked::Mean(mean),
            (_, _, Some(rms_m)) => Asked::Rms(rms_m),
            (None, None, None) => Asked::Data,
        }
    }
}

/// Writes a job.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    // Rasters may take long to look at.
    arguments.out.as_deref().map_or(Ok(()), crate::files::check_free)?;
    if let (Some(place), Some(dem)) = (arguments.around, &arguments.dem) {
        return around(arguments, place, dem);
    }
    let (vectors, files): (Vec<PathBuf>, Vec<PathBuf>) = init_files::named_files(&arguments.files)?
        .into_iter()
        .partition(|path| build::workbench::is_feature_file(path));
    if let ([first, ..], []) = (vectors.as_slice(), files.as_slice()) {
        let path = first.display();
        let message = format!("{path}: found a file of roads, water or buildings, expected a raster beside it");
        return Err(Failure::new(message, "name a raster of heights too, as dem.tif: area and ground come from it"));
    }
    let crs = arguments.crs.as_deref();
    let suggestion = build::workbench::look_at(&files, crs).map_err(Failure::from);
    let suggestion = suggestion.map_err(|failure| match crs {
        // The hint of a build would tell to write into the job that is about to be made.
        None => failure.hinted_where("no coordinate reference system", "say what it is: --crs EPSG:32611 (your own)"),
        Some(_) => failure,
    })?;
    let features = build::workbench::look_at_features(&vectors, &suggestion)?;
    let datums = known_datums(&suggestion.seen);
    if 1 < datums.len() {
        terminal::tell(&format!(
            "note: heights are above {}; a build needs a geoid grid to bring them to one: see geoids in the job",
            datums.join(" and ")
        ));
    }
    let with =
        |limits: &Limits, folder: &Path, name: &str| job_text((&suggestion, &features, limits), folder, name, crs);
    let any = with(&Limits::of(BUDGETS[0]), Path::new(""), "area");
    let limits = choose(arguments.asked(), &suggestion, &any)?;
    let rms_m = suggestion.rms_m(limits.for_ground(suggestion.modules()))?;
    let text = |folder: &Path, name: &str| with(&limits, folder, name);
    terminal::tell(&found_text(&suggestion, (limits.mean, rms_m), &text(Path::new(""), "area")));
    features.iter().for_each(|seen| terminal::tell(&told_of(seen)));
    limits.said.iter().for_each(|said| terminal::tell(said));
    let of_objects = surface_model(&suggestion.seen).filter(|_| !limits.objects.is_empty());
    let remarks = remarks(&suggestion, limits.mean).into_iter().chain(of_objects);
    remarks.for_each(|remark| terminal::tell(&format!("note: {remark}")));
    let Some(out) = &arguments.out else {
        terminal::print(&text(Path::new(""), "area"))?;
        return Ok(Outcome::Sound);
    };
    let name = out.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    crate::files::write_new(out, &text(out.parent().unwrap_or(Path::new("")), &name))?;
    terminal::print(&format!("{} is written; build it: tiefort build {}\n", out.display(), out.display()))?;
    Ok(Outcome::Sound)
}

/// Writes a job for a place on the Earth.
fn around(arguments: &Arguments, place: [f64; 2], dem: &str) -> Result<Outcome, Failure> {
    let limits = Limits::of(arguments.mean.unwrap_or(BUDGETS[0]));
    let name = arguments.out.as_deref().and_then(Path::file_stem).map(|stem| stem.to_string_lossy().into_owned());
    let name = plain_name(&name.unwrap_or_default());
    let (vectors, release) = (arguments.vectors.as_deref(), arguments.release.as_deref());
    let named = init_around::Named { dem, vectors, release, own: arguments.catalogue.as_deref() };
    let text = init_around::job_text(place, arguments.km, &named, &limits, &name)?;
    let Some(out) = &arguments.out else {
        terminal::print(&text)?;
        return Ok(Outcome::Sound);
    };
    crate::files::write_new(out, &text)?;
    let path = out.display();
    terminal::print(&format!("{path} is written; fetch what it names: tiefort fetch {path}\n"))?;
    Ok(Outcome::Sound)
}

/// What was found, and what a build of it takes and leaves: one line, broken where a terminal ends.
fn found_text(suggestion: &Suggestion, (triangles, rms_m): (u32, Option<f64>), job: &str) -> String {
    let Suggestion { seen, size_m, spacing_m, part_around, .. } = suggestion;
    let voids: usize = seen.iter().map(|file| file.voids).sum();
    let files = if seen.len() == 1 { "1 file".to_owned() } else { format!("{} files", seen.len()) };
    let [wide, high] = size_m.map(|metres| metres / 1000.0);
    let mut voids =
        if voids == 0 { "no voids".to_owned() } else { format!("{} void posts", views::grouped(voids as u64)) };
    if 0 < suggestion.gap_posts {
        voids += &format!(", {} posts of the area that no file reaches", views::grouped(suggestion.gap_posts as u64));
    }
    let mut datums = known_datums(seen);
    if seen.iter().any(|file| file.vertical_datum.is_none()) {
        datums.push("an unknown datum");
    }
    let datum = datums.join(" and ");
    let mut text = format!("found {files}: {wide} x {high} km at {spacing_m} m, {voids}, heights above {datum}");
    if let Some([wide, high]) = left_out_km(suggestion) {
        text += &format!("; {wide} km of the files' width and {high} km of their height are left out");
    }
    if part_around.is_some() {
        text += "; the area is a part in the middle of the first, see around in the job";
    }
    // The job's files need not be found for that, only its numbers.
    let plan = Job::from_text(job, Path::new("job")).ok().and_then(|job| build::plan(&job).ok());
    if let Some(plan) = plan {
        let memory = crate::files::bytes_text(plan.forecast.memory_bytes);
        text += &format!("; a build takes about {:.0} s of one core and {memory}", plan.forecast.seconds.max(1.0));
    }
    if let Some(rms_m) = rms_m {
        text += &format!("; {triangles} triangles a load module leave an RMS residual {}", about(rms_m));
    }
    text
}

/// That a raster has roofs and crowns in its heights already, where its name is that of a surface model.
fn surface_model(seen: &[Seen]) -> Option<String> {
    const NAMES: [&str; 8] = ["_dsm", "glo-30", "glo30", "glo-90", "aw3d30", "astgtm", "aster", "srtm"];
    let name_of = |seen: &&Seen| seen.path.file_name().map(|name| name.to_string_lossy().to_lowercase());
    let found = seen.iter().find(|seen| name_of(seen).is_some_and(|name| NAMES.iter().any(|of| name.contains(of))))?;
    Some(format!(
        "{} is a surface model by its name: where roofs and crowns are in its heights, buildings and woods on top of \
         it count twice",
        found.path.display()
    ))
}

/// Kilometres of the width and the height of the rectangle around the files that whole load modules leave out; `None`
/// where that is less than a cell, or where the area is a part of them only.
fn left_out_km(Suggestion { size_m, around_m, spacing_m, part_around, .. }: &Suggestion) -> Option<[f64; 2]> {
    let left = [0, 1].map(|axis| around_m[axis] - size_m[axis]);
    let is_much = part_around.is_none() && left.iter().any(|metres| spacing_m <= metres);
    is_much.then(|| left.map(|metres| (metres / 10.0).round() / 100.0))
}

/// A residual in two figures: it is from a look at parts of the area.
fn about(metres: f64) -> String {
    match metres {
        ..0.095 => "below 0.1 m".into(),
        ..0.995 => format!("of about {metres:.2} m"),
        ..9.95 => format!("of about {metres:.1} m"),
        _ => format!("of about {metres:.0} m"),
    }
}

/// What a person should think about before a build: ground finer than the budget can show, and a grid finer than the
/// ground is known.
fn remarks(suggestion: &Suggestion, triangles: u32) -> Vec<String> {
    /// Posts for a triangle, beyond which more of them change hardly anything.
    const POSTS_A_TRIANGLE_MAX: f64 = 100.0;
    /// Spacings for a post of the source, beyond which the grid repeats what the source says.
    const COARSE: f64 = 3.5;
    let Suggestion { spacing_m, posts_m, .. } = suggestion;
    let cells = (500.0 / spacing_m).powi(2);
    let mut remarks = Vec::new();
    let each = cells / f64::from(triangles);
    if POSTS_A_TRIANGLE_MAX < each {
        let coarser = if *spacing_m < 5.0 { 12.5 } else { 25.0 };
        let times = views::grouped((coarser / spacing_m).powi(2).round() as u64);
        remarks.push(format!(
            "{} posts for each triangle: the ground is finer than {triangles} triangles a load module can show; \
             spacing_m = {coarser} in the job has {times} times fewer posts to work on, or raise per_load_module and \
             mean_per_load_module",
            views::grouped(each.round() as u64),
        ));
    }
    if COARSE * spacing_m < *posts_m {
        remarks.push(format!(
            "the posts of the source are {posts_m:.0} m apart: the working grid of {spacing_m} m between them tells \
             nothing new of the ground, and the residual is that against a smooth surface through them"
        ));
    }
    remarks
}

fn job_text(
    (suggestion, features, limits): (&Suggestion, &[SeenFeatures], &Limits),
    folder: &Path,
    name: &str,
    given: Option<&str>,
) -> String {
    let Suggestion { seen, epsg, origin_m, size_m, spacing_m, tiles, part_around, .. } = suggestion;
    let modules = size_m.map(|metres| metres / 500.0);
    let mut text = format!(
        "# Written by `tiefort init`. Every line may be changed;\n\
         # `tiefort plan` on this file shows what follows.\n\
         \n[area]\nname = \"{}\"\n\
         crs = \"EPSG:{epsg}\"{}\n\
         origin_m = [{}, {}]  # east and north of the south-west post\n\
         # {} x {} load modules: the largest rectangle that the files cover{}\n\
         size_m = [{}, {}]\n\
         spacing_m = {spacing_m}  # of the working grid; it divides 125 m\n\n[dem]\nsources = [\n",
        plain_name(name),
        if (32601..=32760).contains(epsg) { "  # the UTM zone of the files' middle, or their own" } else { "" },
        origin_m[0],
        origin_m[1],
        modules[0],
        modules[1],
        left_out_km(suggestion).map_or(String::new(), |[wide, high]| format!(
            ",\n# {wide} km of their width and {high} km of their height left out"
        )),
        size_m[0],
        size_m[1],
    );
    if let Some([longitude, latitude]) = part_around {
        let instead = format!(
            "# The files are too large for one area, or lie too far apart: this is the\n\
             # middle of the first.\n\
             # around = {{ lat = {latitude:.4}, lon = {longitude:.4}, size_km = 50 }}\n\
             # instead of origin_m and size_m chooses any place.\n\
             spacing_m = "
        );
        text = text.replacen("spacing_m = ", &instead, 1);
        text = text.replacen(": the largest rectangle that the files cover", ": a part of what the files cover", 1);
    }
    for file in seen {
        text += &source_text(file, folder, given);
    }
    text += "]\n";
    text += &voids_text(suggestion);
    text += &datum_text(seen);
    text += &sea_section(seen);
    text += &features_section(features, folder);
    text += &objects_section(features, &limits.objects, folder);
    text += &format!(
        "\n[tiles]\ncolumns = {}\nrows = {}\n\n[limits]\n\
         {}per_load_module = {}         # triangles\n\
         mean_per_load_module = {}     # over the whole area: {} triangles\n\
         per_4km_square = {}         # in every window of 8 x 8 load modules\n\n\
         [tin]\nmethod = \"optimised\"          # the budget is the limits\n\n\
         # Coarser levels of every load module, for what is far away: the share of\n\
         # inner vertices that each keeps.\n\
         # [lod]\n# levels = [{{ inner_share = 0.5 }}, {{ inner_share = 0.2 }}]\n",
        tiles.1,
        tiles.0,
        limits.comment(),
        limits.most[0],
        limits.mean,
        views::grouped(suggestion.modules() * u64::from(limits.mean)),
        limits.most[1],
    );
    // Names in headers may hold anything; in a job they stand in comments, where control characters are no TOML.
    terminal::plain(&text).into_owned()
}

/// A name that a job may have, made of any.
fn plain_name(name: &str) -> String {
    let plain: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '-' }).take(100).collect();
    let plain = plain.trim_start_matches(['-', '_', '.']);
    if plain.is_empty() { "area".into() } else { plain.to_owned() }
}

fn source_text(seen: &Seen, folder: &Path, given: Option<&str>) -> String {
    let path = quoted(&relative(&seen.path, folder));
    let mut keys = Vec::new();
    if let (true, Some(crs)) = (seen.crs_given, given) {
        keys.push(format!("crs = {}", quoted(crs)));
    }
    keys.extend(seen.undeclared.map(|mark| format!("nodata = {}", exact(mark))));
    let entry = match keys.is_empty() {
        true => path,
        false => format!("{{ file = {path}, {} }}", keys.join(", ")),
    };
    let unit = if seen.is_geographic { "seconds" } else { "m" };
    let [east, north] = seen.spacing.map(|step| if seen.is_geographic { step * 3600.0 } else { step });
    let (cols, rows) = seen.size;
    let mut facts =
        format!("{}, {}, {cols} x {rows} posts, {} x {} {unit}", seen.format, seen.crs, short(east), short(north));
    if let Some((low, high)) = seen.range_m {
        facts += &format!(", {} to {} m", short(low), short(high));
    }
    facts += &match seen.voids {
        0 => ", no voids".to_owned(),
        voids => format!(", {} void", views::grouped(voids as u64)),
    };
    if let Some(mark) = seen.undeclared {
        facts += &format!(" (those of {}, which can only mark voids)", exact(mark));
    }
    if let Some(accuracy_m) = seen.accuracy_m {
        facts += &format!(", accurate to {accuracy_m} m");
    }
    facts += &match &seen.vertical_datum {
        Some(datum) => format!(", heights above {datum}"),
        None => ", heights above an unknown datum".to_owned(),
    };
    let notes: String = seen.notes.iter().map(|note| comment(note)).collect();
    format!("{}{notes}    {entry},\n", comment(&facts))
}

/// A number with all its digits.
fn exact(number: f64) -> String {
    if number.fract() == 0.0 && number.abs() < 1.0e9 { format!("{number:.0}") } else { format!("{number:?}") }
}

fn short(number: f64) -> String {
    let rounded = (number * 1000.0).round() / 1000.0;
    format!("{rounded}")
}

fn voids_text(Suggestion { seen, gap_posts, .. }: &Suggestion) -> String {
    let voids = seen.iter().any(|file| 0 < file.voids) || 0 < *gap_posts;
    let next = if 1 < seen.len() { "next_source = true, " } else { "" };
    let between = if *gap_posts == 0 { "" } else { "# No file reaches some posts between them.\n" };
    match voids {
        true => format!(
            "# Small voids and the rims of larger ones are filled from around them;\n\
             # the rest has no weight. \"fail\" would refuse both.\n{between}\
             voids = {{ {next}fill_within_posts = 8, hole = true }}\n"
        ),
        false => "voids = \"fail\"                # there are none\n".to_owned(),
    }
}

/// The section `[importance]`, where a part of the files is the sea; empty where none is.
fn sea_section(seen: &[Seen]) -> String {
    /// Less of the posts than that may be a field that lies level.
    const SHARE_MIN: f64 = 0.01;
    let posts: f64 = seen.iter().map(|file| f64::from(file.size.0) * f64::from(file.size.1)).sum();
    let share = seen.iter().map(|file| file.at_sea_level).sum::<usize>() as f64 / posts;
    // Brought to another datum, the sea lies at no one height.
    if share < SHARE_MIN || 1 < known_datums(seen).len() {
        return String::new();
    }
    format!(
        "\n[importance]\n\
         # The sea: {:.0} % of the posts lie level at 0 m. A file of its polygon with\n\
         # kind = \"lake\" in [features] has a sharper shore.\n\
         areas = [{{ level_m = 0, class = \"water\", weight = 1 }}]\n",
        share * 100.0
    )
}

/// The vertical datum, where the files agree on one.
fn datum_text(seen: &[Seen]) -> String {
    let first = seen.first().and_then(|file| file.vertical_datum.as_ref());
    match first.filter(|first| seen.iter().all(|file| file.vertical_datum.as_ref() == Some(first))) {
        Some(datum) => format!("vertical_datum = {}\n", quoted(datum)),
        None if 1 < known_datums(seen).len() => {
            let datums = known_datums(seen);
            format!(
                "vertical_datum = {}\n\
                 # The files' heights are above {}: a build needs a grid for the way between them.\n\
                 # geoids = [{{ datum = \"EGM96\", file = \"egm96_15.gtx\" }}]\n",
                quoted(datums[0]),
                datums.join(" and "),
            )
        }
        None => "# vertical_datum = \"EGM96\"   # the files do not say or differ; write it if known\n".into(),
    }
}

/// The datums that files name, each once.
fn known_datums(seen: &[Seen]) -> Vec<&str> {
    let mut known: Vec<&str> = Vec::new();
    for datum in seen.iter().filter_map(|file| file.vertical_datum.as_deref()) {
        if !known.contains(&datum) {
            known.push(datum);
        }
    }
    known
}
