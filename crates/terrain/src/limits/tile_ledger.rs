//! The ledger of one tile, by place: what a point there is charged to, asked and booked in one go.

use crate::{ModuleId, POINT_COST, RefusedBy};

use crate::limits::{Allowance, Charged, Ledger, ModuleLines};

/// What a tile spends on points, by where they stand.
#[derive(Clone, Debug)]
pub struct TileLedger {
    lines: ModuleLines,
    ledger: Ledger,
}

impl TileLedger {
    /// A ledger from which nothing has been spent.
    pub fn new(lines: ModuleLines, allowance: Allowance) -> Self {
        Self { lines, ledger: Ledger::new(allowance) }
    }

    /// The same ledger for places measured in steps of which `per_step` make one of today's.
    pub fn in_finer_steps(mut self, per_step: i32) -> Self {
        self.lines.side *= per_step;
        self
    }

    /// The load module and the limit that refuse a point, if any do. The tile's total is not asked.
    pub fn refuses(&self, row: i32, col: i32) -> Option<(ModuleId, RefusedBy)> {
        let ask = |module, cost| {
            let by = self.ledger.refuses(module, cost, !self.lines.contain(module));
            by.map(|by| (module, by))
        };
        match self.lines.charged(row, col)? {
            Charged::Inside(module) => ask(module, POINT_COST),
            Charged::Between(first, second) => ask(first, 1).or_else(|| ask(second, 1)),
            Charged::Beside(module) => ask(module, 1),
        }
    }

    /// Makes ready to judge many points fast.
    pub fn look_again(&mut self) {
        self.ledger.look_again();
    }

    /// Spends what a point costs.
    ///
    /// # Panics
    /// When a limit refuses it: the caller asks first.
    pub fn charge(&mut self, row: i32, col: i32) {
        self.each_charge(row, col, Ledger::charge);
    }

    /// Notes a point that is there already, whether or not it may be.
    pub fn book(&mut self, row: i32, col: i32) {
        self.each_charge(row, col, Ledger::book);
    }

    /// Notes all points that are there already, by row and column, whether or not they may be.
    pub fn book_all(&mut self, points: impl IntoIterator<Item = (i32, i32)>) {
        let Self { lines, ledger } = self;
        let mut counts = ledger.no_counts();
        for (row, col) in points {
            lines.each_charge(row, col, |module, cost| counts[ledger.module_index(module)] += cost);
        }
        ledger.book_counts(&counts);
    }

    /// Takes back what a point cost.
    ///
    /// # Panics
    /// When it was not booked.
    pub fn refund(&mut self, row: i32, col: i32) {
        self.each_charge(row, col, Ledger::refund);
    }

    fn each_charge(&mut self, row: i32, col: i32, book: impl Fn(&mut Ledger, ModuleId, u32)) {
        let Self { lines, ledger } = self;
        lines.each_charge(row, col, |module, cost| book(ledger, module, cost));
    }

    /// Takes the room of a point that a neighbour chose on a shared side.
    pub fn inherit(&mut self, row: i32, col: i32) {
        if let Some(Charged::Between(first, second)) = self.lines.charged(row, col) {
            for module in [first, second].into_iter().filter(|&module| self.lines.contain(module)) {
                self.ledger.inherit(module, 1);
            }
        }
    }

    /// Whether a point there counts in a load module or window that has more than it may.
    pub fn is_over(&self, row: i32, col: i32) -> bool {
        match self.lines.charged(row, col) {
            Some(Charged::Inside(module) | Charged::Beside(module)) => self.ledger.is_over(module),
            Some(Charged::Between(first, second)) => self.ledger.is_over(first) || self.ledger.is_over(second),
            None => false,
        }
    }

    /// What a point there is charged to; `None` for a load-module corner.
    pub fn charged(&self, row: i32, col: i32) -> Option<Charged> {
        self.lines.charged(row, col)
    }

    /// The counts behind it.
    pub fn counts(&self) -> &Ledger {
        &self.ledger
    }
}
