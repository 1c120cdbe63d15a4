//! `tiefort export`: a finished database in another program's format.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use build::CompileError;
use build::product::{BuiltFrom, Opened, read_told};
use clap::Args;
use exports::{
    Block, CARRIES, Carries, Coordinates, Datum, Engine, ExportError, Facts, Forecast, Format, HeightEncoding,
    LEFT_OUT, Levels, Mesh, Product, TextureFile, Textures, WebMap, Work,
};
use job::Job;
use store::Folder;
use terrain::{MaterialName, ModuleId, PostRect};
use views::grouped;

use super::export_formats::{ENCODINGS, ENGINES, Layer, TEXTURES, material};
use super::export_together::Several;
use crate::arguments::{Workers, coordinates, one_of, row_col};
use crate::failure::{Failure, Outcome};
use crate::new_folder::NewFolder;
use crate::signals::Signals;
use crate::steps::Steps;
use crate::{files, terminal};

const AFTER_HELP: &str = "\
Examples:
  tiefort export ntc.tdb --format glb --modules 40,40..54,54 --out block.glb
  tiefort export ntc.tdb --format modules --out ntc_modules
  tiefort export ntc.tdb --format obj --lod 2 --out coarse.obj
  tiefort export ntc.tdb --format gpkg --out ntc.gpkg
  tiefort export ntc.tdb --format geotiff --layer residual --out residual.tif
  tiefort export ntc.tdb --format 3dtiles --assume-datum EGM96 --out ntc_3dtiles
  tiefort export ntc.tdb desert.tdb --format 3tz --assume-datum EGM96 --out b.3tz
  tiefort export ntc.tdb --format usd --out ntc_usd
  tiefort export ntc.tdb --format terrain-rgb --out ntc.pmtiles
  tiefort export ntc.tdb --format heightmap --engine unity --out ntc_unity

--lod K exports a coarser level alone, where the job has [lod] levels; 3dtiles
and 3tz go on to those coarser than K. A mesh (ply, obj, glb) is counted in metres
from the south-west corner of what is exported, as usd and gazebo are; the file
itself, or NAME.json beside it, says where that is. Load modules are named
ROW,COL from the south-west, nodes of a glb r0003c0017. A geotiff is cloud
optimised, with overviews; it names the system of its heights where that is
known. 3tz is 3dtiles in one file, mbtiles quantized-mesh in one; these and
3dtiles-terrain want heights above the ellipsoid: they know EGM96 and the
ellipsoid, and refuse any other datum unless told what to take it for. Several databases become one
tileset (3dtiles, 3tz), each in a folder of its number, in any coordinate
systems; where they overlap, that of the smaller spacing is there, then that of
more triangles, then the first. terrain-rgb is a file of
MBTiles or PMTiles by its name; its heights stay above the database's datum.

Ribbons are bands over roads, rails and streams that are lines in the ground, 5
cm above it; objects are buildings, walls and woods. Classes, ribbons and
objects are called by names, which --material gives otherwise.

What becomes of them in which format:";

fn after_help() -> String {
    format!("{AFTER_HELP}{}", exports::carries_text())
}

/// Arguments of `export`.
#[derive(Args)]
#[command(after_help = after_help())]
pub struct Arguments {
    /// Folder of the terrain database; for 3dtiles and 3tz several, which become one tileset
    #[arg(value_name = "DIR", required = true)]
    databases: Vec<PathBuf>,
    /// What to write
    #[arg(long, value_parser = one_of(CARRIES.map(|row| (row.name, row.format, row.meaning))))]
    format: Format,
    /// The south-west and north-east load module of a block, or a single one [default: the whole area]
    #[arg(long, value_name = "ROW,COL..ROW,COL", value_parser = block)]
    modules: Option<Block>,
    /// Level of detail, 0 being the finest [default: all that the database has where the format has room for them, as
    /// the table below says, else 0]
    #[arg(long, value_name = "K")]
    lod: Option<usize>,
    /// What coordinates are counted from; for ply and obj only
    #[arg(long, value_parser = coordinates(), default_value = "local")]
    coordinates: Coordinates,
    /// What the raster holds; for geotiff only [default: surface]
    #[arg(long, value_enum)]
    layer: Option<Layer>,
    /// A raster to take the residual against, or several [default: the ground the database was built from]
    #[arg(long, value_name = "DEM")]
    against: Vec<PathBuf>,
    /// What to take heights to be above, whatever the database says: EGM96, ellipsoid, or metres that their datum
    /// lies above the ellipsoid; for 3dtiles, 3dtiles-terrain, 3tz, quantized-mesh and mbtiles only
    #[arg(long, value_name = "DATUM", value_parser = datum, allow_hyphen_values = true)]
    assume_datum: Option<Datum>,
    /// Whose heightmaps; for heightmap only
    #[arg(long, value_parser = one_of(ENGINES), default_value = "unreal")]
    engine: Engine,
    /// Samples along a side of a heightmap, one of those that the engine takes [default: the least that holds the area
    /// in one, else 2017 or 2049]; pixels along a side of a tile of terrain-rgb, 256 or 512 [default: 512]
    #[arg(long, value_name = "N")]
    size: Option<usize>,
    /// How heights become colours; for terrain-rgb only [default: mapbox]
    #[arg(long, value_parser = one_of(ENCODINGS))]
    encoding: Option<HeightEncoding>,
    /// Whether roads, rails and streams that are lines in the ground are bands over it, where the format has meshes
    #[arg(long, value_name = "BOOL", default_value_t = true, action = clap::ArgAction::Set)]
    ribbons: bool,
    /// Another name for a material, once for each: primary=asphalt, building_wall=plaster
    #[arg(long = "material", value_name = "MATERIAL=NAME", value_parser = material)]
    materials: Vec<(String, String)>,
    /// Orthophotos that the ground is seen with, later ones above earlier: GeoTIFF in any system; for the meshes of
    /// scenes, as the table below says
    #[arg(long, value_name = "FILE", num_args = 1..)]
    imagery: Vec<PathBuf>,
    /// Metres of a texel, or more where its texture would be too large [default: that of the finest orthophoto]
    #[arg(long, value_name = "M", value_parser = texel_m, requires = "imagery")]
    texel_m: Option<f64>,
    /// What kind of file a texture is; rgb, SGI's, for openflight only
    #[arg(long, value_parser = one_of(TEXTURES), default_value = "jpeg", requires = "imagery")]
    texture: TextureFile,
    /// Texels along a side of a texture at most
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = clap::value_parser!(u16).range(16..=16384))]
    texture_max: u16,
    #[command(flatten)]
    workers: Workers,
    /// Print errors only
    #[arg(long)]
    quiet: bool,
    /// The file or folder to write: a file of that name is replaced once the new one is whole; a folder must not exist
    /// yet, or be empty
    #[arg(long, value_name = "PATH")]
    out: PathBuf,
}

impl Arguments {
    /// The database, where only one can be.
    fn database(&self) -> &Path {
        &self.databases[0]
    }

    /// How many things are done at once.
    pub fn workers(&self) -> usize {
        self.workers.count()
    }
}

fn block(text: &str) -> Result<Block, String> {
    let module = |text: &str| row_col(text).map(|tile| ModuleId { row: tile.row, col: tile.col });
    let wrong = |_| "expected ROW,COL..ROW,COL, the south-west and the north-east load module, such as 2,3..5,7";
    let (south_west, north_east) = text.split_once("..").unwrap_or((text, text));
    Ok(Block { south_west: module(south_west).map_err(wrong)?, north_east: module(north_east).map_err(wrong)? })
}

fn texel_m(text: &str) -> Result<f64, String> {
    let metres = text.parse().ok().filter(|metres: &f64| (0.001..=1e6).contains(metres));
    metres.ok_or_else(|| "expected metres, such as 0.5".to_owned())
}

/// Reads what heights are to be taken to be above.
///
/// # Errors
/// In words, when it is anything else.
pub fn datum(text: &str) -> Result<Datum, String> {
    let metres = text.parse().ok().filter(|metres: &f64| metres.abs() <= DATUM_M_MAX).map(Datum::Above);
    metres.or_else(|| Datum::named(text)).ok_or("expected EGM96, ellipsoid, or metres to add, such as -30.5".into())
}

/// How far a datum may lie above or below the ellipsoid: twice what any geoid does.
const DATUM_M_MAX: f64 = 250.0;

/// Exports.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let signals = Signals::watch()?;
    let steps = Steps::start(arguments.quiet);
    let tell = |step| steps.tell(step);
    let workers = schedule::Workers::new(arguments.workers());
    let work = Work { workers: &workers, stop: signals.stop(), tell: &tell };
    let exported = checked(arguments, &work);
    let seconds = steps.finish();
    let summary = exported.map_err(|failure| failure.after(signals.exit_code()))?;
    if !arguments.quiet {
        terminal::tell(&format!("{summary} in {seconds:.1} s: {}", files::shown(&arguments.out).display()));
    }
    Ok(Outcome::Sound)
}

/// Refuses what cannot be, else does it; what was exported, in words.
///
/// # Errors
/// When it cannot be, the database cannot be read, or nothing can be written there.
pub fn checked(arguments: &Arguments, work: &Work) -> Result<String, Failure> {
    check(arguments)?;
    if arguments.databases.len() == 1 {
        return export(arguments, work);
    }
    let read = |database: &Path| {
        let product = prepared(arguments, database, work)?;
        let holds = summary(arguments.format, &product, None);
        Ok((product, holds))
    };
    let Arguments { databases, format, assume_datum, out, .. } = arguments;
    let several = Several { databases, format: *format, assumed: *assume_datum, out, read: &read };
    several.check(arguments.modules.is_some())?;
    several.export(work)
}

/// What is given, as it is written, and the formats that take it.
type Refused = (fn(&Arguments) -> bool, &'static str, fn(&Carries) -> bool);

/// Arguments that some formats alone have room for.
const REFUSED: [Refused; 8] = [
    (
        |given| given.coordinates == Coordinates::Map,
        "--coordinates map",
        |row| matches!(row.format, Format::Ply | Format::Obj),
    ),
    (|given| given.layer.is_some(), "--layer", |row| row.format == Format::Geotiff),
    (|given| given.assume_datum.is_some(), "--assume-datum", |row| row.is_for_globes),
    (|given| !given.imagery.is_empty(), "--imagery", |row| row.textures != LEFT_OUT),
    (|given| given.texture == TextureFile::Rgb, "--texture rgb", |row| row.format == Format::Openflight),
    (|given| given.engine != Engine::Unreal, "--engine", |row| row.format == Format::Heightmap),
    (|given| given.size.is_some(), "--size", |row| matches!(row.format, Format::Heightmap | Format::TerrainRgb)),
    (|given| given.encoding.is_some(), "--encoding", |row| row.format == Format::TerrainRgb),
];

/// Refuses what cannot be, before any work.
fn check(arguments: &Arguments) -> Result<(), Failure> {
    let carries = arguments.format.carries();
    for (is_given, given, takes) in REFUSED {
        if is_given(arguments) && !takes(carries) {
            let expected: Vec<&str> = CARRIES.iter().filter(|row| takes(row)).map(|row| row.name).collect();
            let expected = expected.join(", ");
            let message = format!("found {given} with --format {}, expected one of {expected}", carries.name);
            return Err(Failure::new(message, "leave it out, or choose such a format"));
        }
    }
    let residual = arguments.layer == Some(Layer::Residual);
    if !arguments.against.is_empty() && !residual {
        let message = "found --against without --layer residual, expected both or none";
        return Err(Failure::new(message, "only a residual is taken against a raster"));
    }
    let expected = carries.extensions;
    if expected.is_empty() {
        return Ok(());
    }
    let found = files::extension(&arguments.out);
    if !expected.contains(&found.as_str()) {
        let quoted = expected.iter().map(|extension| format!("{extension:?}")).collect::<Vec<_>>().join(" or ");
        let message = format!("{}: found the extension {found:?}, expected {quoted}", arguments.out.display());
        let hint = format!("--format {} writes one file whose name ends in .{}", carries.name, expected.join(" or ."));
        return Err(Failure::new(message, hint));
    }
    files::check_writable(&arguments.out)
}

/// The levels that a format has room for: where none is named all of them, and a tileset goes on to coarser ones.
fn levels(arguments: &Arguments) -> Levels {
    match (arguments.format, arguments.lod) {
        (Format::Modules | Format::Glb | Format::Openflight | Format::Usd, None) => Levels::From(0),
        (Format::Tiles3d | Format::Archive, level) => Levels::From(level.unwrap_or(0)),
        (_, level) => Levels::One(level.unwrap_or(0)),
    }
}

/// Does it; what was exported, in words.
fn export(arguments: &Arguments, work: &Work) -> Result<String, Failure> {
    let folder =
        arguments.format.carries().extensions.is_empty().then(|| NewFolder::begin(&arguments.out)).transpose()?;
    let product = prepared(arguments, arguments.database(), work)?;
    tell_size(arguments, &product)?;
    match arguments.format {
        Format::Ply | Format::Obj | Format::Glb => write_mesh(arguments, &product)?,
        Format::Geotiff => write_raster(arguments, &product, work)?,
        Format::Gpkg => write_package(arguments, &product, work)?,
        Format::Features => write_features(arguments)?,
        Format::TerrainRgb => write_web_map(arguments, &product, work)?,
        _ => {}
    }
    let mut said = write_globe_file(arguments, &product, work)?;
    if let Some(folder) = folder {
        let put = |name: &str, bytes: &[u8]| folder.put(name, bytes).map_err(ExportError::write(name));
        match arguments.format {
            Format::Openflight => exports::write_openflight(&product, &put, work)?,
            Format::Tiles3d => said = Some(exports::write_3dtiles(&product, arguments.assume_datum, &put, work)?),
            Format::QuantizedMesh => {
                said = Some(exports::write_quantized_mesh(&product, arguments.assume_datum, &put, work)?);
            }
            Format::Tiles3dTerrain => {
                said = Some(exports::write_3dtiles_terrain(&product, arguments.assume_datum, &put, work)?);
            }
            Format::Usd => exports::write_usd(&product, &put, work)?,
            Format::Gazebo => exports::write_gazebo(&product, &put, work)?,
            Format::Heightmap => {
                exports::write_heightmap(&product, arguments.engine, arguments.size, &put, work)?;
            }
            _ => exports::write_modules(&product, &put, work)?,
        }
        folder.finish()?;
    }
    Ok(summary(arguments.format, &product, said))
}

/// Tells about how much will be written, and where that has no room.
fn tell_size(arguments: &Arguments, product: &Product) -> Result<(), Failure> {
    let forecast = if arguments.quiet { None } else { Forecast::of(product, arguments.format.carries())? };
    let Some(Forecast { triangles, bytes, texture_bytes }) = forecast else { return Ok(()) };
    let textures = match texture_bytes {
        0 => String::new(),
        bytes => format!(", {} of it textures", files::bytes_text(bytes)),
    };
    let room = crate::fit::free_disk(&arguments.out).filter(|&free| free < bytes);
    let room = room.map(|free| format!("; {} are free there", files::bytes_text(free))).unwrap_or_default();
    let triangles = grouped(triangles);
    terminal::tell(&format!("about {} of {triangles} triangles{textures}{room}", files::bytes_text(bytes)));
    Ok(())
}

/// What of a database is exported, as it is to be seen.
fn prepared(arguments: &Arguments, database: &Path, work: &Work) -> Result<Product, Failure> {
    let product = Product::read(database, arguments.modules, levels(arguments), work)?;
    let job = Job::from_text(&product.manifest.job, database)?;
    let mut product = product.leaving_out(&job.lod.leave_out);
    product.has_ribbons = arguments.ribbons;
    product.name_materials(materials(arguments, job.materials)?)?;
    open_imagery(arguments, &mut product)?;
    Ok(product)
}

/// What materials are called: as the job says in `materials`, and before that as the arguments say.
fn materials(arguments: &Arguments, mut materials: Vec<MaterialName>) -> Result<Vec<MaterialName>, Failure> {
    for (at, (of, name)) in arguments.materials.iter().cloned().enumerate() {
        if arguments.materials[..at].iter().any(|(before, _)| *before == of) {
            return Err(Failure::new(format!("found --material {of}=… twice"), "give each material one name"));
        }
        match materials.iter_mut().find(|named| named.of == of) {
            Some(named) => named.name = name,
            None => materials.push(MaterialName { of, name, ..MaterialName::default() }),
        }
    }
    Ok(materials)
}

/// Lays orthophotos over what is exported, where some are named.
fn open_imagery(arguments: &Arguments, product: &mut Product) -> Result<(), Failure> {
    if arguments.imagery.is_empty() {
        return Ok(());
    }
    let rect = product.rect;
    let ends = [product.corner_m(rect.south, rect.west), product.corner_m(rect.north, rect.east)];
    let most = usize::from(arguments.texture_max);
    let file = (arguments.texture, most);
    let textures = Textures::open(&arguments.imagery, product.crs(), ends, arguments.texel_m, file)?;
    product.textures = Some(Arc::new(textures));
    Ok(())
}

/// What was exported, in words; `said` is what was done to heights.
fn summary(format: Format, product: &Product, said: Option<Datum>) -> String {
    let triangles: usize = product.modules.iter().map(|module| module.triangles.len()).sum();
    let triangles = triangles + if format.carries().is_without_decks() { 0 } else { product.deck_triangles() };
    let modules = match product.modules.len() {
        1 => "1 load module".to_owned(),
        count => format!("{} load modules", grouped(count as u64)),
    };
    let said = said.map(|datum| format!("{}\n", datum.said())).unwrap_or_default();
    let coarser: usize = product.coarser.iter().flatten().map(|module| module.counts().triangles as usize).sum();
    let level = match (product.level, product.coarser.len()) {
        (0, 0) => String::new(),
        (level, 0) => format!(" at level {level}"),
        (level, more) => {
            format!(" at level {level}, {} more at levels up to {}", grouped(coarser as u64), level + more)
        }
    };
    let carries = format.carries();
    let holes = match product.hole_triangles() {
        0 => String::new(),
        1 => format!("1 triangle over a hole is {}\n", carries.holes),
        count => format!("{} triangles over holes are {}\n", grouped(count as u64), carries.holes),
    };
    let counted = |count: usize, what: &str, become_of: &str| match count {
        0 => String::new(),
        count => format!("{} {what} are {become_of}\n", grouped(count as u64)),
    };
    let over_holes = counted(product.over_holes, "objects over holes", "left out: nothing is known of their ground");
    let decks = counted(product.deck_triangles(), "triangles of decks", carries.decks);
    let ribbons = match product.ribbons_m() / 1000.0 {
        0.0 => String::new(),
        km => format!("ribbons of {km:.1} km are {}\n", carries.ribbons),
    };
    let objects = counted(product.object_count(), "objects", carries.objects);
    let coarser = product.textures.as_ref().and_then(|textures| textures.coarser_m());
    let texels = coarser.map_or_else(String::new, |[wanted_m, found_m]| {
        format!("texels have up to {found_m:.2} m, not {wanted_m:.2} m: textures hold no more, see --texture-max\n")
    });
    format!(
        "{said}{holes}{over_holes}{decks}{ribbons}{objects}{texels}{modules}, {} triangles{level}",
        grouped(triangles as u64)
    )
}

/// Writes what is one file for globes; what was done to heights.
fn write_globe_file(arguments: &Arguments, product: &Product, work: &Work) -> Result<Option<Datum>, Failure> {
    let assumed = arguments.assume_datum;
    let mut said = None;
    match arguments.format {
        Format::Archive => files::write_whole_or(&arguments.out, |out| {
            said = Some(exports::write_3tz(out, |put| exports::write_3dtiles(product, assumed, put, work))?);
            Ok(())
        })?,
        Format::Mbtiles => files::make_whole(&arguments.out, |path| {
            said = Some(exports::write_mbtiles(path, product, assumed, work)?);
            Ok(())
        })?,
        _ => {}
    }
    Ok(said)
}

fn write_web_map(arguments: &Arguments, product: &Product, work: &Work) -> Result<(), Failure> {
    let encoding = arguments.encoding.unwrap_or(HeightEncoding::Mapbox);
    let map = WebMap { encoding, pixels: arguments.size.unwrap_or(512) };
    if files::extension(&arguments.out) == "pmtiles" {
        return files::write_whole_or(&arguments.out, |out| Ok(exports::write_pmtiles(out, product, map, work)?));
    }
    files::make_whole(&arguments.out, |path| Ok(exports::write_web_mbtiles(path, product, map, work)?))
}

fn write_raster(arguments: &Arguments, product: &Product, work: &Work) -> Result<(), Failure> {
    if arguments.layer != Some(Layer::Residual) {
        return files::write_whole_or(&arguments.out, |out| Ok(exports::write_surface(out, product, work)?));
    }
    let ground = BuiltFrom::open(arguments.database(), &arguments.against)?;
    let fault = |error: CompileError| ExportError::Ground { message: error.to_string(), hint: error.hint() };
    let heights = |rect: PostRect| ground.heights(rect).map_err(|error| fault(error.into()));
    files::write_whole_or(&arguments.out, |out| Ok(exports::write_residual(out, product, &heights, work)?))
}

fn write_package(arguments: &Arguments, product: &Product, work: &Work) -> Result<(), Failure> {
    let report = Folder::new(arguments.database()).report()?;
    let job = Job::from_text(&product.manifest.job, arguments.database())?;
    let window = [job.limits.window.rows, job.limits.window.cols];
    files::make_whole(&arguments.out, |path| Ok(exports::write_gpkg(path, product, &report, window, work)?))
}

fn write_features(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.modules.is_some() {
        let message = "found --modules with --format features, which writes those of the whole area";
        return Err(Failure::new(message, "leave it out, or export a block with --format gpkg"));
    }
    let opened = Opened::open(arguments.database())?;
    let missing = "found --format features with a database without roads and water, expected one with some";
    let missing = || Failure::new(missing, "[features] in a job names their files");
    let (level, told) = read_told(&opened)?.ok_or_else(missing)?;
    let bytes = build::product::features_package(&opened.job, &level, &told.remarks).map_err(CompileError::from)?;
    files::write_whole(&arguments.out, |out| std::io::Write::write_all(out, &bytes))
}

fn write_mesh(arguments: &Arguments, product: &Product) -> Result<(), Failure> {
    let mesh = Mesh::of(product);
    let coordinates = arguments.coordinates;
    let facts = match arguments.format {
        Format::Glb => Facts::y_up(product),
        _ => Facts::z_up(product, coordinates),
    };
    let texture = product.texture(product.rect, 0.0)?;
    let extension = product.textures.as_ref().map_or("", |textures| textures.extension());
    let photo = arguments.out.with_extension(extension);
    let photo_name = texture.as_ref().and(photo.file_name()).map(|name| name.to_string_lossy().into_owned());
    let is_obj = arguments.format == Format::Obj;
    let materials = exports::obj_materials(product, &mesh, photo_name.as_deref()).filter(|_| is_obj);
    let beside_it = arguments.out.with_extension("mtl");
    let library = materials.as_ref().and(beside_it.file_name()).map(|name| name.to_string_lossy().into_owned());
    files::write_whole(&arguments.out, |out| match arguments.format {
        Format::Obj => exports::write_obj(out, product, &mesh, coordinates, library.as_deref(), texture.as_ref()),
        Format::Glb => exports::write_glb(out, product, &mesh, texture.clone()),
        _ => exports::write_ply(out, product, &mesh, coordinates),
    })?;
    if let Some(texture) = texture.filter(|_| is_obj) {
        files::write_whole(&photo, |out| std::io::Write::write_all(out, &texture.bytes))?;
    }
    if let Some(text) = materials {
        files::write_whole(&beside_it, |out| std::io::Write::write_all(out, text.as_bytes()))?;
    }
    let mut beside = arguments.out.clone().into_os_string();
    beside.push(".json");
    let text = exports::sidecar(product, &mesh, &facts);
    files::write_whole(&PathBuf::from(beside), |out| std::io::Write::write_all(out, text.as_bytes()))
}
