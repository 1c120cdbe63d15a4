//! The limits of a job that `init` writes: those asked for, or the least budget that keeps roads and water whole.

use std::path::Path;

use build::workbench::Suggestion;
use build::{BUDGETS, Budgeted, ObjectBudget, limits_of};
use job::Job;
use views::grouped;

use crate::commands::budgets::{of_objects, open, share, wide};
use crate::commands::init_features::kept_text;
use crate::failure::Failure;

/// What a person asks of the limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Asked {
    /// What the data needs.
    Data,
    /// Those of SIMNET's hardware.
    Simnet,
    /// So many triangles of a load module on average.
    Mean(u32),
    /// This RMS residual in metres.
    Rms(f64),
}

/// The limits of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Triangles of a load module on average.
    pub mean: u32,
    /// At most in a load module, and in a square of 4 km.
    pub most: [u32; 2],
    /// What budgets would keep; empty without features.
    pub budgets: Vec<Budgeted>,
    /// Why it is these, in a line each.
    pub said: Vec<String>,
    /// What limits would keep of objects, the one that is chosen last; empty without objects.
    pub objects: Vec<ObjectBudget>,
}

impl Limits {
    /// Those of a mean, of which nothing is known.
    pub fn of(mean: u32) -> Self {
        Self { mean, most: limits_of(mean), budgets: Vec::new(), said: Vec::new(), objects: Vec::new() }
    }

    /// Triangles of a load module that are left to the ground, on average.
    pub fn for_ground(&self, modules: u64) -> u32 {
        let features = self.budgets.iter().find(|budget| budget.mean == self.mean).map_or(0, |of| of.triangles);
        let each = features.div_ceil(modules.max(1));
        self.mean.saturating_sub(u32::try_from(each).unwrap_or(u32::MAX)).max(self.mean / 2).max(1)
    }

    /// What budgets would keep, as comments of a job.
    pub fn comment(&self) -> String {
        let mut text = String::new();
        if !self.budgets.is_empty() {
            text += "# What budgets would keep of the length of roads and rivers, of main roads and\n\
                     # rails in their width (wide), and of lakes of 1 ha and more:\n";
        }
        for of in &self.budgets {
            let lakes =
                if of.lakes[1] == 0 { String::new() } else { format!(", {} of {} lakes", of.lakes[0], of.lakes[1]) };
            let wide = wide(of).map_or(String::new(), |share| format!(", {share} wide"));
            let chosen = if of.mean == self.mean { "  (this job)" } else { "" };
            text += &format!("#   mean {:>4}: {:>5}{wide}{lakes}{chosen}\n", of.mean, share(of.metres(|_| true)));
        }
        text
    }
}

/// Chooses the limits. `text` is the job with any.
///
/// # Errors
/// When rasters cannot be read.
pub fn choose(asked: Asked, suggestion: &Suggestion, text: &str) -> Result<Limits, Failure> {
    let mean = match asked {
        Asked::Data => None,
        Asked::Simnet => Some(BUDGETS[0]),
        Asked::Mean(mean) => Some(mean),
        Asked::Rms(rms_m) => Some(suggestion.triangles_for(rms_m)?),
    };
    let usual = Limits::of(mean.unwrap_or(BUDGETS[0]));
    // What cannot be opened is refused by a build, in its own words.
    let Ok(job) = Job::from_text(text, Path::new("job")) else { return Ok(usual) };
    let budgets = open(&job);
    let objects = of_objects(&job, budgets.as_ref());
    let usual = Limits { said: objects_said(&objects).into_iter().collect(), objects, ..usual };
    let Some(budgets) = budgets else { return Ok(usual) };
    let mut tried = Vec::new();
    for rung in BUDGETS {
        // With so little, not even the first points fit.
        let Ok(of) = budgets.of_mean(rung) else { continue };
        let is_last = of.holds();
        tried.push(of);
        if is_last {
            break;
        }
    }
    if let Some(mean) = mean.filter(|mean| tried.iter().all(|of| of.mean != *mean)) {
        tried.extend(budgets.of_mean(mean));
        tried.sort_by_key(|of| of.mean);
    }
    let Some(chosen) = tried.iter().find(|of| mean.map_or_else(|| of.holds(), |mean| of.mean == mean)).or(tried.last())
    else {
        return Ok(usual);
    };
    let said = [vec![sentence(chosen, &tried, mean.is_some())], usual.said].concat();
    let (mean, most) = (chosen.mean, [chosen.per_load_module, chosen.per_window]);
    Ok(Limits { mean, most, budgets: tried, said, ..usual })
}

/// Why objects have these limits.
fn objects_said(tried: &[ObjectBudget]) -> Option<String> {
    let chosen = tried.last().filter(|chosen| !chosen.kinds.is_empty())?;
    let most = grouped(chosen.per_load_module.into());
    Some(format!("{most} roofs, walls and triangles of woods in a load module keep {}", kept_text(chosen)))
}

/// Why it is this mean.
fn sentence(chosen: &Budgeted, tried: &[Budgeted], is_asked: bool) -> String {
    let kept = |of: &Budgeted| {
        let roads = of.metres(|kind| kind.is_travelled());
        match (0.0 < roads[1], 0.0 < of.metres(|_| true)[1]) {
            (true, _) => format!("{} of the roads", share(roads)),
            (false, true) => format!("{} of the rivers", share(of.metres(|_| true))),
            (false, false) => format!("{} of {} lakes", of.lakes[0], of.lakes[1]),
        }
    };
    let mean = chosen.mean;
    if chosen.metres(|_| true)[1] == 0.0 && chosen.lakes[1] == 0 {
        return format!(
            "{mean} triangles a load module; no road or river of the files and no lake of 1 ha lies in the area"
        );
    }
    match tried.first().filter(|least| least.mean < mean && !is_asked) {
        Some(least) => format!("{mean} triangles a load module: {} would keep {}", least.mean, kept(least)),
        None => format!("{mean} triangles a load module keep {}", kept(chosen)),
    }
}
