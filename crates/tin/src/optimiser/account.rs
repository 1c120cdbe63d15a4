//! What the mesh has and what it may have.

use terrain::limits::{Charged, ShortOf, Shortfall, TileLedger};
use terrain::{ModuleId, POINT_COST, RefusedBy};

use crate::optimiser::hold::Hold;
use crate::optimiser::parts::{NONE, Vertex};
use crate::optimiser::place::{PER_POST, Place};
use crate::optimiser::task::Budget;
use crate::optimiser::tile_mesh::TileMesh;

/// The budget as it is spent and refunded, and what is allowed beyond it for a while.
#[derive(Clone)]
pub(crate) struct Account {
    books: Books,
    beyond: i64,
}

#[derive(Clone)]
enum Books {
    /// Triangles or vertices in all.
    Total {
        /// What one vertex inside and one on the border cost.
        cost: (i64, i64),
        most: i64,
        left: i64,
    },
    /// Load modules, windows and the tile's total, by place.
    Limits(TileLedger),
}

impl Account {
    /// The account of a sheet as it stands; it may be overdrawn.
    pub fn new(budget: &Budget, sheet: &TileMesh) -> Self {
        let books = match budget {
            Budget::Triangles(most) => {
                Books::Total { cost: (2, 1), most: *most as i64, left: *most as i64 - sheet.triangle_count as i64 }
            }
            Budget::Vertices(most) => {
                Books::Total { cost: (1, 1), most: *most as i64, left: *most as i64 - sheet.vertex_count as i64 }
            }
            Budget::Limits(ledger) => {
                let mut ledger = ledger.clone().in_finer_steps(PER_POST);
                let live = sheet.vertices.iter().filter(|vertex| vertex.edge != NONE);
                let paid = live.filter(|vertex| !vertex.hold.has(Hold::PLACE));
                ledger.book_all(paid.map(|vertex| (vertex.at.y, vertex.at.x)));
                Books::Limits(ledger)
            }
        };
        Self { books, beyond: 0 }
    }

    /// Permits `share` of the whole more than there may be in the end; 0 takes that back.
    pub fn allow_beyond(&mut self, share: f64) {
        self.beyond = (share * self.most() as f64) as i64;
    }

    /// Keeps so many triangles (or vertices) back.
    pub fn keep_back(&mut self, count: i64) {
        self.beyond = -count;
    }

    /// Triangles (or vertices) the whole may have.
    fn most(&self) -> i64 {
        match &self.books {
            Books::Total { most, .. } => *most,
            Books::Limits(ledger) => i64::from(ledger.counts().spent()) + ledger.counts().left(),
        }
    }

    /// How many triangles (or vertices) more the whole may have.
    pub fn left(&self) -> i64 {
        self.beyond.saturating_add(match &self.books {
            Books::Total { left, .. } => *left,
            Books::Limits(ledger) => ledger.counts().left(),
        })
    }

    /// What any vertex may cost.
    pub fn dearest(&self) -> i64 {
        match &self.books {
            Books::Total { cost, .. } => cost.0,
            Books::Limits(_) => i64::from(POINT_COST),
        }
    }

    fn cost_of(&self, vertex: &Vertex) -> i64 {
        match &self.books {
            Books::Total { cost, .. } => {
                if vertex.hold.is_on_line() {
                    cost.1
                } else {
                    cost.0
                }
            }
            Books::Limits(_) => i64::from(POINT_COST),
        }
    }

    /// What squares come to for as many triangles as a vertex inside costs: one on the outer border costs half of them,
    /// so that two may go, or come, for one inside.
    pub fn rate(&self, vertex: &Vertex, squares: f64) -> f64 {
        let is_half = match &self.books {
            Books::Total { cost, .. } => vertex.hold.is_on_line() && cost.1 < cost.0,
            Books::Limits(ledger) => matches!(ledger.charged(vertex.at.y, vertex.at.x), Some(Charged::Beside(_))),
        };
        if is_half && 0.0 < squares { 2.0 * squares } else { squares }
    }

    /// The load module whose limit, or whose window's, refuses a vertex there.
    pub fn refuses(&self, at: Place) -> Option<(ModuleId, RefusedBy)> {
        let Books::Limits(ledger) = &self.books else { return None };
        ledger.refuses(at.y, at.x)
    }

    /// Makes ready to judge many places fast.
    pub fn look_again(&mut self) {
        if let Books::Limits(ledger) = &mut self.books {
            ledger.look_again();
        }
    }

    /// Whether a vertex fits into the total and every limit.
    pub fn permits(&self, vertex: &Vertex) -> bool {
        self.cost_of(vertex) <= self.left() && self.refuses(vertex.at).is_none()
    }

    /// Spends what a vertex costs.
    pub fn charge(&mut self, vertex: &Vertex) {
        let price = self.cost_of(vertex);
        match &mut self.books {
            Books::Total { left, .. } => *left -= price,
            Books::Limits(ledger) => ledger.book(vertex.at.y, vertex.at.x),
        }
    }

    /// Takes back what a vertex cost.
    pub fn refund(&mut self, vertex: &Vertex) {
        let price = self.cost_of(vertex);
        match &mut self.books {
            Books::Total { left, .. } => *left += price,
            Books::Limits(ledger) => ledger.refund(vertex.at.y, vertex.at.x),
        }
    }

    /// Whether any load module or window has more than it may.
    pub fn is_any_over(&self) -> bool {
        matches!(&self.books, Books::Limits(ledger) if ledger.counts().is_any_over())
    }

    /// Whether taking a vertex out brings something nearer to its limit that is over it.
    pub fn relieves(&self, vertex: &Vertex) -> bool {
        matches!(&self.books, Books::Limits(ledger) if ledger.is_over(vertex.at.y, vertex.at.x))
    }

    /// What is exceeded: the whole, load modules, windows.
    pub fn short(&self) -> Vec<Shortfall> {
        match &self.books {
            Books::Total { most, left, .. } => {
                let of = |count: i64| u32::try_from(count.max(0)).unwrap_or(u32::MAX);
                let short = Shortfall { of: ShortOf::Tile, needed: of(*most - *left), room: of(*most) };
                if *left < 0 { vec![short] } else { Vec::new() }
            }
            Books::Limits(ledger) => ledger.counts().short(),
        }
    }

    /// Triangles spent so far.
    pub fn spent(&self) -> u32 {
        match &self.books {
            Books::Total { .. } => 0,
            Books::Limits(ledger) => ledger.counts().spent(),
        }
    }
}
