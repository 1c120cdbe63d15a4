//! Same input, same bytes: whatever the number of workers.

use std::collections::BTreeSet;

use build::{Event, Progress, Stage};
use terrain::TileId;

use crate::modes::{self, Mode};
use crate::scene::{Scene, Words, assert_same};

#[track_caller]
fn check(modes: Vec<Mode>) {
    for mode in modes {
        let scene = modes::scene(&mode);
        drop(scene.build("one", 1));
        let one = scene.product("one");
        for workers in [2, 8] {
            let name = format!("many-{workers}");
            drop(scene.build(&name, workers));
            assert_same(&one, &scene.product(&name), &format!("{}: {workers} workers", mode.0));
        }
    }
}

#[test]
fn build_is_byte_identical_for_one_worker_and_many() {
    check(modes::constrained());
}

#[test]
fn clipped_build_is_byte_identical_for_one_worker_and_many() {
    check(modes::clipped());
}

#[test]
fn building_again_keeps_every_tile_and_changes_no_byte() {
    for mode in modes::all().into_iter().step_by(3) {
        let scene = modes::scene(&mode);
        drop(scene.build("area", 2));
        let before = scene.product("area");
        scene.forget_report("area");
        let again = scene.build("area", 1);
        assert_eq!((again.is_unchanged, again.kept, again.rebuilt), (false, 9, 0), "{}", mode.0);
        drop(again);
        assert_same(&before, &scene.product("area"), mode.0);
    }
}

/// Holds every tile that begins to be refined against those that are at work.
#[derive(Default)]
struct Neighbours {
    at_work: BTreeSet<TileId>,
    done: Vec<TileId>,
    most: usize,
}

impl Progress for Neighbours {
    fn tell(&mut self, event: Event) {
        match event {
            Event::Started(Stage::Refine, tile) => {
                let touches = |other: &&TileId| other.row.abs_diff(tile.row) <= 1 && other.col.abs_diff(tile.col) <= 1;
                assert_eq!(self.at_work.iter().find(touches), None, "{tile} began beside a tile at work");
                self.at_work.insert(tile);
                self.most = self.most.max(self.at_work.len());
            }
            Event::Done(Stage::Refine, tile) => {
                assert!(self.at_work.remove(&tile), "{tile} ended without having begun");
                self.done.push(tile);
            }
            _ => (),
        }
    }
}

#[test]
fn tiles_that_touch_are_never_refined_at_once() {
    for order in ["colour", "raster"] {
        let words = Words { size: (10, 12), tiles: (5, 6), order: format!("order = \"{order}\""), ..Words::sample() };
        let scene = Scene::new(&words);
        let mut seen = Neighbours::default();
        drop(scene.build_watched("area", 8, &false.into(), &mut seen).unwrap());
        assert_eq!(seen.done.len(), 30, "{order}");
        assert!(2 <= seen.most, "{order}: nothing ran at once");
    }
}
