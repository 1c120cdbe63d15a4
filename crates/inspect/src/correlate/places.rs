//! Places and pairs of places drawn over what two surfaces have in common, and both grounds under them.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use build::CompileError;
use build::ground::GroundError;
use schedule::Workers;

use super::surface::{Ground, Surface, ended};

/// Bytes, about, of the ground of one surface that is held at once.
const GROUND_BYTES_MAX: f64 = 256e6;
/// Places that one worker asks in one go.
const PLACES_AT_ONCE: usize = 256;
/// Draws for each place that is wanted, where many lie in holes.
const DRAWS_EACH: u64 = 20;

/// Told what is looked at, how many of it are done, and of how many, from any thread.
pub(super) type Tell<'a> = dyn Fn(&'static str, usize, usize) + Sync + 'a;

/// Two surfaces over the rectangle that both reach, by squares of which the ground fits into memory.
pub(super) struct Common<'a> {
    pub a: &'a Surface,
    pub b: &'a Surface,
    /// West, south, east and north, in metres.
    pub rect_m: [f64; 4],
    /// How far around a place the ground may be asked for.
    pub reach_m: f64,
    pub workers: &'a Workers,
    pub stop: &'a AtomicBool,
    tell: &'a Tell<'a>,
    square_m: f64,
    held: Option<([u32; 2], [Ground; 2])>,
}

/// What was found where places were drawn.
pub(super) struct Drawn<T, R> {
    /// Those that could be judged, in the order of draws.
    pub judged: Vec<(T, R)>,
    /// Draws that could not.
    pub left_out: u64,
}

impl<'a> Common<'a> {
    /// Divides the area.
    ///
    /// # Errors
    /// When what is reached around a single place does not fit.
    pub fn new(
        (a, b): (&'a Surface, &'a Surface),
        rect_m: [f64; 4],
        reach_m: f64,
        (workers, stop, tell): (&'a Workers, &'a AtomicBool, &'a Tell<'a>),
    ) -> Result<Self, CompileError> {
        let [wide, high] = [rect_m[2] - rect_m[0], rect_m[3] - rect_m[1]];
        let bytes = |side_m: f64| {
            let both = [a, b].map(|surface| surface.bytes_of(side_m + 2.0 * reach_m));
            both[0].max(both[1])
        };
        // The whole area in one, or squares half as large until one fits with what is reached around it.
        let mut square_m = wide.max(high);
        while GROUND_BYTES_MAX < bytes(square_m) && reach_m < square_m {
            square_m *= 0.5;
        }
        if 8.0 * GROUND_BYTES_MAX < bytes(square_m) {
            let (key, found) = ("range".into(), format!("{:.0} MB of ground around a place", bytes(square_m) / 1e6));
            let expected = format!("{:.0} MB at most", 8.0 * GROUND_BYTES_MAX / 1e6);
            return Err(GroundError::Impossible { key, found, expected, hint: "ask for a smaller range".into() }.into());
        }
        Ok(Self { a, b, rect_m, reach_m, workers, stop, tell, square_m, held: None })
    }

    /// Extent east and north, in metres.
    pub fn size_m(&self) -> [f64; 2] {
        [self.rect_m[2] - self.rect_m[0], self.rect_m[3] - self.rect_m[1]]
    }

    /// What `work` finds on both grounds for each item, in the order of items; `what` they are is told, `at` is where
    /// an item lies.
    ///
    /// # Errors
    /// When ground cannot be read, or it was asked to stop.
    pub fn each<T: Sync, R: Send>(
        &mut self,
        what: &'static str,
        items: &[T],
        at: impl Fn(&T) -> [f64; 2],
        work: impl Fn(&Ground, &Ground, &T) -> R + Sync,
    ) -> Result<Vec<R>, CompileError> {
        let mut squares: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
        for (index, item) in items.iter().enumerate() {
            let [east, north] = at(item);
            let square = [north - self.rect_m[1], east - self.rect_m[0]].map(|far| (far / self.square_m) as u32);
            squares.entry(square).or_default().push(index);
        }
        let mut found: Vec<Option<R>> = items.iter().map(|_| None).collect();
        let done = AtomicUsize::new(0);
        for (square, indices) in squares {
            let (workers, stop, tell) = (self.workers, self.stop, self.tell);
            let [a, b] = self.ground(square)?;
            let parts: Vec<&[usize]> = indices.chunks(PLACES_AT_ONCE).collect();
            let ask = |_: usize, part: &&[usize]| -> Result<Vec<R>, CompileError> {
                let results = part.iter().map(|&index| work(a, b, &items[index])).collect();
                tell(what, done.fetch_add(part.len(), Ordering::Relaxed) + part.len(), items.len());
                Ok(results)
            };
            let results = schedule::for_each_independent(&parts, workers, stop, ask).map_err(ended)?;
            for (&index, result) in indices.iter().zip(results.into_iter().flatten()) {
                found[index] = Some(result);
            }
        }
        Ok(found.into_iter().flatten().collect())
    }

    /// Both grounds of a square, by row and column, and around it.
    fn ground(&mut self, square: [u32; 2]) -> Result<&[Ground; 2], CompileError> {
        if self.held.as_ref().is_none_or(|(held, _)| *held != square) {
            // What was held makes room first.
            self.held = None;
            let low = [1, 0].map(|axis| f64::from(square[axis]) * self.square_m);
            let [west, south] = [0, 1].map(|axis| self.rect_m[axis] + low[axis] - self.reach_m);
            let far = self.square_m + 2.0 * self.reach_m;
            let rect_m = [west, south, west + far, south + far];
            let grounds =
                [self.a.load(rect_m, self.workers, self.stop)?, self.b.load(rect_m, self.workers, self.stop)?];
            self.held = Some((square, grounds));
        }
        let (_, grounds) = self.held.as_ref().expect("it was loaded just now");
        Ok(grounds)
    }

    /// Draws until so many could be judged, or few of many draws can be; `draw` makes an item of a draw's number, and
    /// what is found of it is `None` where it cannot be judged.
    ///
    /// # Errors
    /// When ground cannot be read, or it was asked to stop.
    pub fn drawn<T: Sync, R: Send>(
        &mut self,
        what: &'static str,
        wanted: u64,
        draw: impl Fn(u64) -> Option<T>,
        at: impl Fn(&T) -> [f64; 2],
        work: impl Fn(&Ground, &Ground, &T) -> Option<R> + Sync,
    ) -> Result<Drawn<T, R>, CompileError> {
        let mut drawn = Drawn { judged: Vec::new(), left_out: 0 };
        let mut next = 0;
        while (drawn.judged.len() as u64) < wanted && next < DRAWS_EACH * wanted {
            let count = (wanted - drawn.judged.len() as u64).max(PLACES_AT_ONCE as u64).min(DRAWS_EACH * wanted - next);
            let items: Vec<T> = (next..next + count).filter_map(&draw).collect();
            next += count;
            let found = self.each(what, &items, &at, &work)?;
            drawn.left_out += count - items.len() as u64;
            for (item, result) in items.into_iter().zip(found) {
                match result {
                    _ if drawn.judged.len() as u64 == wanted => break,
                    Some(result) => drawn.judged.push((item, result)),
                    None => drawn.left_out += 1,
                }
            }
        }
        Ok(drawn)
    }
}
