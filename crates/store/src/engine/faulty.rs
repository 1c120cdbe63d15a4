//! A memory that fails as real disks and computers do, the same way every time it is given the same seed.
//!
//! Workers are threads that take turns: one at a time goes on, from one operation on the store to the next, and the
//! seed says which. So a run depends on nothing but its seed, and time is a number that the seed moves on.

use std::io::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use fastrand::Rng;

use crate::engine::{Clock, Durability, Entry, Guard, Held, LockKind, Memory, Store};

/// What goes wrong, each once in so many operations; never where that is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Faults {
    /// An operation fails, done or not.
    pub error: u32,
    /// A worker is ended, in the middle of what it was writing.
    pub death: u32,
    /// A worker stands still, for up to two minutes.
    pub stall: u32,
    /// The computer of all of them loses its power: what was not synced may be lost or torn.
    pub power: u32,
}

/// The longest time for which a worker stands still.
pub const STALL_MAX: Duration = Duration::from_secs(120);

/// What all workers of a run share: the files, the time, and whose turn it is.
#[derive(Debug)]
pub struct World {
    memory: Memory,
    state: Mutex<State>,
    /// One for each worker.
    turns: Vec<Condvar>,
}

#[derive(Debug)]
struct State {
    random: Rng,
    faults: Faults,
    now: Duration,
    turn: usize,
    workers: Vec<Worker>,
    /// How many faults there were.
    count: usize,
}

#[derive(Clone, Copy, Debug, Default)]
struct Worker {
    is_dead: bool,
    has_left: bool,
    /// Whether it has gone on since it was last given the turn.
    is_at_work: bool,
    /// Until when it waits.
    until: Duration,
}

/// The store and the clock of one worker.
#[derive(Clone, Debug)]
pub struct Faulty {
    world: Arc<World>,
    worker: usize,
}

/// What becomes of one operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    Done,
    /// It is done, and said to have failed.
    DoneAndDenied,
    /// It is done in part, a share out of 256, and the worker is no more.
    Torn(u8),
}

impl World {
    /// A world of so many workers, each of which must be run by a thread of its own.
    pub fn new(seed: u64, workers: usize, faults: Faults) -> Arc<Self> {
        let mut random = Rng::with_seed(seed);
        let turn = random.usize(..workers);
        let turns = (0..workers).map(|_| Condvar::new()).collect();
        let workers = vec![Worker::default(); workers];
        let state = State { random, faults, now: Duration::ZERO, turn, workers, count: 0 };
        Arc::new(Self { memory: Memory::new(), state: Mutex::new(state), turns })
    }

    /// The store of one of its workers.
    pub fn worker(self: &Arc<Self>, worker: usize) -> Faulty {
        Faulty { world: Arc::clone(self), worker }
    }

    /// The files, without faults.
    pub fn memory(&self) -> &Memory {
        &self.memory
    }

    /// How many faults there were.
    pub fn faults(&self) -> usize {
        self.state().count
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl State {
    /// Passes the turn to one of the workers that do not wait.
    fn pass_on(&mut self) {
        let earliest = self.workers.iter().filter(|worker| !worker.has_left).map(|worker| worker.until).min();
        let Some(earliest) = earliest else { return };
        self.now = self.now.max(earliest);
        let is_ready = |&at: &usize| !self.workers[at].has_left && self.workers[at].until <= self.now;
        let ready: Vec<usize> = (0..self.workers.len()).filter(is_ready).collect();
        self.turn = ready[self.random.usize(..ready.len())];
    }

    fn happens(&mut self, once_in: u32) -> bool {
        let happens = 0 < once_in && self.random.u32(..once_in) == 0;
        self.count += usize::from(happens);
        happens
    }
}

/// What a worker that is no more is told.
fn dead() -> Error {
    Error::other("this worker was ended")
}

impl Faulty {
    /// Another process in place of one that has ended.
    pub fn begin_again(&self) {
        self.world.state().workers[self.worker].is_dead = false;
    }

    /// Whether it was ended.
    pub fn is_dead(&self) -> bool {
        self.world.state().workers[self.worker].is_dead
    }

    /// It takes no part any more.
    pub fn leave(&self) {
        let mut state = self.turn(self.world.state());
        state.workers[self.worker].has_left = true;
        self.pass_on(&mut state);
    }

    fn turn<'a>(&self, state: MutexGuard<'a, State>) -> MutexGuard<'a, State> {
        let is_others = |state: &mut State| state.turn != self.worker;
        let mut state =
            self.world.turns[self.worker].wait_while(state, is_others).unwrap_or_else(PoisonError::into_inner);
        state.workers[self.worker].is_at_work = true;
        state
    }

    /// Passes the turn to another, unless it was given to this one before it came to ask for it.
    fn pass_on(&self, state: &mut State) {
        if state.turn == self.worker && state.workers[self.worker].is_at_work {
            state.workers[self.worker].is_at_work = false;
            state.pass_on();
            self.world.turns[state.turn].notify_one();
        }
    }

    /// Lets others go on, and says what becomes of the next operation once it is this one's turn again.
    fn step(&self) -> Result<Fate> {
        let mut state = self.world.state();
        if state.workers[self.worker].is_dead {
            return Err(dead());
        }
        self.pass_on(&mut state);
        let mut state = self.turn(state);
        // It may have ended while it waited.
        if state.workers[self.worker].is_dead {
            return Err(dead());
        }
        let passes = state.random.u64(0..20);
        state.now += Duration::from_millis(passes);
        let faults = state.faults;
        if state.happens(faults.stall) {
            let passes = Duration::from_millis(state.random.u64(..STALL_MAX.as_millis() as u64));
            state.workers[self.worker].until = state.now + passes;
            self.pass_on(&mut state);
            state = self.turn(state);
            if state.workers[self.worker].is_dead {
                return Err(dead());
            }
        }
        if state.happens(faults.power) {
            let State { random, workers, .. } = &mut *state;
            self.world.memory.lose_power(|cases| random.usize(..cases));
            workers.iter_mut().for_each(|worker| worker.is_dead = true);
            return Err(dead());
        }
        if state.happens(faults.death) {
            state.workers[self.worker].is_dead = true;
            return Ok(Fate::Torn(state.random.u8(..)));
        }
        if state.happens(faults.error) {
            let kinds = [ErrorKind::StorageFull, ErrorKind::TimedOut, ErrorKind::Other];
            let kind = kinds[state.random.usize(..kinds.len())];
            return if state.random.bool() { Ok(Fate::DoneAndDenied) } else { Err(kind.into()) };
        }
        Ok(Fate::Done)
    }

    /// One operation that is done whole or not at all.
    fn whole<R>(&self, done: impl FnOnce(&Memory) -> Result<R>) -> Result<R> {
        match self.step()? {
            Fate::Done => done(&self.world.memory),
            Fate::DoneAndDenied => done(&self.world.memory).and(Err(ErrorKind::TimedOut.into())),
            // As many die just before it as just after it.
            Fate::Torn(share) if share < 128 => Err(dead()),
            Fate::Torn(_) => done(&self.world.memory).and(Err(dead())),
        }
    }

    /// One operation that writes bytes and may be torn.
    fn torn<R>(&self, bytes: &[u8], write: impl FnOnce(&Memory, &[u8]) -> Result<R>) -> Result<R> {
        match self.step()? {
            Fate::Done => write(&self.world.memory, bytes),
            Fate::DoneAndDenied => write(&self.world.memory, bytes).and(Err(ErrorKind::TimedOut.into())),
            Fate::Torn(share) => {
                let part = bytes.len() * usize::from(share) / 256;
                write(&self.world.memory, &bytes[..part]).and(Err(dead()))
            }
        }
    }
}

impl Clock for Faulty {
    fn wall(&self) -> Duration {
        self.world.state().now
    }

    fn wait(&self, time: Duration) {
        let mut state = self.world.state();
        if state.workers[self.worker].is_dead {
            return;
        }
        state.workers[self.worker].until = state.now + time;
        self.pass_on(&mut state);
        drop(self.turn(state));
    }
}

impl Store for Faulty {
    fn read(&self, path: &Path) -> Result<Vec<u8>> {
        self.whole(|memory| memory.read(path))
    }

    fn read_start(&self, path: &Path, count: usize) -> Result<Vec<u8>> {
        self.whole(|memory| memory.read_start(path, count))
    }

    fn entry(&self, path: &Path) -> Result<Entry> {
        self.whole(|memory| memory.entry(path))
    }

    fn list(&self, folder: &Path) -> Result<Vec<PathBuf>> {
        self.whole(|memory| memory.list(folder))
    }

    fn replace(&self, path: &Path, bytes: &[u8], durability: Durability) -> Result<()> {
        let temporary = self.torn(bytes, |memory, bytes| memory.write_temporary(path, bytes))?;
        let renamed = self.whole(|memory| memory.rename(&temporary, path, durability));
        if renamed.is_err() && !self.is_dead() {
            // As a process does that could not rename it.
            let _ = self.world.memory.remove(&temporary);
        }
        renamed
    }

    fn create_new(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        self.whole(|memory| memory.create_new(path, b""))?;
        self.torn(bytes, |memory, bytes| memory.overwrite(path, bytes))
    }

    fn overwrite(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        self.whole(|memory| memory.overwrite(path, b""))?;
        self.torn(bytes, |memory, bytes| memory.overwrite(path, bytes))
    }

    fn remove(&self, path: &Path) -> Result<()> {
        self.whole(|memory| memory.remove(path))
    }

    fn make_folder(&self, path: &Path) -> Result<()> {
        self.whole(|memory| memory.make_folder(path))
    }

    fn make_folders(&self, path: &Path) -> Result<()> {
        self.whole(|memory| memory.make_folders(path))
    }

    fn remove_folder(&self, path: &Path) -> Result<()> {
        self.whole(|memory| memory.remove_folder(path))
    }

    fn sync(&self, dir: &Path, files: &[PathBuf], folders: &[PathBuf]) -> Result<()> {
        self.whole(|memory| memory.sync(dir, files, folders))
    }

    fn lock(&self, path: &Path, kind: LockKind) -> Result<Option<Box<dyn Guard>>> {
        self.whole(|memory| memory.lock(path, kind))
    }

    fn held(&self, path: &Path) -> Held {
        self.whole(|memory| Ok(memory.held(path))).unwrap_or(Held::Free)
    }
}
