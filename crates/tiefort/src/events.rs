//! `--json`: what happens, one JSON object a line on stdout.

use std::io::{Write, stdout};

use build::{Event, Stage};
use serde_json::{Value, json};
use store::ReportStage;
use terrain::TileId;

/// One event as JSON; `stage_time` goes with the end of a stage, `at_s` are seconds since the start.
pub fn event_json(event: &Event, stage_time: Option<&ReportStage>, at_s: f64) -> Value {
    let tile_event = |name: &str, stage: &Stage, tile: &TileId| {
        let tile = [tile.row, tile.col];
        json!({ "event": name, "stage": stage.name(), "tile": tile })
    };
    let mut value = match event {
        Event::Enter(stage, tiles) => json!({ "event": "enter", "stage": stage.name(), "tiles": tiles }),
        Event::Started(stage, tile) => tile_event("started", stage, tile),
        Event::Because(stage, tile, why) => {
            let mut value = tile_event("because", stage, tile);
            value["why"] = json!(why);
            value
        }
        Event::Done(stage, tile) => tile_event("done", stage, tile),
        Event::Kept(stage, tile) => tile_event("kept", stage, tile),
        Event::Leave(stage) => {
            let seconds = stage_time.map(|time| (time.wall_s, time.cpu_s)).unwrap_or_default();
            json!({ "event": "leave", "stage": stage.name(), "wall_s": seconds.0, "cpu_s": seconds.1 })
        }
        Event::Note(text) => json!({ "event": "note", "text": text }),
    };
    value["at_s"] = json!(at_s);
    value
}

/// A line of the log on stderr, in words.
pub fn event_text(event: &Event, stage_time: Option<&ReportStage>, at_s: f64) -> String {
    let words = match event {
        Event::Enter(stage, 0) => format!("{} begins", stage.name()),
        Event::Enter(stage, tiles) => format!("{} begins with {tiles} tiles", stage.name()),
        Event::Started(stage, tile) => format!("{} {tile} begins", stage.name()),
        Event::Because(stage, tile, why) => format!("{} {tile} was made again: {why}", stage.name()),
        Event::Done(stage, tile) => format!("{} {tile} is done", stage.name()),
        Event::Kept(stage, tile) => format!("{} {tile} is kept", stage.name()),
        Event::Leave(stage) => {
            let (wall_s, cpu_s) = stage_time.map(|time| (time.wall_s, time.cpu_s)).unwrap_or_default();
            format!("{} ends after {wall_s:.2} s, {cpu_s:.2} s of CPU", stage.name())
        }
        Event::Note(text) => format!("note: {text}"),
    };
    format!("{at_s:>9.3} s  {words}")
}

/// Prints one line of JSON at once. The reader may be gone; the work goes on all the same.
pub fn print_line(value: &Value) {
    let mut out = stdout().lock();
    let _ = writeln!(out, "{value}").and_then(|()| out.flush());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tile_is_named_row_first() {
        let value = event_json(&Event::Done(Stage::Refine, TileId { row: 2, col: 3 }), None, 1.5);
        assert_eq!(value, json!({ "event": "done", "stage": "refine", "tile": [2, 3], "at_s": 1.5 }));
    }

    #[test]
    fn the_end_of_a_stage_has_its_seconds() {
        let time = ReportStage { name: "read".into(), wall_s: 0.5, cpu_s: 1.0 };
        let value = event_json(&Event::Leave(Stage::Read), Some(&time), 2.0);
        assert_eq!((&value["wall_s"], &value["cpu_s"]), (&json!(0.5), &json!(1.0)));
    }
}
