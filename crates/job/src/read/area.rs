//! `[area]` and `[load_modules]`: the working grid and the load modules on it.
//!
//! Read together, because each must fit the other: the spacing divides the border step, the border step the side of a
//! load module, and that side the area.

use terrain::{Metres, ModuleGrid, QUANTA_PER_METRE, Spacing};

use crate::bounds::{
    AROUND_KM_MAX, CELLS_A_SIDE_MAX, COORDINATE_M_MAX, EPSG_GEOGRAPHIC, EPSG_RANGE, MODULES_MAX, SIDE_QUANTA_MAX,
};
use crate::entry::{Entry, Section};
use crate::{Area, AreaFound, AreaPlace, AreaRequest, Edges, JobError, Method, ModulesSpec, OuterBorder};

/// Finds what a job leaves open about its area.
pub(super) type Find<'a> = dyn FnMut(&AreaRequest, &Entry) -> Result<AreaFound, JobError> + 'a;

pub(super) fn read(area: &Section, modules: &Section, find: &mut Find) -> Result<(Area, ModulesSpec), JobError> {
    let name = area.required("name")?.name("the database is named after it: NAME.tdb")?;
    let title = area.maybe("title", |entry| entry.prose(char::is_control))?;
    let epsg = epsg(area)?;
    let place = open_place(area, epsg)?;
    let origin_m = if place.is_none() { origin(area)? } else { [0.0; 2] };
    let (spacing_entry, spacing) = spacing(area)?;
    let border_step_m = length(modules, "border_step_m")?;
    let side_m = length(modules, "side_m")?;
    if let Some(step) = modules.optional("border_step_m")
        && spacing.posts_in(Metres(side_m)).is_some()
        && spacing.posts_in(Metres(border_step_m)).is_none()
    {
        // The spacing fits the load module, so it is the step that does not.
        let expected = format!("a multiple of area.spacing_m, {} m", spacing.metres());
        return Err(step.out_of_range_with(expected, "the usual one is border_step_m = 125"));
    }
    let border_step_cells = border_step_cells(&spacing_entry, spacing, border_step_m, side_m)?;
    let side_cells = side_cells(modules, spacing, side_m, border_step_m)?;
    let (epsg, origin_m, grid) = match (place, epsg) {
        (Some((entry, place)), epsg) => {
            let request = AreaRequest { epsg, place, spacing, side_m };
            let AreaFound { epsg, origin_m, size_m } = find(&request, &entry)?;
            (epsg, origin_m, grid_of(&entry, size_m, spacing, side_cells, side_m)?)
        }
        (None, Some(epsg)) => (epsg, origin_m, grid(area, spacing, side_cells, side_m)?),
        (None, None) => {
            let hint = "\"auto\" goes with around = { lat = 35.3, lon = -116.6, size_km = 50 } or cover = \"dem\"";
            let entry = area.required("crs")?;
            return Err(entry.conflict("origin_m", "a system for these metres, as \"EPSG:32611\"", hint));
        }
    };
    // A multiple of the spacing, itself one of 1/16 m, so this is whole; and side_cells has checked that it fits.
    let side_quanta = (side_m * f64::from(QUANTA_PER_METRE)) as u16;
    let (edges, format) = (edges(modules)?, modules.whole_u32("format")?);
    // What the method asks for is not known yet: `outer_border` decides.
    let outer_border = OuterBorder::Fixed;
    let modules = ModulesSpec { side_m, side_quanta, border_step_m, border_step_cells, outer_border, edges, format };
    Ok((Area { name, title, epsg, origin_m, spacing, grid }, modules))
}

/// An area that is to be found, with the key that says so.
fn open_place<'a>(area: &Section<'a>, epsg: Option<u32>) -> Result<Option<(Entry<'a>, AreaPlace)>, JobError> {
    let (around, cover) = (area.optional("around"), area.optional("cover"));
    let stated = ["origin_m", "size_m"].into_iter().find(|key| area.optional(key).is_some());
    let either = |entry: &Entry, beside: &str| {
        entry.conflict(beside, "either cover, around, or origin_m and size_m", "remove one of the two")
    };
    match (around, cover, stated) {
        (None, None, _) => Ok(None),
        (Some(entry), Some(_), _) => Err(either(&entry, "cover")),
        (Some(entry), None, Some(key)) | (None, Some(entry), Some(key)) => Err(either(&entry, key)),
        (None, Some(entry), None) => {
            let place = entry.word()?;
            Ok(Some((entry, place)))
        }
        (Some(entry), None, None) => {
            let table = entry.table()?;
            let (latitude, longitude) = (table.required("lat")?.number()?, table.required("lon")?.number()?);
            if 90.0 < latitude.abs() || 360.0 < longitude.abs() || (epsg.is_none() && 84.0 < latitude.abs()) {
                return Err(entry.out_of_range("a latitude within 90 (UTM: 84) and a longitude within 360 degrees"));
            }
            let size = table.required("size_km")?;
            let size_km = if size.is_list() { size.pair()? } else { [size.number()?; 2] };
            if size_km.iter().any(|&km| !(0.0 < km && km <= AROUND_KM_MAX)) {
                return Err(size.out_of_range(size.expected()));
            }
            let size_m = size_km.map(|km| km * 1000.0);
            Ok(Some((entry, AreaPlace::Around { latitude, longitude, size_m })))
        }
    }
}

/// The code; `None` for one that is to be found.
fn epsg(area: &Section) -> Result<Option<u32>, JobError> {
    let hint = "UTM zone 11 north on WGS 84 is EPSG:32611, zone 32 north EPSG:32632";
    let entry = area.required("crs")?;
    let text = entry.text()?;
    if text == "auto" {
        return Ok(None);
    }
    let digits = text.strip_prefix("EPSG:").filter(|code| code.bytes().all(|b| b.is_ascii_digit()));
    let code = digits.and_then(|digits| digits.parse().ok()).filter(|code| EPSG_RANGE.contains(code));
    let code = code.ok_or_else(|| entry.out_of_range_with(entry.expected(), hint))?;
    if EPSG_GEOGRAPHIC.contains(&code) {
        let mut fault = entry.fault(entry.expected());
        fault.hint = hint.to_owned();
        fault.found += ", which is in degrees";
        return Err(JobError::OutOfRange(fault));
    }
    Ok(Some(code))
}

fn origin(area: &Section) -> Result<[f64; 2], JobError> {
    let entry = area.required("origin_m")?;
    let origin = entry.pair()?;
    if origin.iter().any(|metres| COORDINATE_M_MAX < metres.abs()) {
        return Err(entry.out_of_range(format!("{}, each within {COORDINATE_M_MAX:e} m of 0", entry.expected())));
    }
    Ok(origin)
}

fn spacing<'a>(area: &Section<'a>) -> Result<(Entry<'a>, Spacing), JobError> {
    let hint = "25 divides the usual border step of 125 m; a DEM of any other spacing is resampled to it";
    let entry = area.required("spacing_m")?;
    let spacing = Spacing::from_metres(entry.number()?);
    let spacing = spacing.ok_or_else(|| entry.out_of_range_with(entry.expected(), hint))?;
    Ok((entry, spacing))
}

/// A length: positive, and no longer than the largest side of a load module.
fn length(modules: &Section, key: &str) -> Result<f64, JobError> {
    let metres = modules.number(key)?;
    let longest = f64::from(SIDE_QUANTA_MAX) / f64::from(QUANTA_PER_METRE);
    match modules.optional(key) {
        Some(entry) if metres <= 0.0 => Err(entry.out_of_range(entry.expected())),
        Some(entry) if longest < metres => {
            let hint = "a load module has 16-bit coordinates of 1/128 m: 500 m is 64,000 of them";
            Err(entry.out_of_range_with(entry.expected(), hint))
        }
        _ => Ok(metres),
    }
}

fn border_step_cells(entry: &Entry, spacing: Spacing, border_step_m: f64, side_m: f64) -> Result<i32, JobError> {
    spacing.posts_in(Metres(border_step_m)).ok_or_else(|| {
        let expected = format!("a spacing that divides load_modules.border_step_m, {border_step_m} m");
        let hint = nearest_spacing(border_step_m, side_m, spacing.metres()).map(|(near, parts)| {
            let is = if parts == 1 { "the step itself".into() } else { format!("{border_step_m} m / {parts}") };
            format!("{near} m is {is}; the DEM is resampled to it")
        });
        match hint {
            Some(hint) => entry.out_of_range_with(expected, hint),
            None => entry.out_of_range(expected),
        }
    })
}

/// The spacing nearest to `wanted` that divides the border step, is a multiple of 1/16 m and leaves a load module at
/// least two cells along a side; and into how many parts.
fn nearest_spacing(border_step_m: f64, side_m: f64, wanted: f64) -> Option<(f64, u32)> {
    const PARTS_MAX: u32 = 8000; // 500 m in sixteenths: no more parts are possible
    let fits = |parts: u32| {
        let metres = border_step_m / f64::from(parts);
        Spacing::from_metres(metres)
            .filter(|s| s.metres() * f64::from(parts) == border_step_m && 2.0 * metres <= side_m)
            .map(|_| (metres, parts))
    };
    let farther = |(metres, _): &(f64, u32)| (metres - wanted).abs();
    (1..=PARTS_MAX).filter_map(fits).min_by(|a, b| farther(a).total_cmp(&farther(b)))
}

fn side_cells(modules: &Section, spacing: Spacing, side_m: f64, border_step_m: f64) -> Result<i32, JobError> {
    let steps = side_m / border_step_m;
    if let (0.0, Some(cells)) = (steps.fract(), spacing.posts_in(Metres(side_m))) {
        return Ok(cells);
    }
    let expected =
        format!("a side of a load module that is a multiple of its border step ({side_m} m of {border_step_m} m)");
    let hint = "the usual ones are side_m = 500 and border_step_m = 125";
    // Whichever of the two the job says is where the reader should look; the defaults fit each other.
    match modules.optional("side_m").or_else(|| modules.optional("border_step_m")) {
        Some(entry) => Err(entry.out_of_range_with(expected, hint)),
        None => unreachable!("500 m is a multiple of 125 m and of every spacing that divides 125 m"),
    }
}

fn grid(area: &Section, spacing: Spacing, side_cells: i32, side_m: f64) -> Result<ModuleGrid, JobError> {
    let entry = area.required("size_m")?;
    let size_m = entry.pair()?;
    grid_of(&entry, size_m, spacing, side_cells, side_m)
}

/// The load modules of an area of this size; `entry` is the key to speak of.
fn grid_of(
    entry: &Entry,
    size_m: [f64; 2],
    spacing: Spacing,
    side_cells: i32,
    side_m: f64,
) -> Result<ModuleGrid, JobError> {
    if size_m.iter().any(|&metres| metres <= 0.0) {
        return Err(entry.out_of_range("a positive width and height in metres"));
    }
    let widest = f64::from(CELLS_A_SIDE_MAX) * spacing.metres();
    if size_m.iter().any(|&metres| widest < metres) {
        let most = format!("at most {CELLS_A_SIDE_MAX} cells a side, which is {widest} m at this spacing");
        return Err(entry.out_of_range(most));
    }
    let [cols, rows] = size_m.map(|metres| metres / side_m);
    if cols.fract() != 0.0 || rows.fract() != 0.0 {
        let whole = size_m.map(|metres| (metres / side_m).floor() * side_m);
        let expected = format!("whole numbers of load modules of {side_m} m");
        return Err(if whole.contains(&0.0) {
            entry.out_of_range(expected)
        } else {
            entry.out_of_range_with(expected, format!("[{}, {}] fits inside", whole[0], whole[1]))
        });
    }
    if (MODULES_MAX as f64) < cols * rows {
        return Err(entry.out_of_range(format!("at most {MODULES_MAX} load modules")));
    }
    // Both are whole and below 2^24 here.
    Ok(ModuleGrid { rows: rows as u32, cols: cols as u32, side_cells })
}

/// The outer border: refined, unless the method is the paper's or edges are clipped, which need a fixed one.
pub(super) fn outer_border(modules: &Section, edges: Edges, method: Method) -> Result<OuterBorder, JobError> {
    let needs_fixed = match (edges, method) {
        (Edges::Clip(_), _) => Some("edges = \"clip\""),
        (Edges::Constrained, Method::Paper { .. }) => Some("method = \"paper\""),
        (Edges::Constrained, Method::Greedy | Method::Optimised(_)) => None,
    };
    let Some(entry) = modules.optional("outer_border") else {
        return Ok(if needs_fixed.is_some() { OuterBorder::Fixed } else { OuterBorder::Refined });
    };
    match (entry.word()?, needs_fixed) {
        (OuterBorder::Refined, Some(why)) => Err(entry.conflict(
            why,
            "outer_border = \"fixed\", a point every border step",
            "remove it, or use constrained edges and method = \"optimised\" or \"greedy\"",
        )),
        (border, _) => Ok(border),
    }
}

fn edges(modules: &Section) -> Result<Edges, JobError> {
    match (modules.word("edges")?, modules.optional("clip_heights")) {
        (Edges::Clip(_), _) => Ok(Edges::Clip(modules.word("clip_heights")?)),
        (Edges::Constrained, None) => Ok(Edges::Constrained),
        (Edges::Constrained, Some(entry)) => Err(entry.conflict(
            "edges = \"constrained\"",
            "no clip_heights, since nothing is clipped",
            "remove it, or write edges = \"clip\"",
        )),
    }
}
