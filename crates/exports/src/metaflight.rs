//! A MetaFlight index: XML that tells a runtime where the OpenFlight file of each square lies.

use crate::Product;
use crate::flt_records::Place;
use crate::gpkg_styles::escaped;

/// How squares divide what is exported.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Grid {
    /// Row and column of the south-west square in the area.
    pub first: [u32; 2],
    /// Rows and columns of squares.
    pub count: [u32; 2],
    /// Side of a square in metres.
    pub side_m: f64,
}

/// The text of the index.
pub(crate) fn metaflight(product: &Product, grid: &Grid, place: &Place) -> String {
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
