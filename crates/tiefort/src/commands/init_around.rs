//! `tiefort init --around`: a job for a place on the Earth, with heights from a source that is known by name.

use std::path::Path;

use build::ground::find_area;
use job::{AreaPlace, AreaRequest, Job};
use terrain::Spacing;

use crate::catalogue::{Entry, Vectors, catalogue};
use crate::commands::init_limits::Limits;
use crate::commands::job_words::quoted;
use crate::failure::Failure;
use crate::terminal;

/// Degrees around the area whose squares are named, too: resampling reaches over a border.
const BEYOND: f64 = 0.002;

/// A place in degrees north and east.
pub fn place(text: &str) -> Result<[f64; 2], String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|part| part.trim().parse().ok()).collect();
    match numbers.as_slice() {
        &[latitude, longitude] if latitude.abs() <= 84.0 && longitude.abs() <= 180.0 => Ok([latitude, longitude]),
        _ => Err("expected latitude and longitude in degrees, such as 35.3,-116.6".into()),
    }
}

/// What the words of the command name.
pub struct Named<'a> {
    /// A source of heights.
    pub dem: &'a str,
    /// A source of lines and polygons.
    pub vectors: Option<&'a str>,
    /// Which release of that.
    pub release: Option<&'a str>,
    /// A file with sources of one's own.
    pub own: Option<&'a Path>,
}

/// The text of a job called `name` around a place; the side of its area is `km` long.
///
/// # Errors
/// When there is no such source or area.
pub fn job_text(
    [latitude, longitude]: [f64; 2],
    km: f64,
    Named { dem, vectors, release, own }: &Named,
    limits: &Limits,
    name: &str,
) -> Result<String, Failure> {
    let known = catalogue(*own)?;
    let entry = known.heights(dem)?;
    let vectors = match vectors {
        Some(name) => vectors_text(known.vectors(name)?, *release, entry)?,
        None => String::new(),
    };
    if entry.address.is_none() {
        return Err(Failure::new(format!("--dem {dem}: {}", entry.title), entry.ask.clone()));
    }
    let spacing = Spacing::from_metres(entry.grid_m);
    let hint = "grid_m in the catalogue is one of 1.25, 12.5, 25, 31.25, 62.5";
    let spacing = spacing.ok_or_else(|| Failure::new(format!("{dem}: found no spacing {} m", entry.grid_m), hint))?;
    let size_m = [km * 1000.0; 2];
    let request =
        AreaRequest { epsg: None, place: AreaPlace::Around { latitude, longitude, size_m }, spacing, side_m: 500.0 };
    let found = find_area(&request, &[]);
    let found = found.map_err(|none| Failure::new(format!("{}, expected {}", none.found, none.expected), none.hint))?;
    let area = format!(
        "[area]\nname = {}\ncrs = \"EPSG:{}\"  # the UTM zone of the place\n\
         # {} km around {latitude}, {longitude}\norigin_m = [{}, {}]\nsize_m = [{}, {}]\n\
         spacing_m = {}  # of the working grid; the posts of the source are about {} m apart\n",
        quoted(name),
        found.epsg,
        km,
        found.origin_m[0],
        found.origin_m[1],
        found.size_m[0],
        found.size_m[1],
        entry.grid_m,
        entry.spacing_m,
    );
    let sources = sources(entry, &corners(&area)?);
    terminal::tell(&format!(
        "{}: {} {} of {}; heights above {}; a {} model",
        entry.name,
        sources.len(),
        if sources.len() == 1 { "file" } else { "files" },
        entry.title,
        entry.datum,
        entry.model
    ));
    Ok(format!(
        "# Written by `tiefort init`. `tiefort fetch` brings what its sources name,\n\
         # `tiefort build` then touches no network.\n\n{area}\n[dem]\n\
         # {}: {}\nsources = [\n{}]\nvoids = {{ next_source = true, fill_within_posts = 8 }}\n\
         vertical_datum = {}\n\n[limits]\nper_load_module = {}         # triangles\n\
         mean_per_load_module = {}\nper_4km_square = {}\n\n[tin]\nmethod = \"optimised\"\n{vectors}",
        entry.title,
        entry.licence,
        sources.concat(),
        quoted(&entry.datum),
        limits.most[0],
        limits.mean,
        limits.most[1],
    ))
}

/// The sections of features and objects. What stands on a surface model would count twice.
fn vectors_text(vectors: &Vectors, release: Option<&str>, heights: &Entry) -> Result<String, Failure> {
    let [features, objects] = vectors.of_release(release)?;
    let is_surface = heights.model == "surface";
    let section = |name: &str, all: &[String], sign: &str| {
        let lines: String = all.iter().map(|address| format!("{sign}    {},\n", quoted(address))).collect();
        if all.is_empty() { lines } else { format!("\n{sign}[{name}]\n{sign}sources = [\n{lines}{sign}]\n") }
    };
    let (title, licence) = (&vectors.title, &vectors.licence);
    let note = match is_surface && !objects.is_empty() {
        true => "\n# Roofs and crowns are in the heights of a surface model: what stands on it counts twice.",
        false => "",
    };
    let objects = section("objects", &objects, if is_surface { "# " } else { "" });
    Ok(format!("\n# {title}: {licence}{}{note}{objects}", section("features", &features, "")))
}

/// Lowest and highest longitude and latitude of an area and a little around it.
fn corners(area: &str) -> Result<[[f64; 2]; 2], Failure> {
    let job = Job::from_text(&format!("{area}[dem]\nsource = \"sample\"\n"), Path::new("job"))?;
    let places = build::ground::corners(&job).map(|corner| corner.lon_lat.unwrap_or([f64::NAN; 2]));
    let edge = |axis: usize, pick: fn(f64, f64) -> f64| places.iter().map(|place| place[axis]).reduce(pick);
    let hint = "name a place with ground all around it";
    let bounds = [0, 1].map(|axis| Some([edge(axis, f64::min)? - BEYOND, edge(axis, f64::max)? + BEYOND]));
    match bounds {
        // Parallels bend between the corners, by less than a kilometre in 50.
        [Some([west, east]), Some([south, north])] if east - west < 180.0 => {
            let bend = (east - west).powi(2) / 100.0;
            Ok([[west, south - bend], [east, north + bend]])
        }
        _ => Err(Failure::new("found an area across the 180th meridian, expected one on one side", hint)),
    }
}

/// The lines of a source's files.
fn sources(entry: &Entry, [low, high]: &[[f64; 2]; 2]) -> Vec<String> {
    let (datum, attribution) = (quoted(&entry.datum), quoted(&entry.attribution));
    let line = |address: &String| {
        let file = quoted(address);
        format!("    {{ file = {file}, vertical_datum = {datum},\n      attribution = {attribution} }},\n")
    };
    entry.addresses(*low, *high).iter().map(line).collect()
}
