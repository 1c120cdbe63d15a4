//! Spatial indexes of a GeoPackage's layers: an R-tree for each, listed as the extension it is, with the triggers that
//! keep it true when another program edits the layer.

use rusqlite::{Connection, params};

/// What the extension is called, and where it is defined.
const EXTENSION: &str = "gpkg_rtree_index";
const DEFINITION: &str = "http://www.geopackage.org/spec120/#extension_rtree";

/// Builds the index of a layer whose features are all there. Their extents stand at the head of each geometry.
///
/// # Errors
/// When the library cannot write.
pub fn add_index(connection: &Connection, layer: &str) -> rusqlite::Result<()> {
    connection.execute_batch(&format!(
        "CREATE TABLE IF NOT EXISTS gpkg_extensions (
             table_name TEXT, column_name TEXT, extension_name TEXT NOT NULL, definition TEXT NOT NULL,
             scope TEXT NOT NULL, CONSTRAINT ge_tce UNIQUE (table_name, column_name, extension_name));
         CREATE VIRTUAL TABLE rtree_{layer}_geom USING rtree(id, minx, maxx, miny, maxy);"
    ))?;
    connection.execute(
        "INSERT INTO gpkg_extensions VALUES (?1, 'geom', ?2, ?3, 'write-only')",
        params![layer, EXTENSION, DEFINITION],
    )?;
    fill(connection, layer)?;
    connection.execute_batch(&triggers(layer))
}

fn fill(connection: &Connection, layer: &str) -> rusqlite::Result<()> {
    let mut features = connection.prepare(&format!("SELECT fid, geom FROM {layer} WHERE geom NOTNULL"))?;
    let mut add = connection.prepare(&format!("INSERT INTO rtree_{layer}_geom VALUES (?1, ?2, ?3, ?4, ?5)"))?;
    let mut rows = features.query([])?;
    while let Some(row) = rows.next()? {
        let fid: i64 = row.get(0)?;
        let [west, east, south, north] = extent(row.get_ref(1)?.as_blob()?);
        add.execute(params![fid, west, east, south, north])?;
    }
    Ok(())
}

/// Smallest and largest x, then y, of a geometry that we wrote.
fn extent(geometry: &[u8]) -> [f64; 4] {
    std::array::from_fn(|index| {
        let mut number = [0; 8];
        number.copy_from_slice(&geometry[8 + 8 * index..16 + 8 * index]);
        f64::from_le_bytes(number)
    })
}

/// What happens to the index when a feature comes, goes, or changes its shape or its number.
fn triggers(layer: &str) -> String {
    let tree = format!("rtree_{layer}_geom");
    let there = |which: &str| format!("({which}.geom NOTNULL AND NOT ST_IsEmpty({which}.geom))");
    let gone = |which: &str| format!("({which}.geom ISNULL OR ST_IsEmpty({which}.geom))");
    let put = format!(
        "INSERT OR REPLACE INTO {tree} VALUES \
         (NEW.fid, ST_MinX(NEW.geom), ST_MaxX(NEW.geom), ST_MinY(NEW.geom), ST_MaxY(NEW.geom));"
    );
    let take = format!("DELETE FROM {tree} WHERE id = OLD.fid;");
    let (new, none, old) = (there("NEW"), gone("NEW"), "OLD.geom NOTNULL");
    let same = "OLD.fid = NEW.fid";
    let other = "OLD.fid <> NEW.fid";
    let trigger = |name: &str, event: &str, when: &str, what: &str| {
        format!("CREATE TRIGGER {tree}_{name} AFTER {event} ON {layer} WHEN {when} BEGIN {what} END;\n")
    };
    let was = there("OLD");
    let both = format!("{take} DELETE FROM {tree} WHERE id = NEW.fid;");
    let moved = format!("{take} {put}");
    let reshaped = format!(
        "UPDATE {tree} SET minx = ST_MinX(NEW.geom), maxx = ST_MaxX(NEW.geom), \
                            miny = ST_MinY(NEW.geom), maxy = ST_MaxY(NEW.geom) WHERE id = NEW.fid;"
    );
    [
        trigger("insert", "INSERT", &new, &put),
        trigger("update6", "UPDATE OF geom", &format!("{same} AND {new} AND {was}"), &reshaped),
        trigger("update7", "UPDATE OF geom", &format!("{same} AND {new} AND {}", gone("OLD")), &put),
        trigger("update2", "UPDATE OF geom", &format!("{same} AND {none}"), &take),
        trigger("update5", "UPDATE", &format!("{other} AND {new}"), &moved),
        trigger("update4", "UPDATE", &format!("{other} AND {none}"), &both),
        trigger("delete", "DELETE", old, &take),
    ]
    .concat()
}
