//! Every measure of a surface beside those of the regular grid, in words: what `fidelity` and `tin --measure` share.

use inspect::{Fidelity, LineOfSight, Measures, ResidualFigures};
use views::{Align, Table, grouped};

/// All measures as lines: what, of the surface, of the grid, and what it means.
pub fn text(found: &Fidelity) -> String {
    let mut rows = Rows { found, table: Table::new(&[Align::Left, Align::Right, Align::Right, Align::Left]) };
    rows.table.row(["", "TIN", "grid", ""]);
    let (step, spacing) = (found.grid_step, found.spacing_m);
    let every = if step == 1 { "every post".into() } else { format!("every {step} posts") };
    rows.add("Triangles", &format!("the grid: {every}, {} m", f64::from(step) * spacing), |m| {
        Some(grouped(m.mesh.triangles))
    });
    rows.residual();
    rows.classes();
    rows.sight();
    rows.slope();
    rows.cover();
    rows.water();
    rows.apart();
    rows.mesh();
    rows.table.text(0)
}

struct Rows<'a> {
    found: &'a Fidelity,
    table: Table,
}

impl Rows<'_> {
    /// One measure of both; `None` is a dash.
    fn add(&mut self, name: &str, meaning: &str, figure: impl Fn(&Measures) -> Option<String>) {
        let [this, grid] = [&self.found.tin, &self.found.grid].map(|m| figure(m).unwrap_or_else(|| "-".into()));
        self.table.row([name, &this, &grid, meaning]);
    }

    fn residual(&mut self) {
        let posts = self.found.tin.residual.posts;
        let name = if posts == 0 { "Residual: no post" } else { "Residual" };
        let figure = move |metres: f64| (0 < posts).then(|| format!("{metres:.3} m"));
        self.add(name, &format!("RMS, {} posts", grouped(posts)), move |m| figure(m.residual.rms_m));
        self.add("", "mean, DEM less surface", move |m| figure(m.residual.mean_m));
        self.add("", "mean absolute", move |m| figure(m.residual.mean_abs_m));
        self.add("", "half of the posts within", move |m| figure(m.residual.p50_m));
        self.add("", "95 % within", move |m| figure(m.residual.p95_m));
        self.add("", "99 % within", move |m| figure(m.residual.p99_m));
        self.add("", "largest", move |m| figure(m.residual.max_m));
    }

    /// Residuals on the ground of each class.
    fn classes(&mut self) {
        for class in &self.found.classes {
            let posts = class.tin.posts;
            let mut add = |name: &str, meaning: &str, figure: fn(&ResidualFigures) -> f64| {
                let [this, grid] = [&class.tin, &class.grid].map(|found| format!("{:.3} m", figure(found)));
                self.table.row([name, &this, &grid, meaning]);
            };
            add(&format!("On {}", class.name), &format!("RMS, {} posts", grouped(posts)), |found| found.rms_m);
            add("", "99 % within", |found| found.p99_m);
            add("", "largest", |found| found.max_m);
        }
    }

    fn sight(&mut self) {
        let sight = &self.found.tin.line_of_sight;
        let left_out = match sight.left_out {
            0 => String::new(),
            pairs => format!(", {} left out (voids, or no room)", grouped(pairs)),
        };
        if sight.pairs() == 0 {
            self.add("Line of sight", &format!("no pair to compare{left_out}"), |_| None);
            return;
        }
        let share = |share: fn(&LineOfSight) -> f64| move |m: &Measures| Some(percent(share(&m.line_of_sight)));
        let pairs = format!("agreement, {} pairs{left_out}", grouped(sight.pairs()));
        self.add("Line of sight", &pairs, share(LineOfSight::agreement));
        self.add("", "half width of that, 95 % sure", |m| Some(format!("± {}", percent(m.line_of_sight.half_width()))));
        self.add("", "false visible", share(LineOfSight::false_visible_share));
        self.add("", "false hidden", share(LineOfSight::false_hidden_share));
        let on_dem = percent(sight.visible_share_dem());
        self.add("", &format!("visible, {on_dem} on the DEM"), share(LineOfSight::visible_share_tin));
    }

    fn slope(&mut self) {
        let posts = self.found.tin.slope.posts;
        if posts == 0 {
            self.add("Slope", "no inner post to compare", |_| None);
            return;
        }
        let inner = format!("RMS difference, {} inner posts", grouped(posts));
        self.add("Slope", &inner, |m| Some(degrees(m.slope.rms_degrees)));
        self.add("", "mean angle between normals", |m| Some(degrees(m.slope.normal_mean_degrees)));
        self.add("", "95 % of normals within", |m| Some(degrees(m.slope.normal_p95_degrees)));
        let same = "of the ground in the same class of slope";
        self.add("Trafficability", same, |m| Some(percent(m.slope_classes.agreement())));
        self.add("", "in a gentler class than on the DEM", |m| Some(percent(m.slope_classes.gentler())));
        self.add("", "in a steeper class", |m| Some(percent(m.slope_classes.steeper())));
        let on_dem = self.found.tin.slope_classes.shares_dem().map(percent);
        for (class, name) in ["up to 15 %", "15 to 30 %", "30 to 45 %", "above 45 %"].iter().enumerate() {
            let meaning = format!("{name}, {} on the DEM", on_dem[class]);
            self.add("", &meaning, |m| Some(percent(m.slope_classes.shares_tin()[class])));
        }
    }

    fn cover(&mut self) {
        let cover = self.found.tin.cover;
        if cover.posts() == 0 {
            return;
        }
        let name = "agreement: 2 m of defilade within 100 m";
        self.add("Cover", name, |m| Some(percent(m.cover.agreement())));
        let on_dem = percent(cover.share_dem());
        self.add("", &format!("in defilade, {on_dem} on the DEM"), |m| Some(percent(m.cover.share_tin())));
        let folds = cover.both + cover.lost;
        self.add("", "of the DEM's cover kept", move |m| (0 < folds).then(|| percent(m.cover.kept())));
    }

    fn water(&mut self) {
        let dem = self.found.tin.drainage;
        let channels = format!("of the DEM's {} channel posts found within 2 posts", grouped(dem.channels_dem));
        self.add("Drainage", &channels, |m| (0 < m.drainage.channels_dem).then(|| percent(m.drainage.recall())));
        self.add("", "of its own channel posts the DEM has", |m| {
            (0 < m.drainage.channels_tin).then(|| percent(m.drainage.precision()))
        });
        self.add("", "spurious pits deeper than 1 m", |m| Some(grouped(m.drainage.pits_spurious)));
        let missed = format!("pits missed, of {} on the DEM", grouped(dem.pits_dem));
        self.add("", &missed, |m| Some(grouped(m.drainage.pits_missed)));
    }

    fn apart(&mut self) {
        let asked = 0 < self.found.tin.hausdorff.dem_to_tin.places;
        let figure = move |metres: f64| asked.then(|| format!("{metres:.3} m"));
        self.add("Hausdorff", "largest distance in space, DEM to surface", move |m| {
            figure(m.hausdorff.dem_to_tin.max_m)
        });
        self.add("", "mean", move |m| figure(m.hausdorff.dem_to_tin.mean_m));
        self.add("", "largest, vertices to DEM", move |m| figure(m.hausdorff.tin_to_dem.max_m));
        self.add("", "mean", move |m| figure(m.hausdorff.tin_to_dem.mean_m));
        let end = |is_at_end: bool| if is_at_end { "≥ " } else { "" };
        self.add("Registration", "lies aside, by cross-correlation of slopes", |m| {
            m.registration.map(|shift| format!("{}{:.2} m", end(shift.is_at_end), shift.aside_m()))
        });
        self.add("", "east", |m| m.registration.map(|shift| format!("{:.2} m", shift.east_m)));
        self.add("", "north", |m| m.registration.map(|shift| format!("{:.2} m", shift.north_m)));
    }

    fn mesh(&mut self) {
        if self.found.tin.seams.is_some() {
            self.add("Seams", "bend on module lines, of that on other edges as long", |m| {
                m.seams.and_then(|seams| seams.ratio()).map(|ratio| format!("{ratio:.3}"))
            });
        }
        self.add("Mesh", "median of smallest angles", |m| Some(degrees(m.mesh.angle_median_degrees)));
        self.add("", "5 % of triangles below", |m| Some(degrees(m.mesh.angle_p5_degrees)));
        self.add("", "smallest of all", |m| Some(degrees(m.mesh.angle_min_degrees)));
        self.add("", "of triangles below 5°", |m| Some(percent(m.mesh.sliver_share())));
        self.add("", "cracks, T-junctions, torn places", |m| {
            Some(grouped(m.mesh.cracks + m.mesh.t_junctions + m.mesh.torn))
        });
        self.add("", "areas that do not add up", |m| Some(grouped(m.mesh.wrong_areas)));
    }
}

fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

fn degrees(angle: f64) -> String {
    format!("{angle:.2}°")
}

#[cfg(test)]
mod tests {
    use inspect::SlopeDifference;
    use serde_json::Value;

    use super::*;

    fn figures() -> Measures {
        Measures {
            residual: inspect::ResidualFigures { posts: 9, rms_m: 1.25, max_m: 4.0, ..Default::default() },
            line_of_sight: LineOfSight { visible: 280, hidden: 650, false_visible: 50, false_hidden: 20, left_out: 0 },
            slope: SlopeDifference { posts: 4000, rms_degrees: 2.406, ..Default::default() },
            slope_classes: Default::default(),
            hausdorff: Default::default(),
            drainage: Default::default(),
            cover: Default::default(),
            registration: None,
            seams: None,
            mesh: inspect::MeshForm { triangles: 32_000, ..Default::default() },
        }
    }

    fn beside(tin: Measures, grid: Measures) -> Fidelity {
        Fidelity { tin, grid, grid_step: 5, spacing_m: 25.0, polygons: 32_000, classes: Vec::new() }
    }

    #[test]
    fn each_figure_stands_beside_that_of_the_grid() {
        let mut grid = figures();
        grid.residual.rms_m = 3.5;
        grid.line_of_sight =
            LineOfSight { visible: 300, hidden: 600, false_visible: 60, false_hidden: 40, left_out: 0 };
        let text = text(&beside(figures(), grid));
        for line in [
            "Triangles         32,000    32,000  the grid: every 5 posts, 125 m",
            "Residual         1.250 m   3.500 m  RMS, 9 posts",
            "Line of sight    93.00 %   90.00 %  agreement, 1,000 pairs",
            "                ± 1.60 %  ± 1.87 %  half width of that, 95 % sure",
            "                 33.00 %   36.00 %  visible, 30.00 % on the DEM",
            "Slope              2.41°     2.41°  RMS difference, 4,000 inner posts",
        ] {
            assert!(text.lines().any(|found| found == line), "{line:?} is not in:\n{text}");
        }
    }

    #[test]
    fn without_a_pair_or_a_post_there_is_no_figure() {
        let nothing = Measures {
            residual: Default::default(),
            line_of_sight: LineOfSight { left_out: 9, ..LineOfSight::default() },
            slope: SlopeDifference::default(),
            ..figures()
        };
        let nothing = beside(nothing, nothing);
        let text = text(&nothing);
        for part in ["no pair to compare, 9 left out", "no inner post", "Residual: no post"] {
            assert!(text.contains(part), "{part:?} is not in:\n{text}");
        }
        let json = Value::Object(crate::measures_json::fields(&nothing));
        for pointer in [
            "/line_of_sight/agreement",
            "/slope/rms_degrees",
            "/residual/rms_m",
            "/hausdorff/max_m",
            "/cover/agreement",
            "/drainage/recall",
            "/registration",
            "/regular_grid/seams",
        ] {
            assert_eq!(json.pointer(pointer), Some(&Value::Null), "{pointer}");
        }
    }
}
