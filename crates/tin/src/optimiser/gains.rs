//! New vertices where they gain most, by what each is found to gain.

use crate::optimiser::account::Account;
use crate::optimiser::insertion::{Found, Insertion};
use crate::optimiser::parts::NONE;
use crate::optimiser::queue::Queue;
use crate::optimiser::tile_mesh::{Star, TileMesh};

/// Part of its gain that an insertion may have lost since it was judged.
const LOST: f64 = 0.02;
/// Quanta squared that an insertion has to gain.
const LEAST_GAIN: f64 = 0.02;

/// Gains from round to round: only what was changed is judged again.
#[derive(Default)]
pub(crate) struct Gains {
    gains: Vec<f64>,
    /// The corners a triangle had when its gain was judged.
    judged: Vec<[u32; 3]>,
    queue: Queue,
}

impl Gains {
    /// Inserts at most `most` vertices while there is room and something to gain. Gives how many there were.
    pub fn insert(
        &mut self,
        sheet: &mut TileMesh,
        account: &mut Account,
        most: usize,
        insertion: &mut Insertion,
    ) -> usize {
        self.judge_all(sheet, insertion);
        let mut count = 0;
        while count < most && account.dearest() <= account.left() {
            let Some((triangle, gain)) = self.queue.pop() else { break };
            if gain <= LEAST_GAIN {
                break;
            }
            count += usize::from(self.insert_into(sheet, account, triangle, gain, insertion));
        }
        count
    }

    fn judge_all(&mut self, sheet: &mut TileMesh, insertion: &mut Insertion) {
        self.queue = Queue::default();
        self.grow(sheet);
        for triangle in 0..sheet.triangles.len() as u32 {
            let corners = sheet.triangles[triangle as usize].corners;
            if corners[0] == NONE {
                continue;
            }
            let has_changed = corners.iter().any(|&corner| sheet.vertices[corner as usize].has_changed);
            if has_changed || self.judged[triangle as usize] != corners {
                self.judge(sheet, triangle, insertion);
            } else if 0.0 < self.gains[triangle as usize] {
                self.queue.enter(triangle, self.gains[triangle as usize]);
            }
        }
        sheet.vertices.iter_mut().for_each(|vertex| vertex.has_changed = false);
    }

    fn grow(&mut self, sheet: &TileMesh) {
        self.gains.resize(sheet.triangles.len(), 0.0);
        self.judged.resize(sheet.triangles.len(), [NONE; 3]);
    }

    fn judge(&mut self, sheet: &mut TileMesh, triangle: u32, insertion: &mut Insertion) {
        let found = insertion.find(sheet, triangle);
        found.inspect(|found| sheet.drop_vertex(found.vertex));
        let gain = found.map_or(0.0, |found| found.gain);
        self.gains[triangle as usize] = gain;
        self.judged[triangle as usize] = sheet.triangles[triangle as usize].corners;
        if 0.0 < gain {
            self.queue.enter(triangle, gain);
        } else {
            self.queue.cancel(triangle);
        }
    }

    /// Returns whether a vertex was inserted.
    fn insert_into(
        &mut self,
        sheet: &mut TileMesh,
        account: &mut Account,
        triangle: u32,
        before: f64,
        insertion: &mut Insertion,
    ) -> bool {
        let Some(Found { gain, vertex }) = insertion.find(sheet, triangle) else { return false };
        let inserted = sheet.vertices[vertex as usize];
        if !account.permits(&inserted) {
            sheet.drop_vertex(vertex);
            return false;
        }
        if gain < before - LOST * before - LEAST_GAIN {
            sheet.drop_vertex(vertex);
            self.gains[triangle as usize] = gain;
            if 0.0 < gain {
                self.queue.enter(triangle, gain);
            }
            return false;
        }
        account.charge(&inserted);
        insertion.patch.old.iter().for_each(|&old| self.queue.cancel(old));
        sheet.apply(&mut insertion.patch);
        let mut around: Vec<u32> = insertion.patch.new.iter().flat_map(|(corners, _)| *corners).collect();
        around.sort_unstable();
        around.dedup();
        self.judge_around(sheet, &around, insertion);
        true
    }

    /// Judges again the triangles around what a change has touched.
    fn judge_around(&mut self, sheet: &mut TileMesh, vertices: &[u32], insertion: &mut Insertion) {
        self.grow(sheet);
        let mut triangles: Vec<u32> = Vec::new();
        let mut star = Star::default();
        for &vertex in vertices {
            sheet.vertices[vertex as usize].has_changed = true;
            sheet.star(vertex, &mut star);
            triangles.extend(star.triangles());
        }
        triangles.sort_unstable();
        triangles.dedup();
        triangles.into_iter().for_each(|triangle| self.judge(sheet, triangle, insertion));
    }
}
