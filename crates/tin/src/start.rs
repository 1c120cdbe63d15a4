//! What a tile holds before the first post is selected, and which posts the limits still permit.

use terrain::geometry::{LocalPost, LocalRect};
use terrain::limits::TileLedger;
use terrain::mesh::{Lines, Mesh};
use terrain::{ModuleId, POINT_COST, PostRect, Refusal, RefusedBy, SeamSides};

use crate::task::{Frame, StartPost, TileTask};

/// A mesh with its first vertices, in their order, and the gate to the next ones.
pub(crate) struct Start {
    pub mesh: Mesh,
    pub vertices: Vec<LocalPost>,
    pub gate: Gate,
    /// Posts to start from that limits keep out. Their residual is 0: no ground has been looked at.
    pub refused: Vec<Refusal>,
}

impl Start {
    /// The tile's corners, load-module corners, border points and inherited points.
    pub fn new(task: &TileTask) -> Self {
        let mesh = match &task.frame {
            Frame::Plain => Mesh::new(task.rect, Lines::none()),
            Frame::Corners { side_cells } => Mesh::with_corners_every(task.rect, *side_cells),
            Frame::Sides { side_cells, .. } => Mesh::new(task.rect, Lines::every(*side_cells)),
        };
        let gate = task.ledger().map_or(Gate::Open, Gate::Limits);
        let mut start = Self { vertices: first_corners(&mesh), mesh, gate, refused: Vec::new() };
        start.insert_all(task);
        start.insert_given(task);
        start
    }

    /// What a job gives: pins without asking, others as far as limits permit.
    fn insert_given(&mut self, task: &TileTask) {
        let mut hint = 0;
        let (pinned, others): (Vec<StartPost>, Vec<StartPost>) = task.start.iter().partition(|start| start.pinned);
        for StartPost { at, pinned } in pinned.into_iter().chain(others) {
            let post = LocalPost::of(at, task.rect);
            let triangle = self.mesh.triangle_at(post, hint);
            if self.mesh.triangles()[triangle as usize].corners.contains(&post) {
                continue;
            }
            if !pinned {
                if let Some((module, by)) = self.gate.refuses(post) {
                    self.refused.push(Refusal { post: at, module, residual: 0, by });
                    continue;
                }
                if self.gate.is_spent() {
                    continue;
                }
                self.gate.charge(post);
            }
            hint = self.mesh.insert(post, triangle)[0];
            self.vertices.push(post);
        }
    }

    fn insert_all(&mut self, task: &TileTask) {
        let border = task.border.iter().filter(|post| task.barred.binary_search(post).is_err());
        let all = border.chain(&task.inherited).chain(&task.kept);
        let mut posts: Vec<LocalPost> = all.map(|&post| LocalPost::of(post, task.rect)).collect();
        posts.sort_unstable();
        posts.dedup();
        let mut hint = 0;
        for post in posts {
            let triangle = self.mesh.triangle_at(post, hint);
            if !self.mesh.triangles()[triangle as usize].corners.contains(&post) {
                hint = self.mesh.insert(post, triangle)[0];
                self.vertices.push(post);
            }
        }
    }
}

fn first_corners(mesh: &Mesh) -> Vec<LocalPost> {
    let mut corners: Vec<LocalPost> = mesh.triangles().iter().flat_map(|record| record.corners).collect();
    corners.sort_unstable();
    corners.dedup();
    corners
}

/// Where candidates may lie: everywhere but on the sides that belong to another tile.
pub(crate) fn candidates(rect: PostRect, seams: SeamSides) -> LocalRect {
    let shut = |open: bool| i32::from(!open);
    LocalRect {
        south: shut(seams.south),
        west: shut(seams.west),
        north: rect.cells_high() as i32 - shut(seams.north),
        east: rect.cells_wide() as i32 - shut(seams.east),
    }
}

/// What stands between a post and the TIN.
pub(crate) enum Gate {
    /// Nothing.
    Open,
    /// The limits of load modules and windows.
    Limits(TileLedger),
}

impl Gate {
    /// The load module and the limit that refuse `post`, if any do.
    pub fn refuses(&self, post: LocalPost) -> Option<(ModuleId, RefusedBy)> {
        let Gate::Limits(ledger) = self else { return None };
        ledger.refuses(post.row(), post.col())
    }

    /// Spends what `post` costs.
    pub fn charge(&mut self, post: LocalPost) {
        if let Gate::Limits(ledger) = self {
            ledger.charge(post.row(), post.col());
        }
    }

    /// Whether the tile cannot afford one more point.
    pub fn is_spent(&self) -> bool {
        matches!(self, Gate::Limits(ledger) if ledger.counts().left() < i64::from(POINT_COST))
    }

    /// Triangles spent so far.
    pub fn spent(&self) -> u32 {
        match self {
            Gate::Open => 0,
            Gate::Limits(ledger) => ledger.counts().spent(),
        }
    }
}
