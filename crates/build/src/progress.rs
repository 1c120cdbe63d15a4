//! What a run tells while it runs.

use store::ReportStage;
use terrain::TileId;

/// The stages of a build, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Stage {
    /// Rasters and vectors are opened, decoded and judged.
    Read,
    /// The ground along features, every tile alone.
    Profile,
    /// How high features lie, over the whole area.
    Level,
    /// What stands on the ground and has room, over the whole area.
    Outlines,
    /// Every tile alone: what would more points gain?
    Survey,
    /// The whole area's budget is shared out.
    Allocate,
    /// Every tile's TIN, in rank order.
    Refine,
    /// Load modules, and their residuals.
    Assemble,
    /// Clip mode: the least valuable points make room where a limit is exceeded.
    Enforce,
    /// The report is written, and the database is declared complete.
    Publish,
    /// Inside of that: the report's page is drawn.
    Page,
}

impl Stage {
    /// As in reports.
    pub fn name(self) -> &'static str {
        self.words()[0]
    }

    /// What it makes, in a few words.
    pub fn meaning(self) -> &'static str {
        self.words()[1]
    }

    fn words(self) -> [&'static str; 2] {
        match self {
            Stage::Read => ["read", "Heights and weights, ready to be asked"],
            Stage::Profile => ["profile", "The ground along roads and water, tile by tile"],
            Stage::Level => ["level", "How high roads and water lie"],
            Stage::Outlines => ["outlines", "Buildings, walls and woods that have room"],
            Stage::Survey => ["survey", "What more points would gain, tile by tile"],
            Stage::Allocate => ["allocate", "What each tile may spend"],
            Stage::Refine => ["refine", "The TINs of tiles"],
            Stage::Assemble => ["assemble", "The load modules of tiles"],
            Stage::Enforce => ["enforce", "Room where a limit is exceeded"],
            Stage::Publish => ["publish", "All that is left, and the report"],
            Stage::Page => ["page", "The report's page"],
        }
    }
}

/// One thing that happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// A stage begins; it has so many tiles to do (0: it does not go by tiles).
    Enter(Stage, usize),
    /// A tile of a stage begins.
    Started(Stage, TileId),
    /// Why a tile that was published before is made again; told just before it is done.
    Because(Stage, TileId, String),
    /// A tile of a stage is done.
    Done(Stage, TileId),
    /// A tile of a stage was published before and is still fresh.
    Kept(Stage, TileId),
    /// A stage ends.
    Leave(Stage),
    /// Something a person should know.
    Note(String),
}

/// Listens to a run.
pub trait Progress: Send {
    /// Called in order, by one worker at a time; must return at once.
    fn tell(&mut self, event: Event);

    /// What the stage that is about to be left has taken this time; told just before it is left.
    fn took(&mut self, _time: ReportStage) {}
}
