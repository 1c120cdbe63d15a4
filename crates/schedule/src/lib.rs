//! Workers: the only place with threads. Knows tasks by number and nothing of terrain.
//!
//! Two ways to spend workers: [`in_rank_order`], for tasks that build on their neighbours of lower rank, and
//! [`for_each_independent`], for items that know nothing of one another. In both, results come back in task order, so
//! neither timing nor the number of workers can be seen in them; a panic in a task becomes an error that names the
//! task; and a flag (Ctrl-C) lets running tasks finish and starts no others.
//!
//! What is absent: no clock, no files, no printing.

mod attempt;
mod workers;
pub use attempt::ScheduleError;
pub use workers::{Workers, for_each_independent};
mod plan;
pub use plan::RankedTasks;
mod ranked;
pub use ranked::{Event, in_rank_order, in_rank_order_observed};
mod heartbeat;
pub use heartbeat::with_heartbeat;
mod simulate;
pub use simulate::{Simulation, simulate};
