//! Same input, same bytes: whatever the number of workers.

use crate::modes::{self, Mode};
use crate::scene::assert_same;

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
    for mode in modes::all() {
        let scene = modes::scene(&mode);
        drop(scene.build("area", 2));
        let before = scene.product("area");
        let again = scene.build("area", 1);
        assert_eq!((again.kept, again.rebuilt), (9, 0), "{}", mode.0);
        drop(again);
        assert_same(&before, &scene.product("area"), mode.0);
    }
}
