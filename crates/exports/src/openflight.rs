//! OpenFlight: a file for each 4 km square, one that refers to all of them, and a MetaFlight index.
//!
//! All files count from one origin, the south-west corner of what is exported, and say in their headers where it lies;
//! so they fit together as they are. Triangles over holes are left out; decks and objects are groups of their own
//! in their square. Where load modules have coarser levels, a square has a level-of-detail node for each, which
//! programs show by their distance. Places across and along ways are lists of the first layer above the texture.

use std::collections::BTreeMap;
use std::ops::Range;

use terrain::{ModuleId, ModuleRect, metres_of_quanta};

use crate::detail::{Detail, steps};
use crate::earth::Earth;
use crate::flt_records::{Face, FltVertex, Place, Records};
use crate::gpkg_styles::escaped;
use crate::mesh::{Mesh, Part};
use crate::modules::{alone, sheet_name};
use crate::sheets::Material;
use crate::{Coordinates, Datum, ExportError, Facts, Product, Put, Sheet, Texture, Work};

/// Side of a square in metres.
pub(crate) const SQUARE_M: f64 = 4000.0;
/// The distance up to which the coarsest level is shown, in metres: farther than any horizon.
const FAR_M: f64 = 1e7;

/// Writes `squares/*.flt`, `area.flt` and `area.mft`.
///
/// # Errors
/// When a file cannot be written, the area's system cannot be computed, or the work was asked to stop.
pub fn write_openflight(product: &Product, put: &Put, work: &Work) -> Result<(), ExportError> {
    let details = Detail::all(product, Mesh::of(product));
    let squares = product.squares(square_side(product));
    // Longitudes and latitudes only.
    let earth = Earth::new(product, Some(Datum::Ellipsoid))?;
    let about = Facts::z_up(product, Coordinates::Local).comments(product).join("\n");
    work.each("squares", &squares, |&rect| {
        let mut records = Records::default();
        records.header(&place(product, &earth, rect)?);
        records.comment(&about);
        let texture = product.texture(rect, 0.0)?;
        let texture_name = square_name(product, rect, product.texture_extension());
        if texture.is_some() {
            // Beside this file.
            records.texture(&texture_name);
        }
        put_square(&mut records, &details, rect, texture.as_ref());
        put(&format!("squares/{}", square_name(product, rect, "flt")), &records.into_bytes())?;
        let Some(texture) = texture else { return Ok(()) };
        put(&format!("squares/{texture_name}"), &texture.bytes)
    })?;
    let mut records = Records::default();
    records.header(&place(product, &earth, product.rect)?);
    records.comment(&about);
    records.push();
    records.group("area");
    records.push();
    for &rect in &squares {
        records.external(&format!("squares/{}", square_name(product, rect, "flt")));
    }
    records.pop();
    records.pop();
    put("area.flt", &records.into_bytes())?;
    let index = metaflight(product, &grid(product), &place(product, &earth, product.rect)?);
    put("area.mft", index.as_bytes())
}

/// Palettes and nodes of a square: a node for each level where there are several, in it one for each sheet.
fn put_square(records: &mut Records, details: &[Detail], rect: ModuleRect, texture: Option<&Texture>) {
    let mut materials: Vec<Material> = details.iter().flat_map(|detail| detail.mesh.groups()).collect();
    materials.sort_unstable();
    materials.dedup();
    let names = materials.iter().map(|material| material.word(details[0].product.classes()));
    for (index, name) in short_names(names).iter().enumerate() {
        records.material(index as i32, name);
    }
    let levels: Vec<Vec<(Sheet, Part)>> = details.iter().map(|detail| sheets(detail, rect)).collect();
    let of_level = |(detail, parts): (&Detail, &Vec<(Sheet, Part)>)| -> Vec<FltVertex> {
        let all: Vec<u32> = parts.iter().flat_map(|(_, part)| &part.vertices).copied().collect();
        let uvs = texture.map(|texture| detail.mesh.uvs(texture, &all));
        let vertex = |(at, &v): (usize, &u32)| FltVertex {
            place: detail.mesh.vertices[v as usize].map(metres_of_quanta),
            normal: detail.normals[v as usize],
            uv: uvs.as_ref().map(|uvs| [uvs[at][0], 1.0 - uvs[at][1]]),
        };
        all.iter().enumerate().map(vertex).collect()
    };
    let vertices: Vec<FltVertex> = details.iter().zip(&levels).flat_map(of_level).collect();
    records.vertices(&vertices);
    let steps = steps(details.iter().map(|detail| &detail.product), rect);
    let middle = middle(&vertices);
    records.push();
    let mut first = 0;
    for (index, (detail, parts)) in details.iter().zip(&levels).enumerate() {
        if 1 < details.len() {
            let far_m = steps.get(index + 1).map_or(FAR_M, |next| next.near_m);
            records.level(&format!("lod{}", steps[index].level), [steps[index].near_m, far_m], middle);
            records.push();
        }
        for (sheet, part) in parts {
            records.group(if *sheet == Sheet::Ground { "square" } else { sheet.name() });
            let has_texture = texture.is_some() && *sheet != Sheet::Objects;
            put_objects(records, (detail, &materials, has_texture), (*sheet, part), first);
            first += part.vertices.len() as u32;
        }
        if 1 < details.len() {
            records.pop();
        }
    }
    records.pop();
}

/// Letters of a name in the palette of materials.
const NAME_LETTERS: usize = 11;

/// Names as a palette has room for them: where unlike names begin with the same letters, all but the first of them end
/// in a number.
fn short_names(names: impl Iterator<Item = String>) -> Vec<String> {
    let mut known: BTreeMap<String, String> = BTreeMap::new();
    let short = |name: String| {
        let cut = |letters: usize| name.chars().take(letters).collect::<String>();
        if let Some(known) = known.get(&name) {
            return known.clone();
        }
        let numbered = (2..).map(|number| format!("~{number}")).map(|end| cut(NAME_LETTERS - end.len()) + &end);
        let is_free = |short: &String| known.values().all(|taken| taken != short);
        let found = std::iter::once(cut(NAME_LETTERS)).chain(numbered).find(is_free).unwrap_or_default();
        known.insert(name, found.clone());
        found
    };
    names.map(short).collect()
}

/// What a level has in a square: the group of the ground is there in any case, with an object for each load module.
fn sheets(detail: &Detail, rect: ModuleRect) -> Vec<(Sheet, Part)> {
    let mut parts = detail.mesh.parts(&detail.product, rect);
    if parts.first().is_none_or(|(sheet, _)| *sheet != Sheet::Ground) {
        parts.insert(0, (Sheet::Ground, detail.mesh.part(&detail.product, Sheet::Ground, rect)));
    }
    parts
}

/// The middle of the box around vertices.
fn middle(vertices: &[FltVertex]) -> [f64; 3] {
    let ends = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let (low, high) = vertices.iter().fold(ends, |(low, high), FltVertex { place, .. }| {
        ([0, 1, 2].map(|axis| low[axis].min(place[axis])), [0, 1, 2].map(|axis| high[axis].max(place[axis])))
    });
    if vertices.is_empty() { [0.0; 3] } else { [0, 1, 2].map(|axis| f64::midpoint(low[axis], high[axis])) }
}

/// The faces of each load module of a sheet, or of each object, as an object; its vertices begin at `first`.
fn put_objects(
    records: &mut Records,
    (detail, materials, has_texture): (&Detail, &[Material], bool),
    (sheet, part): (Sheet, &Part),
    first: u32,
) {
    let of_module = |(id, range): &(ModuleId, Range<usize>)| (sheet_name(sheet, alone(*id)), range.clone());
    let objects: Vec<(String, Range<usize>)> = match sheet {
        Sheet::Objects => part.things.iter().map(|(thing, range)| (thing.name(), range.clone())).collect(),
        Sheet::Ground => part.modules.iter().map(of_module).collect(),
        Sheet::Decks | Sheet::Ribbons => {
            part.modules.iter().filter(|(_, range)| !range.is_empty()).map(of_module).collect()
        }
    };
    records.push();
    for (name, range) in objects {
        records.object(&name);
        records.push();
        for (triangle, &class) in part.triangles[range.clone()].iter().zip(&part.classes[range]) {
            let material = Material { sheet, class };
            // A texture is seen in its own colours.
            let color = if has_texture { [255; 3] } else { material.color(detail.product.classes()) };
            let codes = material.codes(detail.product.classes());
            let material = materials.iter().position(|of| *of == material).map_or(-1, |place| place as i16);
            let (is_seen_from_below, is_terrain) = (sheet.is_seen_from_below(), sheet != Sheet::Objects);
            let face = Face { codes, material, color, is_seen_from_below, is_terrain, has_texture };
            records.face(triangle.map(|v| first + v), face, part.lane(*triangle));
        }
        records.pop();
    }
    records.pop();
}

/// Load modules along the side of a square.
pub(crate) fn square_side(product: &Product) -> u32 {
    (SQUARE_M / product.side_m()).round().max(1.0) as u32
}

/// The name of a square's file by its row and column in the area: `r03c12.flt`.
pub(crate) fn square_name(product: &Product, rect: ModuleRect, extension: &str) -> String {
    let side = square_side(product);
    let ModuleId { row, col } = ModuleId { row: rect.south / side, col: rect.west / side };
    format!("r{row:02}c{col:02}.{extension}")
}

/// How squares divide what is exported.
fn grid(product: &Product) -> Grid {
    let (side, rect) = (square_side(product), product.rect);
    let first = [rect.south / side, rect.west / side];
    let count = [rect.north.div_ceil(side) - first[0], rect.east.div_ceil(side) - first[1]];
    Grid { first, count, side_m: f64::from(side) * product.side_m() }
}

fn place(product: &Product, earth: &Earth, rect: ModuleRect) -> Result<Place, ExportError> {
    let [west, south] = product.corner_m(rect.south, rect.west);
    let [east, north] = product.corner_m(rect.north, rect.east);
    Ok(Place {
        offset_m: product.corner_m(product.rect.south, product.rect.west),
        corners: [earth.lon_lat([west, south])?, earth.lon_lat([east, north])?],
        utm_zone: utm_zone(product.epsg()),
        radius_m: (east - west).hypot(north - south) / 2.0,
    })
}

/// The zone of UTM that an EPSG code stands for, negative in the south.
fn utm_zone(epsg: Option<u32>) -> Option<i16> {
    match epsg? {
        // On WGS 84, NAD83 and ETRS89.
        code @ (32_601..=32_660 | 26_901..=26_923 | 25_828..=25_838) => Some((code % 100) as i16),
        code @ 32_701..=32_760 => Some(-((code % 100) as i16)),
        _ => None,
    }
}

/// How squares divide what is exported.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Grid {
    /// Row and column of the south-west square in the area.
    pub first: [u32; 2],
    /// Rows and columns of squares.
    pub count: [u32; 2],
    /// Side of a square in metres.
    pub side_m: f64,
}

/// The text of the index.
fn metaflight(product: &Product, grid: &Grid, place: &Place) -> String {
    let side = grid.side_m;
    let extent = [f64::from(grid.count[1]) * side, f64::from(grid.count[0]) * side];
    let area = product.corner_m(0, 0);
    // The grid begins at a line of squares, the coordinates at what is exported.
    let start = [0, 1].map(|axis| area[axis] + f64::from(grid.first[1 - axis]) * side - place.offset_m[axis]);
    let [[west, south], [east, north]] = place.corners;
    let system = match place.utm_zone {
        Some(zone) => format!(
            "<UTM><Zone>{}</Zone><Hemisphere>{}</Hemisphere></UTM>",
            zone.abs(),
            if zone < 0 { "South" } else { "North" }
        ),
        None => format!(
            "<FlatEarth><OriginLatitude>{}</OriginLatitude><OriginLongitude>{}</OriginLongitude></FlatEarth>",
            f64::midpoint(south, north),
            f64::midpoint(west, east)
        ),
    };
    let name = escaped(&product.manifest.area.name);
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <MetaFlightRoot version=\"2.0\">\n\
         \x20 <Database name=\"{name}\">\n\
         \x20   <ProjectedCoordSys>\n\
         \x20     <Name>{crs}</Name>\n\
         \x20     {system}\n\
         \x20     <Offset><x>{ox}</x><y>{oy}</y><z>0</z></Offset>\n\
         \x20   </ProjectedCoordSys>\n\
         \x20   <Coverage>\n\
         \x20     <Origin><x>{sx}</x><y>{sy}</y></Origin>\n\
         \x20     <Extent><x>{ex}</x><y>{ey}</y></Extent>\n\
         \x20   </Coverage>\n\
         \x20   <GridStructure name=\"squares\">\n\
         \x20     <GridLevel>\n\
         \x20       <NumRowDivisions>{rows}</NumRowDivisions>\n\
         \x20       <NumColDivisions>{cols}</NumColDivisions>\n\
         \x20     </GridLevel>\n\
         \x20   </GridStructure>\n\
         \x20   <GeometryDataset name=\"terrain\" gridStructure=\"squares\" fileFormat=\"OpenFlight\">\n\
         {files}\
         \x20   </GeometryDataset>\n\
         \x20 </Database>\n\
         </MetaFlightRoot>\n",
        crs = escaped(product.crs()),
        ox = place.offset_m[0],
        oy = place.offset_m[1],
        sx = start[0],
        sy = start[1],
        ex = extent[0],
        ey = extent[1],
        rows = grid.count[0],
        cols = grid.count[1],
        files = files(grid),
    )
}

fn files(grid: &Grid) -> String {
    let cells = (0..grid.count[0]).flat_map(|row| (0..grid.count[1]).map(move |col| (row, col)));
    let line = |(row, col): (u32, u32)| {
        let (r, c) = (grid.first[0] + row, grid.first[1] + col);
        format!("      <Tile row=\"{row}\" col=\"{col}\" file=\"squares/r{r:02}c{c:02}.flt\"/>\n")
    };
    cells.map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    #[test]
    fn unlike_names_stay_unlike_where_they_are_cut() {
        let long = "concrete_reinforced";
        let names = [long.to_owned(), format!("{long}_roof"), "minor".into(), format!("{long}_wall"), long.into()];
        assert_eq!(
            short_names(names.into_iter()),
            ["concrete_re", "concrete_~2", "minor", "concrete_~3", "concrete_re"]
        );
    }

    #[test]
    fn an_area_is_a_file_per_square_one_that_refers_to_them_and_an_index() {
        let files = samples::files(|put, work| write_openflight(&samples::product(), put, work));
        assert_eq!(files.keys().collect::<Vec<_>>(), ["area.flt", "area.mft", "squares/r00c00.flt"]);
        let count = |code: u16, bytes: &[u8]| {
            let (mut at, mut count) = (0, 0);
            while at < bytes.len() {
                let word = |at: usize| u16::from_be_bytes([bytes[at], bytes[at + 1]]);
                count += usize::from(word(at) == code);
                at += usize::from(word(at + 2));
            }
            count
        };
        let square = &files["squares/r00c00.flt"];
        assert_eq!([count(69, square), count(5, square), count(4, square)], [7, 6, 2]);
        assert_eq!(count(10, square), count(11, square));
        assert_eq!(count(63, &files["area.flt"]), 1);
        assert!(String::from_utf8_lossy(&files["area.mft"]).contains("<NumRowDivisions>1</NumRowDivisions>"));
    }

    #[test]
    fn decks_are_a_group_of_their_own_behind_the_ground() {
        let write = |product: &Product| {
            let mut files = samples::files(|put, work| write_openflight(product, put, work));
            files.remove("squares/r00c00.flt").unwrap()
        };
        let bytes = write(&samples::with_bridge());
        let (mut at, mut found) = (0, BTreeMap::new());
        while at < bytes.len() {
            let word = |at: usize| u16::from_be_bytes([bytes[at], bytes[at + 1]]);
            *found.entry(word(at)).or_insert(0) += 1;
            at += usize::from(word(at + 2));
        }
        // Vertices, faces, objects and groups.
        assert_eq!([69, 5, 4, 2].map(|code| found[&code]), [17, 12, 4, 2]);
        assert_eq!(found[&10], found[&11]);
    }

    #[test]
    fn zones_of_utm_are_known_by_their_codes() {
        assert_eq!(utm_zone(Some(32611)), Some(11));
        assert_eq!(utm_zone(Some(32733)), Some(-33));
        assert_eq!(utm_zone(Some(25832)), Some(32));
        assert_eq!([utm_zone(Some(3035)), utm_zone(None)], [None, None]);
    }
}
