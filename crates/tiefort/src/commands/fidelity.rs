//! `tiefort fidelity`: how true is the database to the ground?

use std::path::PathBuf;

use clap::Args;
use inspect::{DatabaseFidelity, PastObjectsFound, Sights};
use serde_json::{Value, json};
use views::{fold, grouped};

use crate::arguments::{Against, Format};
use crate::failure::{Failure, OUTDATED, Outcome};
use crate::{measures, measures_json};

const AFTER_HELP: &str = "\
Examples:
  tiefort fidelity ntc.tdb
  tiefort fidelity desert.tdb --against desert.tif    against a raster of your own
  tiefort fidelity ntc.tdb --format json | jq .line_of_sight.agreement

Every figure stands beside that of the regular grid over the same posts with
about as many triangles. Line of sight: pairs of places 200 m to 4,000 m apart,
eyes and targets 2.5 m above each ground;
does the TIN show what the DEM shows? Slope, normals and trafficability (classes of 15, 30 and 45 %):
central differences at inner posts. Cover: posts 2 m below a line between two
places within 100 m. Drainage: posts that drain more than 500 others. Hausdorff:
nearest places in space, both ways. Registration: up to 8 posts aside. Seams:
bends on lines between load modules.

Exit codes: 0 measured; 2 nothing to measure, or no ground to measure against.";

/// Arguments of `fidelity`.
#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub struct Arguments {
    /// Folder of the terrain database
    #[arg(value_name = "DIR")]
    database: PathBuf,
    /// Pairs of places for line of sight
    #[arg(long, value_name = "N", default_value_t = Sights::USUAL.pairs,
          value_parser = clap::value_parser!(u32).range(1..=PAIRS_MAX))]
    pairs: u32,
    /// What the pairs are drawn from: the same seed, the same pairs
    #[arg(long, value_name = "S", default_value_t = Sights::USUAL.seed)]
    seed: u64,
    #[command(flatten)]
    against: Against,
    /// For a person or a program
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

/// Most pairs that may be asked for: a few minutes, and a half width below 0.01 %.
const PAIRS_MAX: i64 = 100_000_000;

/// Measures.
pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let sights = Sights { pairs: arguments.pairs, seed: arguments.seed };
    let found = inspect::fidelity(&arguments.database, arguments.against.rasters(), sights)?;
    arguments.against.tell_covered(found.covered);
    arguments.format.print(|| text(&found), || to_json(&found, sights))?;
    Ok(Outcome::Sound)
}

/// Said of the ground that a database was built from, where it differs from its sources.
const BURNED: &str =
    "\nas tiles were refined to it, with roads and water burned in; --against FILE measures against FILE itself";

fn text(found: &DatabaseFidelity) -> String {
    let classes = found.no_classes.as_ref().map(|why| format!("residuals are not told by class: {why}"));
    let outdated = found.is_outdated.then(|| format!("the database is outdated: {OUTDATED}"));
    let notes: String = outdated.into_iter().chain(classes).map(|note| fold(&format!("\nnote: {note}\n"), 2)).collect();
    let figures = measures::text(&found.measures);
    let burned = if found.is_burned { BURNED } else { "" };
    let own = found.at_own_posts.as_ref().map(|own| {
        let (posts, rms_m, max_m) = (grouped(own.posts), own.rms_m, own.max_m);
        format!("At the raster's own posts: RMS {rms_m:.3} m, largest {max_m:.2} m, {posts} posts\n")
    });
    let (area, against) = (&found.area, &found.against);
    let own = own.unwrap_or_default();
    let past = found.past_objects.map(|past| past_text(&past)).unwrap_or_default();
    format!("Gaming area {area} against {against}{burned}\n{own}\n{figures}{past}{notes}")
}

fn past_text(past: &PastObjectsFound) -> String {
    let share = |count: u64| format!("{:.2} %", 100.0 * count as f64 / past.pairs.max(1) as f64);
    let [ground, buildings, all] = [past.over_ground, past.past_buildings, past.past_all].map(share);
    format!(
        "\nOf {} pairs {ground} are seen over the ground, {buildings} past buildings and walls, {all} past woods too\n",
        grouped(past.pairs)
    )
}

fn to_json(found: &DatabaseFidelity, sights: Sights) -> Value {
    let mut all = json!({
        "area": found.area,
        "against": found.against,
        "covered": found.covered,
        "has_features_burned_in": found.is_burned,
        "outdated": found.is_outdated,
        "residual_at_own_posts": found.at_own_posts.as_ref().map(measures_json::residual),
        "seed": sights.seed,
        "past_objects": found.past_objects,
        "residual_as_built": found.residual,
    });
    for (name, figures) in measures_json::fields(&found.measures) {
        all[name] = figures;
    }
    all
}
