//! Exchange: the vertices that explain least go where the ground has most to explain, while that gains.

use crate::account::Account;
use crate::insertion::{Found, Insertion};
use crate::parts::{NONE, Vertex};
use crate::queue::Queue;
use crate::removal::Removal;
use crate::tenants::Tenants;
use crate::thin::is_dearer;
use crate::tile_mesh::TileMesh;

/// Part of its gain that an insertion may have lost since it was judged.
const LOST: f64 = 0.02;
/// Quanta squared that an exchange has to gain.
const LEAST_GAIN: f64 = 0.02;

/// What may be changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Terms {
    /// As many vertices go as come.
    OneForOne,
    /// Vertices come while there is room and gain; none goes.
    OnlyInsert,
}

/// Costs and gains from round to round: only what was stirred is judged again.
#[derive(Default)]
pub(crate) struct Exchange {
    costs: Vec<Option<f64>>,
    gains: Vec<f64>,
    /// The corners a triangle had when its gain was judged.
    judged: Vec<[u32; 3]>,
    removals: Queue,
    insertions: Queue,
    /// Who stands where, once a limit has refused somebody in this round.
    tenants: Option<Tenants>,
}

/// The tools of a round.
pub(crate) struct Tools<'a> {
    pub removal: &'a mut Removal,
    pub insertion: &'a mut Insertion,
}

impl Exchange {
    /// One round of at most `most` insertions. Gives how many there were.
    pub fn round(
        &mut self,
        sheet: &mut TileMesh,
        account: &mut Account,
        terms: Terms,
        most: usize,
        tools: &mut Tools,
    ) -> usize {
        self.judge_all(sheet, terms, tools);
        let mut count = 0;
        while count < most {
            let Some((triangle, gain)) = self.insertions.peek() else { break };
            let cheapest = if terms == Terms::OneForOne { self.removals.peek() } else { None };
            if account.left() < account.dearest() {
                let Some((vertex, worth)) = cheapest else { break };
                if gain <= -worth + LEAST_GAIN {
                    break;
                }
                self.removals.pop();
                self.remove(sheet, account, vertex, -worth, tools);
            } else {
                // Room that is there is taken, whatever the cheapest vertex costs.
                if gain <= LEAST_GAIN {
                    break;
                }
                self.insertions.pop();
                count += usize::from(self.insert(sheet, account, terms, (triangle, gain), tools));
            }
        }
        count
    }

    /// Gives triangles of at least `least` squares a vertex where limits have refused one, in exchange for the vertex
    /// that explains least of those which stand in its way. Nothing else is judged, so this costs next to nothing.
    pub fn relieve(&mut self, sheet: &mut TileMesh, account: &mut Account, least: f64, tools: &mut Tools) {
        self.grow(sheet);
        let live = (0..sheet.triangles.len() as u32).filter(|&triangle| sheet.is_live(triangle));
        let squares = |triangle: u32| sheet.triangles[triangle as usize].squares;
        let mut worst: Vec<u32> = live.filter(|&triangle| least <= squares(triangle)).collect();
        worst.sort_unstable_by(|&a, &b| squares(b).total_cmp(&squares(a)).then(a.cmp(&b)));
        for triangle in worst {
            if !sheet.is_live(triangle) || sheet.triangles[triangle as usize].squares < least {
                continue;
            }
            let Some(Found { gain, vertex }) = tools.insertion.find(sheet, triangle) else { continue };
            let guest = sheet.vertices[vertex as usize];
            sheet.drop_vertex(vertex);
            let Some(place) = account.where_to_save(guest.at) else { continue };
            let tenants = self.tenants.get_or_insert_with(|| Tenants::new(account, sheet));
            for tenant in tenants.within(place) {
                self.costs[tenant as usize] = tools.removal.find(sheet, tenant);
            }
            if self.make_room(sheet, account, &guest, (triangle, gain), tools) {
                self.insert(sheet, account, Terms::OnlyInsert, (triangle, gain), tools);
            }
        }
    }

    /// What the least useful vertex of the last round explains.
    pub fn cheapest(&mut self) -> Option<f64> {
        self.removals.peek().map(|(_, worth)| -worth)
    }

    fn judge_all(&mut self, sheet: &mut TileMesh, terms: Terms, tools: &mut Tools) {
        (self.removals, self.insertions, self.tenants) = (Queue::default(), Queue::default(), None);
        self.grow(sheet);
        if terms == Terms::OneForOne {
            for vertex in 0..sheet.vertices.len() as u32 {
                if sheet.vertices[vertex as usize].is_stirred {
                    self.costs[vertex as usize] = tools.removal.find(sheet, vertex);
                }
                match self.costs[vertex as usize] {
                    Some(cost) if sheet.is_vertex(vertex) => self.removals.enter(vertex, -cost),
                    _ => {}
                }
            }
        }
        for triangle in 0..sheet.triangles.len() as u32 {
            let corners = sheet.triangles[triangle as usize].corners;
            if corners[0] == NONE {
                continue;
            }
            let is_stirred = corners.iter().any(|&corner| sheet.vertices[corner as usize].is_stirred);
            if is_stirred || self.judged[triangle as usize] != corners {
                self.judge_triangle(sheet, triangle, tools);
            } else if 0.0 < self.gains[triangle as usize] {
                self.insertions.enter(triangle, self.gains[triangle as usize]);
            }
        }
        sheet.vertices.iter_mut().for_each(|vertex| vertex.is_stirred = false);
    }

    fn grow(&mut self, sheet: &TileMesh) {
        self.costs.resize(sheet.vertices.len(), None);
        self.gains.resize(sheet.triangles.len(), 0.0);
        self.judged.resize(sheet.triangles.len(), [NONE; 3]);
    }

    fn judge_triangle(&mut self, sheet: &mut TileMesh, triangle: u32, tools: &mut Tools) {
        let found = tools.insertion.find(sheet, triangle);
        found.inspect(|found| sheet.drop_vertex(found.vertex));
        let gain = found.map_or(0.0, |found| found.gain);
        self.gains[triangle as usize] = gain;
        self.judged[triangle as usize] = sheet.triangles[triangle as usize].corners;
        if 0.0 < gain {
            self.insertions.enter(triangle, gain);
        } else {
            self.insertions.cancel(triangle);
        }
    }

    /// Gives whether the vertex went; it does not if it has become dearer.
    fn remove(
        &mut self,
        sheet: &mut TileMesh,
        account: &mut Account,
        vertex: u32,
        before: f64,
        tools: &mut Tools,
    ) -> bool {
        let Some(cost) = tools.removal.find(sheet, vertex) else { return false };
        if is_dearer(cost, before) {
            self.costs[vertex as usize] = Some(cost);
            self.removals.enter(vertex, -cost);
            return false;
        }
        account.refund(&sheet.vertices[vertex as usize]);
        tools.removal.patch.old.iter().for_each(|&old| self.insertions.cancel(old));
        sheet.apply(&mut tools.removal.patch);
        sheet.drop_vertex(vertex);
        let ring = std::mem::take(&mut tools.removal.star.ring);
        self.judge_around(sheet, &ring, tools);
        tools.removal.star.ring = ring;
        true
    }

    /// Gives whether a vertex was inserted.
    fn insert(
        &mut self,
        sheet: &mut TileMesh,
        account: &mut Account,
        terms: Terms,
        (triangle, before): (u32, f64),
        tools: &mut Tools,
    ) -> bool {
        let Some(Found { gain, vertex }) = tools.insertion.find(sheet, triangle) else { return false };
        let guest = sheet.vertices[vertex as usize];
        if !account.permits(&guest) {
            sheet.drop_vertex(vertex);
            if terms == Terms::OneForOne && self.make_room(sheet, account, &guest, (triangle, gain), tools) {
                // The ground around may have changed: it comes up again, and next if it is still worth as much.
                self.insertions.enter(triangle, gain);
            }
            return false;
        }
        if gain < before - LOST * before - LEAST_GAIN {
            sheet.drop_vertex(vertex);
            self.gains[triangle as usize] = gain;
            if 0.0 < gain {
                self.insertions.enter(triangle, gain);
            }
            return false;
        }
        account.charge(&guest);
        if let Some(tenants) = &mut self.tenants {
            tenants.enter(account, sheet, vertex);
        }
        tools.insertion.patch.old.iter().for_each(|&old| self.insertions.cancel(old));
        sheet.apply(&mut tools.insertion.patch);
        let mut around = Vec::new();
        for (corners, _) in &tools.insertion.patch.new {
            around.extend(corners.iter().copied().filter(|corner| !around.contains(corner)).collect::<Vec<_>>());
        }
        self.judge_around(sheet, &around, tools);
        true
    }

    /// Where limits refuse a guest in `triangle`: takes the vertex out that explains least of those which stand in its
    /// way, if the guest explains more. Gives whether one went.
    fn make_room(
        &mut self,
        sheet: &mut TileMesh,
        account: &mut Account,
        guest: &Vertex,
        (triangle, gain): (u32, f64),
        tools: &mut Tools,
    ) -> bool {
        let Some(place) = account.where_to_save(guest.at) else { return false };
        let tenants = self.tenants.get_or_insert_with(|| Tenants::new(account, sheet));
        let corners = sheet.triangles[triangle as usize].corners;
        let cost = |vertex: u32| self.costs[vertex as usize].filter(|_| sheet.is_vertex(vertex));
        let cheap = tenants.within(place).filter(|vertex| !corners.contains(vertex));
        let mut cheap: Vec<(f64, u32)> = cheap
            .filter_map(|vertex| Some((cost(vertex)?, vertex)))
            .filter(|(cost, _)| cost + LEAST_GAIN < gain)
            .collect();
        cheap.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (before, vertex) in cheap {
            if account.permits_instead_of(&sheet.vertices[vertex as usize], guest) {
                return self.remove(sheet, account, vertex, before, tools);
            }
        }
        false
    }

    /// Judges again what a change has touched: its vertices, and the triangles around them.
    fn judge_around(&mut self, sheet: &mut TileMesh, vertices: &[u32], tools: &mut Tools) {
        self.grow(sheet);
        let mut triangles: Vec<u32> = Vec::new();
        let mut star = crate::tile_mesh::Star::default();
        for &vertex in vertices {
            sheet.vertices[vertex as usize].is_stirred = true;
            let cost = tools.removal.find(sheet, vertex);
            self.costs[vertex as usize] = cost;
            match cost {
                Some(cost) => self.removals.enter(vertex, -cost),
                None => self.removals.cancel(vertex),
            }
            // A vertex that may not go still has triangles.
            sheet.star(vertex, &mut star);
            for triangle in star.triangles() {
                if !triangles.contains(&triangle) {
                    triangles.push(triangle);
                }
            }
        }
        triangles.iter().for_each(|&triangle| self.judge_triangle(sheet, triangle, tools));
    }
}
