//! Sources of heights, lines and polygons that are known by name: where their files are, and what must be said of them.
//!
//! Nothing of it is needed for files that a job names itself.

use std::path::Path;

use toml::{Table, Value};

use crate::failure::Failure;
#[cfg(not(feature = "fetch"))]
use crate::failure::Outcome;

const BUILT_IN: &str = include_str!("catalogue.toml");
/// Bytes of a catalogue at most.
const BYTES_MAX: u64 = 1 << 20;

/// All that is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Catalogue {
    /// Sources of heights; of two with one name the first counts.
    pub heights: Vec<Entry>,
    /// The same of lines and polygons.
    pub vectors: Vec<Vectors>,
}

/// A source of lines and polygons that is known by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Vectors {
    /// The name on the command line.
    pub name: String,
    /// What it is and where it has something.
    pub title: String,
    /// How a person finds out about its releases.
    pub ask: String,
    /// Addresses of roads, rivers and lakes, with a place for the release.
    pub features: Vec<String>,
    /// The same of buildings, walls and woods.
    pub objects: Vec<String>,
    /// Under which licence it is.
    pub licence: String,
    /// Whom to thank, in the words that its licence asks for.
    pub attribution: String,
}

/// A source of heights that is known by name.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The name on the command line.
    pub name: String,
    /// What it is and where it has ground.
    pub title: String,
    /// The address of a file, with places for the borders of a square of one degree; none of a source whose files a
    /// person must name.
    pub address: Option<String>,
    /// How a person finds its files, where there is no address.
    pub ask: String,
    /// Metres between its posts, about.
    pub spacing_m: f64,
    /// A spacing of the working grid for it, in metres, that divides 125 m.
    pub grid_m: f64,
    /// What its heights are measured from.
    pub datum: String,
    /// The unit of its heights.
    pub unit: String,
    /// `surface`, with roofs and crowns, or `terrain`.
    pub model: String,
    /// Under which licence it is.
    pub licence: String,
    /// Whom to thank, in the words that its licence asks for.
    pub attribution: String,
}

impl Entry {
    /// Addresses of the files with ground between longitudes and latitudes in degrees, from the south-west, and without
    /// an address that stands for all squares twice.
    pub fn addresses(&self, [west, south]: [f64; 2], [east, north]: [f64; 2]) -> Vec<String> {
        let (mut all, Some(pattern)) = (Vec::new(), &self.address) else { return Vec::new() };
        for latitude in south.floor() as i32..=north.floor() as i32 {
            for longitude in west.floor() as i32..=east.floor() as i32 {
                let longitude = (longitude + 180).rem_euclid(360) - 180;
                let address = filled(pattern, latitude, longitude);
                if !all.contains(&address) {
                    all.push(address);
                }
            }
        }
        all
    }
}

/// Where the release stands in an address.
const RELEASE: &str = "{release}";

impl Vectors {
    /// Addresses of features, and of objects, of a release.
    ///
    /// # Errors
    /// When there are releases and none is named, or by what is none.
    pub fn of_release(&self, release: Option<&str>) -> Result<[Vec<String>; 2], Failure> {
        let has_releases = self.features.iter().chain(&self.objects).any(|address| address.contains(RELEASE));
        let is_plain =
            |text: &str| !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || "-_.".contains(c));
        match release {
            None if has_releases => Err(Failure::new(
                format!("--vectors {}: found no --release, expected one", self.name),
                self.ask.clone(),
            )),
            Some(text) if !is_plain(text) => {
                Err(Failure::new(format!("--release {text}: expected letters, digits, - and ."), self.ask.clone()))
            }
            _ => {
                let named = |address: &String| address.replace(RELEASE, release.unwrap_or_default());
                Ok([&self.features, &self.objects].map(|all| all.iter().map(named).collect()))
            }
        }
    }
}

impl Catalogue {
    /// The source of heights of a name.
    ///
    /// # Errors
    /// When none has it.
    pub fn heights(&self, name: &str) -> Result<&Entry, Failure> {
        let names: Vec<&str> = self.heights.iter().map(|entry| entry.name.as_str()).collect();
        let found = self.heights.iter().find(|entry| entry.name == name);
        found.ok_or_else(|| unknown(&format!("--dem {name}"), &names))
    }

    /// The source of lines and polygons of a name.
    ///
    /// # Errors
    /// When none has it.
    pub fn vectors(&self, name: &str) -> Result<&Vectors, Failure> {
        let names: Vec<&str> = self.vectors.iter().map(|vectors| vectors.name.as_str()).collect();
        let found = self.vectors.iter().find(|vectors| vectors.name == name);
        found.ok_or_else(|| unknown(&format!("--vectors {name}"), &names))
    }

    /// The licence and the attribution of what an address is of.
    #[cfg(feature = "fetch")]
    pub fn said_of(&self, address: &str) -> Option<(&str, &str)> {
        let is_of = |pattern: &String| address.starts_with(pattern.split('{').next().unwrap_or_default());
        let heights = self.heights.iter().find(|entry| entry.address.iter().any(is_of));
        let vectors = || self.vectors.iter().find(|vectors| vectors.features.iter().chain(&vectors.objects).any(is_of));
        let said = heights.map(|entry| (entry.licence.as_str(), entry.attribution.as_str()));
        said.or_else(|| vectors().map(|vectors| (vectors.licence.as_str(), vectors.attribution.as_str())))
    }
}

fn unknown(asked: &str, names: &[&str]) -> Failure {
    Failure::new(format!("{asked}: found no such source, expected one of {}", names.join(", ")), {
        "`tiefort sources` says what they are; files of yours need no name: tiefort init dem.tif"
    })
}

/// The address of the square of one degree with this south-western corner.
fn filled(pattern: &str, latitude: i32, longitude: i32) -> String {
    let parallel = |degrees: i32| format!("{}{:02}", if degrees < 0 { 'S' } else { 'N' }, degrees.abs());
    let meridian = format!("{}{:03}", if longitude < 0 { 'W' } else { 'E' }, longitude.abs());
    let (south, north) = (parallel(latitude), parallel(latitude + 1));
    let mut address = pattern.to_owned();
    for (name, value) in [("SOUTH", &south), ("NORTH", &north), ("WEST", &meridian)] {
        address = address.replace(&format!("{{{name}}}"), value);
        address = address.replace(&format!("{{{}}}", name.to_lowercase()), &value.to_lowercase());
    }
    address
}

/// All known sources: those of the file at `own`, then the built-in ones.
///
/// # Errors
/// When that file cannot be read, or an entry is not whole.
pub fn catalogue(own: Option<&Path>) -> Result<Catalogue, Failure> {
    let mut all = Catalogue { heights: Vec::new(), vectors: Vec::new() };
    if let Some(path) = own {
        let hint = "`tiefort sources --toml` prints the built-in ones as an example";
        let unreadable = |found: String| Failure::new(format!("{}: found {found}", path.display()), hint);
        let data = std::fs::metadata(path).map_err(|error| unreadable(error.to_string()))?;
        if !data.is_file() || BYTES_MAX < data.len() {
            return Err(unreadable(format!("{} bytes, expected a catalogue of at most {BYTES_MAX}", data.len())));
        }
        let text = std::fs::read_to_string(path).map_err(|error| unreadable(error.to_string()))?;
        all = read(&text).map_err(unreadable)?;
    }
    let built_in = read(BUILT_IN).expect("the built-in catalogue is whole");
    all.heights.extend(built_in.heights);
    all.vectors.extend(built_in.vectors);
    Ok(all)
}

/// The built-in catalogue as it is written.
pub fn built_in() -> &'static str {
    BUILT_IN
}

fn read(text: &str) -> Result<Catalogue, String> {
    let table: Table = text.parse().map_err(|error: toml::de::Error| error.message().to_owned())?;
    let list = |key: &str| -> Result<Vec<&Table>, String> {
        let all = table.get(key).and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
        all.iter().map(|source| source.as_table().ok_or_else(|| format!("a {key} that is no table"))).collect()
    };
    let heights = list("source")?.into_iter().map(entry).collect::<Result<Vec<_>, _>>()?;
    let vectors = list("vectors")?.into_iter().map(vectors).collect::<Result<Vec<_>, _>>()?;
    match heights.is_empty() && vectors.is_empty() {
        true => Err("no [[source]] and no [[vectors]]".into()),
        false => Ok(Catalogue { heights, vectors }),
    }
}

fn vectors(table: &Table) -> Result<Vectors, String> {
    let text = |key: &str| table.get(key).and_then(Value::as_str).map(str::to_owned);
    let name = text("name").ok_or("vectors without a name")?;
    let needed = |key: &str| text(key).ok_or_else(|| format!("{name} without {key}"));
    let addresses = |key: &str| {
        let all = table.get(key).and_then(Value::as_array).map(Vec::as_slice).unwrap_or_default();
        let address = |value: &Value| {
            let address = value.as_str().unwrap_or_default();
            let sound = job::check_address(&address.replace(RELEASE, "0"));
            sound.map(|()| address.to_owned()).map_err(|expected| format!("{name}: {key}: expected {expected}"))
        };
        all.iter().map(address).collect::<Result<Vec<_>, _>>()
    };
    let (title, ask, licence, attribution) =
        (needed("title")?, text("ask").unwrap_or_default(), needed("licence")?, needed("attribution")?);
    let (features, objects) = (addresses("features")?, addresses("objects")?);
    Ok(Vectors { name, title, ask, features, objects, licence, attribution })
}

fn entry(table: &Table) -> Result<Entry, String> {
    let text = |key: &str| table.get(key).and_then(Value::as_str).map(str::to_owned);
    let name = text("name").ok_or("a source without a name")?;
    let needed = |key: &str| text(key).ok_or_else(|| format!("{name} without {key}"));
    let metres = |key: &str| {
        let number = table.get(key).and_then(|value| value.as_float().or(value.as_integer().map(|whole| whole as f64)));
        number.filter(|metres| 0.0 < *metres).ok_or_else(|| format!("{name} without {key}, a number of metres"))
    };
    let address = text("address");
    if let Some(pattern) = &address {
        job::check_address(&filled(pattern, 0, 0))
            .map_err(|expected| format!("{name}: address: expected {expected}"))?;
    }
    let model = needed("model")?;
    if !["surface", "terrain"].contains(&model.as_str()) {
        return Err(format!("{name}: model = \"{model}\", expected \"surface\" or \"terrain\""));
    }
    let ask = if address.is_none() { needed("ask")? } else { String::new() };
    Ok(Entry {
        title: needed("title")?,
        address,
        ask,
        spacing_m: metres("spacing_m")?,
        grid_m: metres("grid_m")?,
        datum: needed("datum")?,
        unit: needed("unit")?,
        model,
        licence: needed("licence")?,
        attribution: needed("attribution")?,
        name,
    })
}

/// Says how to get a program that can fetch.
#[cfg(not(feature = "fetch"))]
pub fn without_fetch() -> Result<Outcome, Failure> {
    Err(Failure::new(
        "this tiefort was built without fetching",
        "build it with `--features fetch`, which is the default; files can also be fetched by other means and named",
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_of_a_degree_have_the_names_that_their_sources_give_them() {
        let entries = catalogue(None).unwrap();
        let of = |name: &str, low, high| entries.heights(name).unwrap().addresses(low, high);
        assert_eq!(
            of("glo30", [-116.9, 35.1], [-116.3, 35.6]),
            ["https://copernicus-dem-30m.s3.amazonaws.com/Copernicus_DSM_COG_10_N35_00_W117_00_DEM/\
              Copernicus_DSM_COG_10_N35_00_W117_00_DEM.tif"]
        );
        assert_eq!(
            of("3dep13", [-116.9, 35.1], [-116.3, 35.6]),
            ["https://prd-tnm.s3.amazonaws.com/StagedProducts/Elevation/13/TIFF/current/n36w117/USGS_13_n36w117.tif"]
        );
        let south = of("glo90", [-0.1, -0.1], [0.1, 0.1]);
        assert!(south.len() == 4 && south[0].contains("S01_00_W001") && south[3].contains("N00_00_E000"), "{south:?}");
        assert!(of("glo30", [179.9, 1.0], [180.1, 1.5])[1].contains("W180"));
        assert!(of("3dep1m", [0.0; 2], [1.0; 2]).is_empty());
        let address = &of("glo30", [6.0, 45.0], [6.5, 45.5])[0];
        assert_eq!(entries.said_of(address).unwrap().0, entries.heights("glo30").unwrap().licence);
        assert!(entries.said_of("https://a.org/x.tif").is_none());
        let overture = entries.vectors("overture").unwrap();
        assert!(overture.of_release(None).is_err() && overture.of_release(Some("a/b")).is_err());
        let [features, objects] = overture.of_release(Some("2025-11-19.0")).unwrap();
        assert_eq!((features.len(), objects.len()), (2, 3));
        assert!(features[0].ends_with("/2025-11-19.0/theme=transportation/type=segment/*.parquet"), "{features:?}");
        assert_eq!(entries.said_of(&features[0]).unwrap().0, "ODbL 1.0");
    }

    #[test]
    fn entries_of_ones_own_go_before_and_must_be_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("own.toml");
        let own = "[[source]]\nname = \"glo30\"\ntitle = \"ours\"\naddress = \"s3://dem/{south}{west}.tif\"\n\
            spacing_m = 30\ngrid_m = 25\ndatum = \"EGM96\"\nunit = \"m\"\nmodel = \"terrain\"\nlicence = \"x\"\n\
            attribution = \"y\"\n";
        std::fs::write(&path, own).unwrap();
        let entries = catalogue(Some(&path)).unwrap();
        assert_eq!(entries.heights("glo30").unwrap().addresses([7.5, -3.5], [7.6, -3.4]), ["s3://dem/s04e007.tif"]);
        for (old, new) in [("s3://", "ftp://"), ("grid_m = 25", ""), ("\"terrain\"", "\"lunar\""), ("[[source]]", "[")]
        {
            std::fs::write(&path, own.replace(old, new)).unwrap();
            assert!(catalogue(Some(&path)).unwrap_err().to_string().contains("own.toml"));
        }
    }
}
