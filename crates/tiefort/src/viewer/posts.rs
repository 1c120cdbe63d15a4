//! The DEM's posts under a block of load modules, where the sources of the database can be read.
//!
//! As bytes: heights of all posts of the block, its four border lines included, in metres (f32), row by row from the
//! south-west; then the residual of each, DEM less triangles (f32; not a number at voids).

use build::product::{NO_RESIDUAL, Product, ProductGround, Wanted, WantedGround};
use load_module_reader::{Block, QUANTA_PER_METRE};
use terrain::{ModuleRect, Post};

use super::area::Viewed;

/// Posts of an area up to which the ground is held: 12 bytes each.
const POSTS_MAX: usize = 32 << 20;

/// The posts of `block`.
///
/// # Errors
/// In words, when there is no ground to show.
pub fn bytes(viewed: &Viewed, block: Block) -> Result<Vec<u8>, String> {
    let ground = ground(viewed)?;
    let Block { south, west, north, east } = block;
    let rect = viewed.grid.posts_of_rect(ModuleRect { south, west, north, east });
    let whole = ground.dem.rect();
    let metres = |quanta: i32| quanta as f32 / QUANTA_PER_METRE as f32;
    let posts = (rect.south..=rect.north).flat_map(|row| (rect.west..=rect.east).map(move |col| Post::new(row, col)));
    let residual = |post: Post| {
        let place = whole.index(post);
        match ground.residuals[place] {
            NO_RESIDUAL => f32::NAN,
            quanta => metres(quanta),
        }
    };
    let heights = posts.clone().map(|post| metres(ground.dem.height(post)));
    Ok(heights.chain(posts.map(residual)).flat_map(f32::to_le_bytes).collect())
}

/// The ground of the whole area, read when it is first asked for.
///
/// # Errors
/// In words, when the sources cannot be read, or too large.
pub fn ground(viewed: &Viewed) -> Result<&ProductGround, String> {
    viewed.ground.get_or_init(|| read(viewed)).as_ref().map_err(Clone::clone)
}

fn read(viewed: &Viewed) -> Result<ProductGround, String> {
    let posts = viewed.grid.posts_of_rect(viewed.grid.all()).post_count();
    if POSTS_MAX < posts {
        return Err(format!("the area has {posts} posts, and the viewer holds at most {POSTS_MAX}"));
    }
    let wanted = Wanted { part: None, ground: WantedGround::Recorded, workers: 2 };
    let product = Product::read(&viewed.folder, &wanted).map_err(|error| error.to_string())?;
    product.ground.ok_or_else(|| "the database names no ground".into())
}
