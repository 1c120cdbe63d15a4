//! The formats of `tiefort export`, and what is chosen by a word in some of them.

use clap::ValueEnum;
use exports::{CARRIES, Carries, Engine, HeightEncoding, TextureFile};

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Format {
    /// A folder with one load-module file (docs/FORMAT.md) for each load module
    Modules,
    /// A mesh as binary PLY
    Ply,
    /// A mesh as Wavefront OBJ
    Obj,
    /// A mesh as binary glTF 2.0
    Glb,
    /// A Cloud Optimized GeoTIFF of the compiled surface, or of its residual
    Geotiff,
    /// A GeoPackage for QGIS: load modules, breaches, tiles, triangles, decks, with styles
    Gpkg,
    /// A GeoPackage of roads, rivers and lakes as they are in the ground, and what was mended, degraded or left out
    Features,
    /// A folder of OpenFlight 16.1 files, one for each 4 km square, and a MetaFlight index
    Openflight,
    /// A folder of 3D Tiles 1.1, for globes
    #[value(name = "3dtiles")]
    Tiles3d,
    /// A folder of quantized-mesh 1.0 terrain, for globes
    QuantizedMesh,
    /// A folder of 3D Tiles 1.1 that CesiumJS 1.135 and later take for terrain
    #[value(name = "3dtiles-terrain")]
    Tiles3dTerrain,
    /// 3D Tiles in one archive
    #[value(name = "3tz")]
    Archive,
    /// Quantized-mesh terrain in one SQLite file
    Mbtiles,
    /// Terrain for web maps, as MBTiles or PMTiles: heights as colours of PNG tiles in web mercator
    TerrainRgb,
    /// A folder of OpenUSD text: a file for each tile, with collision meshes, for Isaac Sim, Omniverse and Blender
    Usd,
    /// A folder of 16-bit heightmaps for Unreal or Unity, with the numbers to type into the import dialog
    Heightmap,
    /// A folder with a world for Gazebo: meshes of 2 km, loaded by distance
    Gazebo,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Layer {
    /// Height of the compiled surface at every post
    Surface,
    /// Height of the ground less that of the surface
    Residual,
}

/// Whose heightmaps.
pub(super) const ENGINES: [(&str, Engine, &str); 2] = [
    ("unreal", Engine::Unreal, "Sides of 127, 253, 505, 1009, 2017, 4033, 8129, as PNG"),
    ("unity", Engine::Unity, "Sides of 2^n + 1, as RAW"),
];

/// How heights become colours.
pub(super) const ENCODINGS: [(&str, HeightEncoding, &str); 2] = [
    ("mapbox", HeightEncoding::Mapbox, "Tenths of a metre above -10,000 m"),
    ("terrarium", HeightEncoding::Terrarium, "256ths of a metre above -32,768 m"),
];

/// What kind of file a texture is.
pub(super) const TEXTURES: [(&str, TextureFile, &str); 3] = [
    ("jpeg", TextureFile::Jpeg, "JPEG"),
    ("png", TextureFile::Png, "PNG, which loses nothing"),
    ("rgb", TextureFile::Rgb, "SGI's RGB, not compressed, for image generators"),
];

impl Format {
    /// The extensions of which its one file must have one; none where it is a folder.
    pub(super) fn extensions(self) -> &'static [&'static str] {
        match self {
            Format::Ply => &["ply"],
            Format::Obj => &["obj"],
            Format::Glb => &["glb"],
            Format::Geotiff => &["tif"],
            Format::Gpkg | Format::Features => &["gpkg"],
            Format::Archive => &["3tz"],
            Format::Mbtiles => &["mbtiles"],
            Format::TerrainRgb => &["mbtiles", "pmtiles"],
            Format::Modules | Format::Openflight | Format::Tiles3d | Format::QuantizedMesh => &[],
            Format::Tiles3dTerrain | Format::Usd | Format::Heightmap | Format::Gazebo => &[],
        }
    }

    /// What it is called on the command line.
    pub(super) fn name(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }

    /// What it has of what a database has.
    pub(super) fn carries(self) -> &'static Carries {
        CARRIES.iter().find(|row| row.format == self.name()).expect("each format has a row")
    }

    /// Whether it has room for the ground alone, and decks are left out.
    pub(super) fn is_without_decks(self) -> bool {
        matches!(self, Format::Geotiff | Format::TerrainRgb | Format::Heightmap) || self.is_terrain_for_globes()
    }

    /// Whether its heights are above the ellipsoid of WGS 84.
    pub(super) fn is_for_globes(self) -> bool {
        matches!(self, Format::Tiles3d | Format::Archive) || self.is_terrain_for_globes()
    }

    fn is_terrain_for_globes(self) -> bool {
        matches!(self, Format::QuantizedMesh | Format::Mbtiles | Format::Tiles3dTerrain)
    }
}

/// Reads another name for a material.
pub fn material(text: &str) -> Result<(String, String), String> {
    let named = text.split_once('=').filter(|(word, name)| !word.is_empty() && !name.is_empty());
    let (word, name) = named.ok_or("expected MATERIAL=NAME, such as primary=asphalt")?;
    Ok((word.to_owned(), name.to_owned()))
}
