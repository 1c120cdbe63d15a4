//! What GDAL keeps in files beside a raster because the raster's own format has no place for it, or because it was not
//! to be written to: it is part of the raster for every program on GDAL.
//!
//! They are not read but for this: where they would change heights the raster is refused.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use crate::{SampleScale, SourceError, short};

/// Bytes that are looked at: statistics and tables of values come to some thousand.
const BYTES_MAX: u64 = 1 << 24;

/// Refuses a raster whose voids or scale stand in a file beside it and not, or otherwise, in its own. `nodata` and
/// `scale` are the raster's own, or the job's.
pub(crate) fn check(path: &Path, nodata: Option<f64>, scale: SampleScale) -> Result<(), SourceError> {
    let refused = |found: String| Err(SourceError::SideFile { path: path.into(), found });
    let mask = with_suffix(path, ".msk");
    if mask.is_file() {
        return refused(format!("its voids are given by a mask in {}", name(&mask)));
    }
    let said = with_suffix(path, ".aux.xml");
    let mut text = Vec::new();
    let Ok(file) = File::open(&said) else { return Ok(()) };
    if file.take(BYTES_MAX).read_to_end(&mut text).is_err() {
        return Ok(());
    }
    let text = String::from_utf8_lossy(&text);
    let band = text.split_once("<PAMRasterBand band=\"1\"").map_or("", |(_, rest)| rest);
    let band = band.split_once("</PAMRasterBand>").map_or(band, |(band, _)| band);
    let own = [("NoDataValue", nodata), ("Scale", Some(scale.scale)), ("Offset", Some(scale.offset))];
    for (element, own) in own {
        let Some(stated) = number(band, element) else { continue };
        // The same number is written with more digits or fewer.
        let is_same =
            |own: f64| own == stated || (own - stated).abs() <= 1.0e-9 * own.abs() || own as f32 == stated as f32;
        let is_known = own.is_some_and(is_same) || (stated.is_nan() && element == "NoDataValue");
        if !is_known {
            let own = own.map_or("nothing".to_owned(), short);
            return refused(format!("{} states {element} {}, the file itself {own}", name(&said), short(stated)));
        }
    }
    Ok(())
}

/// The number that an element holds.
fn number(text: &str, element: &str) -> Option<f64> {
    let (_, rest) = text.split_once(&format!("<{element}"))?;
    let (attributes, rest) = rest.split_once('>')?;
    let is_it = attributes.is_empty() || attributes.starts_with(' ');
    rest.split_once('<').filter(|_| is_it)?.0.trim().parse().ok()
}

fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(suffix);
    name.into()
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use std::fs;

    use crate::dem_file::{DemFile, Reading};

    #[test]
    fn a_mask_void_or_scale_beside_the_file_is_told_and_statistics_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.asc");
        fs::write(&path, "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -9\n1 2\n3 4\n")
            .unwrap();
        let reading = Reading { crs: Some(crate::Crs::plane()), ..Reading::AS_IT_SAYS };
        let said = |band: &str| {
            let text = format!("<PAMDataset><PAMRasterBand band=\"1\">{band}</PAMRasterBand></PAMDataset>");
            fs::write(folder.path().join("x.asc.aux.xml"), text).unwrap();
            DemFile::open(&path, &reading).map_err(|error| (error.to_string(), error.hint().unwrap_or_default()))
        };
        for same in [
            "<Metadata><MDI key=\"STATISTICS_MEAN\">2</MDI></Metadata>",
            "<NoDataValue>-9.00000000000000E+00</NoDataValue><Scale>1</Scale><Offset>0</Offset>",
        ] {
            assert!(said(same).is_ok(), "{same}");
        }
        for (other, found) in [
            ("<NoDataValue le_hex_equiv=\"0\">-32768</NoDataValue>", "states NoDataValue -32768, the file itself -9"),
            ("<Offset>0</Offset><Scale>5.0E-01</Scale>", "states Scale 0.5, the file itself 1"),
            ("<Offset>-100</Offset>", "states Offset -100, the file itself 0"),
        ] {
            let (error, hint) = said(other).unwrap_err();
            assert!(error.contains(found), "{error}");
            assert!(hint.starts_with("write it into the file: gdal_translate"), "{hint}");
        }
        fs::remove_file(folder.path().join("x.asc.aux.xml")).unwrap();
        fs::write(folder.path().join("x.asc.msk"), "II").unwrap();
        let error = DemFile::open(&path, &reading).unwrap_err();
        assert!(error.to_string().contains("a mask in x.asc.msk"), "{error}");
        assert!(error.hint().unwrap().contains("gdalwarp -dstnodata"), "{error}");
    }
}
