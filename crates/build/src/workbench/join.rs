//! The TINs of tiles as one.

use std::collections::HashMap;

use terrain::{PostRect, TileTin, Tin, Vertex};

/// Tiles put together: points on shared lines are equal, so they are one vertex.
pub(crate) fn join(rect: PostRect, tiles: &[TileTin]) -> Tin {
    if let [only] = tiles {
        return only.tin.clone();
    }
    let mut joined = Tin::new(rect, Vec::new(), Vec::new());
    let mut on_lines = HashMap::new();
    for tile in tiles {
        let part = &tile.tin;
        let (low, high) = (part.place_of(part.rect.south_west()), part.place_of(part.rect.north_east()));
        let mut place = |vertex: &Vertex| {
            let at = vertex.at;
            let mut fresh = || {
                joined.vertices.push(*vertex);
                joined.vertices.len() as u32 - 1
            };
            let is_on_line = at.row == low.row || at.row == high.row || at.col == low.col || at.col == high.col;
            if is_on_line { *on_lines.entry(at).or_insert_with(fresh) } else { fresh() }
        };
        let places: Vec<u32> = part.vertices.iter().map(&mut place).collect();
        joined.triangles.extend(part.triangles.iter().map(|corners| corners.map(|v| places[v as usize])));
    }
    joined
}
