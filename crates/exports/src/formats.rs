//! The formats of exports and what each carries of what a database has: the one table for the arguments, the help, the
//! guide and the end of an export.

/// A format of exports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `modules`.
    Modules,
    /// `ply`.
    Ply,
    /// `obj`.
    Obj,
    /// `glb`.
    Glb,
    /// `geotiff`.
    Geotiff,
    /// `gpkg`.
    Gpkg,
    /// `features`.
    Features,
    /// `openflight`.
    Openflight,
    /// `3dtiles`.
    Tiles3d,
    /// `quantized-mesh`.
    QuantizedMesh,
    /// `3dtiles-terrain`.
    Tiles3dTerrain,
    /// `3tz`.
    Archive,
    /// `mbtiles`.
    Mbtiles,
    /// `terrain-rgb`.
    TerrainRgb,
    /// `usd`.
    Usd,
    /// `heightmap`.
    Heightmap,
    /// `gazebo`.
    Gazebo,
}

impl Format {
    /// Its row of the table.
    pub fn carries(self) -> &'static Carries {
        CARRIES.iter().find(|row| row.format == self).expect("each format has a row")
    }
}

/// What a format has of what a database has.
#[derive(Clone, Copy, Debug)]
pub struct Carries {
    /// The format.
    pub format: Format,
    /// What it is called on the command line.
    pub name: &'static str,
    /// What it is, in a line.
    pub meaning: &'static str,
    /// The extensions of which its one file must have one; none where it is a folder.
    pub extensions: &'static [&'static str],
    /// Whether its heights are above the ellipsoid of WGS 84.
    pub is_for_globes: bool,
    /// What classes of ground become.
    pub classes: &'static str,
    /// What decks of bridges become.
    pub decks: &'static str,
    /// What roads, rails and streams become that are lines in the ground.
    pub ribbons: &'static str,
    /// What buildings, walls and woods become.
    pub objects: &'static str,
    /// What orthophotos become that are laid over the ground.
    pub textures: &'static str,
    /// What becomes of triangles over holes, where no source has a height.
    pub holes: &'static str,
    /// What becomes of coarser levels.
    pub levels: &'static str,
    /// Where a corner lies across and along its way.
    pub lanes: &'static str,
    /// Bytes of all files for each triangle of a mesh, within a quarter; 0 where they do not follow from triangles.
    pub triangle_bytes: f64,
}

impl Carries {
    /// Whether all of it has one texture, in or beside one file.
    pub(crate) fn is_one_file(&self) -> bool {
        matches!(self.format, Format::Obj | Format::Glb)
    }

    /// Whether it has room for the ground alone, and decks are left out.
    pub fn is_without_decks(&self) -> bool {
        self.decks == GROUND_ALONE
    }

    /// Whether coarser levels have textures of their own.
    pub(crate) fn has_textures_of_levels(&self) -> bool {
        self.textures == TILES.textures
    }
}

/// What a format says of what it has no room for.
pub const LEFT_OUT: &str = "left out";
const ONE: &str = "left out, but for the one that --lod names";
const LAST_UVS: &str = "the last TEXCOORD";
const GROUND_ALONE: &str = "left out: there is room for the ground alone";

const MESH: Carries = Carries {
    format: Format::Modules,
    name: "",
    meaning: "",
    extensions: &[],
    is_for_globes: false,
    classes: "materials",
    decks: "meshes of their own",
    ribbons: "meshes of their own",
    objects: "meshes of their own",
    textures: LEFT_OUT,
    holes: LEFT_OUT,
    levels: ONE,
    lanes: LEFT_OUT,
    triangle_bytes: 0.0,
};
const RASTER: Carries =
    Carries { classes: LEFT_OUT, decks: GROUND_ALONE, ribbons: GROUND_ALONE, objects: GROUND_ALONE, ..MESH };
const TILES: Carries = Carries {
    objects: "meshes whose features have id, class and height",
    textures: "a picture in each tile, coarser farther away",
    levels: "tiles between a square and its load modules",
    lanes: LAST_UVS,
    triangle_bytes: 32.0,
    ..MESH
};
const CLOSED: &str = "kept, since tiles must be closed; holes.geojson says where they are";

/// The table, in the order of the formats.
pub const CARRIES: [Carries; 17] = [
    Carries {
        format: Format::Modules,
        name: "modules",
        meaning: "A folder with one load-module file (docs/FORMAT.md) for each load module",
        classes: "a class for each triangle",
        decks: "in the files of their load modules",
        ribbons: "middle lines in the files of their load modules",
        objects: "in the files of their load modules",
        holes: "of class 255, as in the database",
        levels: "all in the files of their load modules",
        ..MESH
    },
    Carries {
        format: Format::Ply,
        name: "ply",
        meaning: "A mesh as binary PLY",
        extensions: &["ply"],
        classes: "faces class by class",
        decks: "faces behind those of the ground",
        ribbons: "faces behind those of decks",
        objects: "the last faces",
        triangle_bytes: 23.0,
        ..MESH
    },
    Carries {
        format: Format::Obj,
        name: "obj",
        meaning: "A mesh as Wavefront OBJ",
        extensions: &["obj"],
        classes: "materials in NAME.mtl",
        objects: "an object each",
        textures: "a picture beside it",
        triangle_bytes: 49.0,
        ..MESH
    },
    Carries {
        format: Format::Glb,
        name: "glb",
        meaning: "A mesh as binary glTF 2.0",
        extensions: &["glb"],
        objects: "a node each, with id and height",
        textures: "a picture inside",
        levels: "nodes of MSFT_lod in place of those of load modules",
        lanes: LAST_UVS,
        triangle_bytes: 40.0,
        ..MESH
    },
    Carries {
        format: Format::Geotiff,
        name: "geotiff",
        meaning: "A Cloud Optimized GeoTIFF of the compiled surface, or of its residual",
        extensions: &["tif"],
        holes: "NaN in the raster",
        ..RASTER
    },
    Carries {
        format: Format::Gpkg,
        name: "gpkg",
        meaning: "A GeoPackage for QGIS: load modules, breaches, tiles, triangles, decks, with styles",
        extensions: &["gpkg"],
        classes: "an attribute",
        decks: "in the layer decks",
        ribbons: "middle lines in the layer lines",
        objects: "in the layers buildings, woods, rows and points",
        holes: "in the layer triangles, of class hole",
        ..MESH
    },
    Carries {
        format: Format::Features,
        name: "features",
        meaning: "A GeoPackage of roads, rivers and lakes as they are in the ground, and what was mended, \
                  degraded or left out",
        extensions: &["gpkg"],
        classes: "an attribute",
        decks: "in the layer decks",
        ribbons: "in the layer lines",
        objects: "left out: --format gpkg has them",
        holes: "in none of its layers",
        levels: "left out: they have the same features",
        ..MESH
    },
    Carries {
        format: Format::Openflight,
        name: "openflight",
        meaning: "A folder of OpenFlight 16.1 files, one for each 4 km square, and a MetaFlight index",
        classes: "materials and surface material codes",
        objects: "an object each, their materials from code 256 on",
        textures: "a picture for each square",
        levels: "level-of-detail nodes of each square, by distance",
        lanes: "UV lists of layer 1",
        triangle_bytes: 163.0,
        ..MESH
    },
    Carries {
        format: Format::Tiles3d,
        name: "3dtiles",
        meaning: "A folder of 3D Tiles 1.1, for globes",
        is_for_globes: true,
        ..TILES
    },
    Carries {
        format: Format::QuantizedMesh,
        name: "quantized-mesh",
        meaning: "A folder of quantized-mesh 1.0 terrain, for globes",
        is_for_globes: true,
        classes: "water alone, as a mask",
        holes: CLOSED,
        ..RASTER
    },
    Carries {
        format: Format::Tiles3dTerrain,
        name: "3dtiles-terrain",
        meaning: "A folder of 3D Tiles 1.1 that CesiumJS 1.135 and later take for terrain",
        is_for_globes: true,
        holes: CLOSED,
        ..RASTER
    },
    Carries {
        format: Format::Archive,
        name: "3tz",
        meaning: "3D Tiles in one archive",
        extensions: &["3tz"],
        is_for_globes: true,
        ..TILES
    },
    Carries {
        format: Format::Mbtiles,
        name: "mbtiles",
        meaning: "Quantized-mesh terrain in one SQLite file",
        extensions: &["mbtiles"],
        is_for_globes: true,
        classes: "water alone, as a mask",
        holes: "kept, since tiles must be closed; the entry holes of metadata says where they are",
        ..RASTER
    },
    Carries {
        format: Format::TerrainRgb,
        name: "terrain-rgb",
        meaning: "Terrain for web maps, as MBTiles or PMTiles: heights as colours of PNG tiles in web mercator",
        extensions: &["mbtiles", "pmtiles"],
        holes: "0 m high, as places outside of the area",
        ..RASTER
    },
    Carries {
        format: Format::Usd,
        name: "usd",
        meaning: "A folder of OpenUSD text: a file for each tile, with collision meshes, for Isaac Sim, \
                  Omniverse and Blender",
        classes: "subsets with materials",
        objects: "a prim each, with id and height",
        textures: "a picture for each tile",
        levels: "variants of each tile, called lod",
        lanes: "primvars:lane",
        triangle_bytes: 104.0,
        ..MESH
    },
    Carries {
        format: Format::Heightmap,
        name: "heightmap",
        meaning: "A folder of 16-bit heightmaps for Unreal or Unity, with the numbers to type into the import dialog",
        classes: "maps of weights, one for each on the same samples",
        objects: "placements in objects.csv",
        holes: "as high as the triangles that close them; heightmap.json counts the samples",
        ..RASTER
    },
    Carries {
        format: Format::Gazebo,
        name: "gazebo",
        meaning: "A folder with a world for Gazebo: meshes of 2 km, loaded by distance",
        classes: "materials in classes.mtl",
        ribbons: "meshes that are seen and not hit",
        objects: "meshes that are seen, and boxes that are hit",
        textures: "a picture for each block",
        triangle_bytes: 46.0,
        ..MESH
    },
];

/// A column of the table: what it is called, and how it is read.
type Column = (&'static str, fn(&Carries) -> &'static str);

const COLUMNS: [Column; 8] = [
    ("classes", |row| row.classes),
    ("decks of bridges", |row| row.decks),
    ("ribbons", |row| row.ribbons),
    ("objects", |row| row.objects),
    ("orthophotos", |row| row.textures),
    ("holes", |row| row.holes),
    ("coarser levels", |row| row.levels),
    ("places along ways", |row| row.lanes),
];

/// The table for the help: below each thing what becomes of it, and in which formats.
pub fn carries_text() -> String {
    let mut text = String::new();
    for (name, of) in COLUMNS {
        text += &format!("\n\n  {name}");
        let mut told: Vec<(&str, Vec<&str>)> = Vec::new();
        for row in &CARRIES {
            match told.iter_mut().find(|(word, _)| *word == of(row)) {
                Some((_, formats)) => formats.push(row.name),
                None => told.push((of(row), vec![row.name])),
            }
        }
        for (word, formats) in told {
            text += &wrapped(&format!("{}: {word}", formats.join(", ")));
        }
    }
    text
}

/// Lines of at most 80 columns, below the name of what they are about.
fn wrapped(text: &str) -> String {
    const COLUMNS_MAX: usize = 80;
    let (mut lines, mut line) = (String::new(), "   ".to_owned());
    for word in text.split(' ') {
        if COLUMNS_MAX < line.len() + 1 + word.len() {
            lines += &format!("\n{line}");
            line = "     ".to_owned();
        }
        line += &format!(" {word}");
    }
    format!("{lines}\n{line}")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of the guide.
    fn carries_table() -> String {
        let head: String = COLUMNS.iter().map(|(name, _)| format!(" {name} |")).collect();
        let row = |row: &Carries| {
            let cells: String = COLUMNS.iter().map(|(_, of)| format!(" {} |", of(row))).collect();
            format!("| {} |{cells}\n", row.name)
        };
        let rows: String = CARRIES.iter().map(row).collect();
        format!("| |{head}\n|{} - |\n{rows}", " - |".repeat(COLUMNS.len()))
    }

    #[test]
    fn the_guide_has_the_table() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/guides/exports.md");
        let page = std::fs::read_to_string(path).unwrap();
        let (before, rest) = page.split_once(" cargo test -p exports -->\n\n").unwrap();
        let (found, after) = rest.split_once("\n<!-- end of what formats carry -->").unwrap();
        if std::env::var_os("UPDATE_GOLDEN").is_some() {
            let table = carries_table();
            let whole =
                format!("{before} cargo test -p exports -->\n\n{table}\n<!-- end of what formats carry -->{after}");
            std::fs::write(path, whole).unwrap();
        }
        assert_eq!(found, carries_table(), "UPDATE_GOLDEN=1 rewrites {path}");
    }

    #[test]
    fn the_help_is_no_wider_than_a_terminal() {
        let text = carries_text();
        assert!(text.lines().all(|line| line.len() <= 80) && text.contains("gazebo"), "{text}");
    }
}
