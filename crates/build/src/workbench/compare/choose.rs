//! The methods by name, and what each is asked for.

use crate::CompileError;
use job::{Choice, Optimising, StartMethod};
use terrain::{Metres, PostRect, Tin};
use tin::methods::{
    Boundary, Contours, DemWindow, Diagonal, Distance, Extrema, FowlerLittle, Impossible, LatticeTin, Splitting,
};

use super::subject::{Subject, Until};
use crate::workbench::{TinMethod, TinStart};

/// Metres between the points of the regular grid of SIMNET.
const SIMNET_M: Metres = Metres(125.0);

/// A method of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CompareMethod {
    /// Very important points.
    Vip {
        /// How far a post stands out.
        distance: Distance,
        /// What becomes of the border.
        boundary: Boundary,
    },
    /// Peaks and pits.
    HighLow(Extrema),
    /// A grid refined where it fails.
    LatticeTin,
    /// Ridges and channels first.
    FowlerLittle,
    /// Triangles split into three.
    Hierarchical(Splitting),
    /// The authors' earlier algorithm.
    Earlier,
    /// A grid of so many points.
    Regular(Diagonal),
    /// The grid of a point every 125 m.
    Simnet(Diagonal),
    /// Contour lines.
    Contour,
    /// The founding paper's iterative method.
    Iterative,
    /// Ours.
    Optimised,
    /// The iterative method from points of another: so many, or all there are of one whose number is the ground's.
    IterativeFrom(StartMethod, Option<usize>),
}

use CompareMethod::{
    Contour, Earlier, FowlerLittle as Fowler, Hierarchical, HighLow, Iterative, IterativeFrom, LatticeTin as Lattice,
    Optimised, Regular, Simnet, Vip,
};

impl CompareMethod {
    /// All of them, each with its name, the usual ones first.
    pub const NAMED: [(&'static str, Self); 17] = [
        ("vip", Vip { distance: Distance::Perpendicular, boundary: Boundary::ForceAll }),
        ("lattice", Lattice),
        ("fowler-little", Fowler),
        ("hierarchical", Hierarchical(Splitting::MaxError)),
        ("earlier", Earlier),
        ("regular", Regular(Diagonal::Fixed)),
        ("contour", Contour),
        ("iterative", Iterative),
        ("optimised", Optimised),
        ("highlow", HighLow(Extrema::Strict)),
        ("simnet", Simnet(Diagonal::Fixed)),
        ("vip-vertical", Vip { distance: Distance::Vertical, boundary: Boundary::ForceAll }),
        ("vip-corners", Vip { distance: Distance::Perpendicular, boundary: Boundary::CornersOnly }),
        ("vip-extend", Vip { distance: Distance::Perpendicular, boundary: Boundary::Extend }),
        ("highlow-plateau", HighLow(Extrema::Plateau)),
        ("hierarchical-best", Hierarchical(Splitting::BestImprovement)),
        ("simnet-best", Simnet(Diagonal::Best)),
    ];

    /// The usual ones: no variants.
    pub fn usual() -> Vec<Self> {
        const USUAL: usize = 11;
        Self::NAMED[..USUAL].iter().map(|&(_, method)| method).collect()
    }

    /// Its name.
    pub fn name(self) -> String {
        match self {
            IterativeFrom(start, Some(points)) => format!("iterative from {}:{points}", start.name()),
            IterativeFrom(start, None) => format!("iterative from {}", start.name()),
            _ => Self::NAMED.iter().find(|&&(_, method)| method == self).map_or("", |&(name, _)| name).to_owned(),
        }
    }

    /// Whether it can be asked for a number of points.
    pub fn takes_points(self) -> bool {
        !matches!(self, HighLow(_) | Simnet(_))
    }

    /// Whether points of the iterative method are worth comparing with.
    pub(super) fn is_comparable(self) -> bool {
        !matches!(self, HighLow(_) | Iterative)
    }

    /// Points of the border that it takes in any case, where those are more than corners.
    pub(super) fn forced(self, rect: PostRect) -> Option<usize> {
        match self {
            Vip { boundary: Boundary::ForceAll, .. } => Some(Boundary::ForceAll.forced(rect)),
            _ => None,
        }
    }

    /// The method's TIN, or why it cannot make one.
    ///
    /// # Errors
    /// When the ground itself cannot be used.
    pub(super) fn make(self, on: &Subject, points: Option<usize>) -> Result<Result<Tin, Impossible>, CompileError> {
        let points = points.unwrap_or(0);
        if self.takes_points()
            && let Err(refused) = within(on.dem.rect(), points)
        {
            return Ok(Err(refused));
        }
        match self {
            Iterative => on.refine(TinMethod::Paper, None, Until::Points(points)).map(Ok),
            IterativeFrom(start, from) => {
                let start = TinStart::Method(start, from.unwrap_or(0));
                on.refine(TinMethod::Paper, Some(start), Until::Points(points)).map(Ok)
            }
            Optimised => on.refine(TinMethod::Optimised(Optimising::default()), None, Until::Points(points)).map(Ok),
            other => Ok(other.simple(&on.ground(), points)),
        }
    }

    fn simple(self, ground: &DemWindow, points: usize) -> Result<Tin, Impossible> {
        let grid = |step, diagonal| tin::methods::regular_grid(ground, step, diagonal);
        match self {
            Vip { distance, boundary } => tin::methods::vip(ground, points, distance, boundary),
            HighLow(extrema) => tin::methods::highlow(ground, extrema),
            Lattice => tin::methods::lattice_tin(ground, &LatticeTin::of_points(points)),
            Fowler => tin::methods::fowler_little(ground, &FowlerLittle::of_points(points)),
            Hierarchical(how) => tin::methods::hierarchical(ground, points, how).map(|made| made.cut(points)),
            Earlier => tin::methods::earlier(ground, points),
            Regular(diagonal) => grid(tin::methods::step_of_points(ground.dem.rect(), points), diagonal),
            Simnet(diagonal) => grid(tin::methods::step_of_spacing(ground.spacing, SIMNET_M), diagonal),
            Contour => tin::methods::contour_tin(ground, Contours::Points(points), None),
            Iterative | IterativeFrom(..) | Optimised => unreachable!("those are refined, not chosen"),
        }
    }
}

/// Refuses a number of points that no TIN of the ground can have.
fn within(rect: PostRect, points: usize) -> Result<(), Impossible> {
    let most = rect.post_count();
    if (4..=most).contains(&points) {
        return Ok(());
    }
    Err(Impossible {
        found: format!("{points} points"),
        expected: format!("4 to {most} points"),
        hint: "the 4 corners of the ground are always in".into(),
    })
}
