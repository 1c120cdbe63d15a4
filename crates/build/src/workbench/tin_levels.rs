//! Levels of detail without load modules: several meshes of one raster.

use std::sync::atomic::AtomicBool;

use crate::ground::GroundError;
use crate::{CompileError, Event, Progress, Stage};
use terrain::StopReason;

use crate::workbench::heights::Heights;
use crate::workbench::mesh::Mesh;
use crate::workbench::request::{TinMethod, TinRequest};

/// Makes a mesh for each of `levels`, numbers of vertices that rise.
///
/// Methods that choose post by post make one sequence, and each level is the beginning of it: a level holds all
/// vertices of those before. The optimised method moves its vertices, so that no sequence is left, and makes every
/// level anew.
///
/// # Errors
/// When the raster cannot be used, levels do not rise, or the request is cut into tiles.
pub fn tin_levels(
    request: &TinRequest,
    levels: &[usize],
    stop: &AtomicBool,
    progress: &mut dyn Progress,
) -> Result<Vec<Mesh>, CompileError> {
    refuse(request, levels)?;
    let whole = TinRequest { tiles: Some((1, 1)), points: levels.last().copied(), ..request.clone() };
    let fits = |rect| crate::workbench::request::refuse(&whole, (1, 1), rect);
    let heights = Heights::read((&request.dem, request.crs.as_deref()), &fits, request.workers, stop, progress)?;
    if let TinMethod::Optimised(_) = request.method {
        let level = |&points: &usize| {
            let request = TinRequest { points: Some(points), ..whole.clone() };
            let tile = heights.refine(&request, stop, progress)?.swap_remove(0);
            heights.mesh(tile.tin, tile.stop, request.workers, stop)
        };
        return levels.iter().map(level).collect();
    }
    let whole = heights.refine(&whole, stop, progress)?.swap_remove(0);
    progress.tell(Event::Enter(Stage::Assemble, 0));
    let began = whole.initial_count as usize;
    if let Some(&few) = levels.iter().find(|&&points| points < began) {
        return Err(impossible(
            few.to_string(),
            format!("at least the {began} points that it starts from"),
            "leave out what is below, or start from fewer points",
        ));
    }
    let level = |&points: &usize| {
        let is_whole = whole.tin.vertices.len() <= points;
        let ended = if is_whole { whole.stop } else { StopReason::BudgetSpent };
        heights.mesh(tin::prefix(&whole, points), ended, request.workers, stop)
    };
    let meshes = levels.iter().map(level).collect::<Result<Vec<_>, CompileError>>()?;
    progress.tell(Event::Leave(Stage::Assemble));
    Ok(meshes)
}

fn refuse(request: &TinRequest, levels: &[usize]) -> Result<(), CompileError> {
    let rising = levels.windows(2).all(|pair| pair[0] < pair[1]);
    if levels.is_empty() || !rising {
        let found = levels.iter().map(usize::to_string).collect::<Vec<_>>().join(",");
        let expected = "numbers of vertices, each above the one before";
        return Err(impossible(found, expected.into(), "for example --levels 1000,2500,5000"));
    }
    if let Some((rows, columns)) = request.tiles.filter(|&tiles| tiles != (1, 1)) {
        let found = format!("levels of {rows}x{columns} tiles");
        return Err(impossible(found, "one tile".into(), "tiles have sequences of their own: leave --tiles out"));
    }
    Ok(())
}

fn impossible(found: String, expected: String, hint: &str) -> CompileError {
    GroundError::Impossible { key: "--levels".into(), found, expected, hint: hint.into() }.into()
}
