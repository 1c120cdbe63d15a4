//! What is chosen by a word in some formats of `tiefort export`.

use clap::ValueEnum;
use exports::{Engine, HeightEncoding, TextureFile};

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

/// Reads another name for a material.
pub fn material(text: &str) -> Result<(String, String), String> {
    let named = text.split_once('=').filter(|(word, name)| !word.is_empty() && !name.is_empty());
    let (word, name) = named.ok_or("expected MATERIAL=NAME, such as primary=asphalt")?;
    Ok((word.to_owned(), name.to_owned()))
}
