//! What every export needs to work: workers, a flag to stop, someone to tell how far it is.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use schedule::{Workers, for_each_independent};

use crate::ExportError;

/// Takes one file of an export: its path inside the export, with `/` between folders, and its bytes.
pub type Put<'a> = dyn Fn(&str, &[u8]) -> Result<(), ExportError> + Sync + 'a;

/// How far an export is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// What is counted: `tiles read`, `squares`.
    pub what: &'static str,
    /// How many are done.
    pub done: usize,
    /// How many there are.
    pub total: usize,
}

/// What an export works with.
#[derive(Clone, Copy)]
pub struct Work<'a> {
    /// How many things are done at once.
    pub workers: &'a Workers,
    /// Raised when the export should end early.
    pub stop: &'a AtomicBool,
    /// Called after each thing that is done, from any thread; must return at once.
    pub tell: &'a (dyn Fn(Step) + Sync),
}

impl Work<'_> {
    /// Does `task` for every item, in any order; results are in item order.
    pub(crate) fn each<T: Sync, R: Send>(
        &self,
        what: &'static str,
        items: &[T],
        task: impl Fn(&T) -> Result<R, ExportError> + Sync,
    ) -> Result<Vec<R>, ExportError> {
        let done = AtomicUsize::new(0);
        let counted = |_: usize, item: &T| {
            let result = task(item)?;
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            (self.tell)(Step { what, done, total: items.len() });
            Ok(result)
        };
        for_each_independent(items, self.workers, self.stop, counted)
            .map_err(|error| ExportError::of_schedule(what, error))
    }
}
