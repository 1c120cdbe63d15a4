//! A mosaic of files too large to be decoded at once: each window is put together when it is asked for.
//!
//! A post comes out the same in every window. Heights between posts depend on the posts around them only; voids are
//! filled block by block, in blocks that hang on the source's own grid, each seen with the ground around it.

use terrain::{GridFrame, PostRect, QUANTA_PER_METRE};

use crate::chunk::Header;
use crate::crs::Crs;
use crate::join::{Extent, common_kind, offset, shifted};
use crate::longitudes::to_one_run;
use crate::mosaic::{Beyond, Corner, Layer, MARGIN};
use crate::samples::{Samples, union};
use crate::warp::Warp;
use crate::{Mosaic, MosaicRules, Patch, Raster, SourceError, Standing, Windows};

/// Posts a side of the blocks in which voids are filled.
const BLOCK_POSTS: i32 = 512;
/// Posts around a block that are looked at, besides those that a void may be filled from.
const AROUND_POSTS: i32 = 64;

/// Files in order of priority, read by window.
#[derive(Debug)]
pub struct WideMosaic {
    windows: Windows,
    joints: Vec<Joint>,
    rules: MosaicRules,
    area: Crs,
    grid: GridFrame,
    /// The joint with the lowest height of all, which ground takes that no source reaches.
    lowest: usize,
}

/// Files of one grid, as one raster.
#[derive(Debug)]
struct Joint {
    header: Header,
    /// Places in the list of files, and columns and rows from the joint's south-west post to theirs.
    members: Vec<(usize, [i32; 2])>,
    warp: Warp,
    posts_per_metre: [f64; 2],
    /// Height in metres of voids that lie near no height: the lowest of its files, which their type can hold.
    lowest_m: f64,
}

impl WideMosaic {
    /// Of the files at the places `used`, each with its lowest height in metres in the area `rect`, in order of
    /// priority.
    ///
    /// # Errors
    /// When joined rasters are together too large.
    pub fn new(
        mut windows: Windows,
        used: &[(usize, f64)],
        rules: MosaicRules,
        (area, grid, rect): (&Crs, &GridFrame, PostRect),
    ) -> Result<Self, SourceError> {
        // Files beside the area say nothing of how those in it lie together.
        let mut is_used = vec![false; windows.files().len()];
        used.iter().for_each(|&(file, _)| is_used[file] = true);
        let frames = windows.files_mut().iter_mut().zip(is_used).filter(|(_, is_used)| *is_used);
        to_one_run(frames.map(|(file, _)| file.frame_mut()));
        let header = |index: usize| windows.files()[index].header();
        let meaning = |index: usize| (&header(index).frame, (header(index).scale, &header(index).shift));
        let mut groups: Vec<Vec<(usize, f64)>> = Vec::new();
        for &file in used {
            match groups.last_mut() {
                Some(group) if rules.joins(group.iter().map(|&(index, _)| meaning(index)), meaning(file.0)) => {
                    group.push(file);
                }
                _ => groups.push(vec![file]),
            }
        }
        let joints = groups.into_iter().map(|group| {
            let headers: Vec<&Header> = group.iter().map(|&(index, _)| header(index)).collect();
            let lowest_m = group.iter().map(|&(_, lowest_m)| lowest_m).fold(f64::INFINITY, f64::min);
            let (header, shifts) = joined(&headers)?;
            let warp = Warp::new(&header.frame, area, grid);
            let posts_per_metre = warp.posts_per_metre(rect);
            let members = group.into_iter().map(|(index, _)| index).zip(shifts).collect();
            Ok(Joint { header, members, warp, posts_per_metre, lowest_m })
        });
        let joints = joints.collect::<Result<Vec<_>, SourceError>>()?;
        let lowest = (0..joints.len()).min_by(|&a, &b| joints[a].lowest_m.total_cmp(&joints[b].lowest_m));
        Ok(Self { windows, joints, rules, area: area.clone(), grid: *grid, lowest: lowest.unwrap_or(0) })
    }

    /// Heights at the posts `rect` of the working grid.
    ///
    /// # Errors
    /// When a file cannot be read any more.
    pub fn resample(&self, rect: PostRect) -> Result<Patch, SourceError> {
        Ok(self.around(rect)?.resample(rect))
    }

    /// Calls `each` as [`Mosaic::each_own_post`].
    ///
    /// # Errors
    /// As [`WideMosaic::resample`].
    pub fn each_own_post(&self, rect: PostRect, each: &mut dyn FnMut([f64; 2], f64)) -> Result<(), SourceError> {
        self.around(rect)?.each_own_post(rect, each);
        Ok(())
    }

    /// What lies under a rectangle of the working grid.
    fn around(&self, rect: PostRect) -> Result<Mosaic, SourceError> {
        let mut layers = Vec::new();
        for joint in &self.joints {
            let Some(window) = joint.warp.window(rect, MARGIN) else { continue };
            let (raster, standings) = self.settled(joint, window)?;
            let (warp, posts_per_metre) = (joint.warp.clone(), joint.posts_per_metre);
            layers.push(Layer { raster, standings, warp, posts_per_metre });
        }
        let beyond = self.joints.get(self.lowest).map(|joint| Beyond {
            quanta: joint.lowest_m * f64::from(QUANTA_PER_METRE),
            shift: joint.header.shift.clone(),
        });
        let place = (self.area.clone(), self.grid);
        Ok(Mosaic { layers, rules: self.rules, place, beyond })
    }

    /// Which posts of a rectangle some file reaches, from headers alone: a post is a height or a gap.
    pub fn reached(&self, rect: PostRect) -> Patch {
        let mut patch =
            Patch { rect, heights: vec![0; rect.post_count()], standings: vec![Standing::Gap; rect.post_count()] };
        for joint in &self.joints {
            let Some(window) = joint.warp.window(rect, MARGIN) else { continue };
            let places = joint.warp.over(rect);
            // Of thousands of files few lie under one rectangle.
            let rects = joint.members.iter().map(|&(file, shift)| shifted(self.windows.files()[file].rect(), shift));
            let rects: Vec<PostRect> = rects.filter(|rect| rect.intersection(&window).is_some()).collect();
            let holds = |post: terrain::Post| rects.iter().any(|rect| rect.contains(post));
            for (post, standing) in rect.posts().zip(&mut patch.standings) {
                if *standing == Standing::Gap
                    && let Some(place) = places.at(post.row, post.col)
                    && let Some(corner) = Corner::around(place, &joint.header.frame, joint.header.frame.rect())
                    && corner.posts().posts().all(holds)
                {
                    *standing = Standing::Height;
                }
            }
        }
        patch
    }

    /// A window of a joint in which every post holds a height, and how each stands.
    fn settled(&self, joint: &Joint, window: PostRect) -> Result<(Raster, Vec<Standing>), SourceError> {
        let (mut raster, mut standings) = joint.read(&self.windows, window)?;
        if standings.is_empty() {
            return Ok((raster, standings));
        }
        let reach = self.rules.voids.fill_within as i32 + AROUND_POSTS;
        let scale = joint.header.scale;
        let lowest = (joint.lowest_m / scale.unit_m - scale.offset) / scale.scale;
        for block in blocks(window) {
            let cut = block.intersection(&window).expect("blocks touch their window");
            if cut.posts().all(|post| standings[window.index(post)] < Standing::Void) {
                continue;
            }
            let around =
                block.grown(reach).intersection(&joint.header.frame.rect()).expect("a block lies in its raster");
            let (mut near, mut near_standings) = joint.read(&self.windows, around)?;
            let is_known = near.void_count() < around.post_count();
            for index in if is_known { near.fill_around(self.rules.voids.fill_within) } else { Vec::new() } {
                if near_standings[index] == Standing::Void {
                    near_standings[index] = Standing::Filled;
                }
            }
            for post in cut.posts() {
                let (at, from) = (window.index(post), around.index(post));
                if Standing::Void <= standings[at] {
                    standings[at] = near_standings[from];
                    raster.samples.set(at, if is_known { near.samples.get(from) } else { lowest });
                }
            }
        }
        raster.voids.settled = true;
        Ok((raster, standings))
    }
}

/// The header of several rasters of one grid, and where each begins in it.
fn joined(headers: &[&Header]) -> Result<(Header, Vec<[i32; 2]>), SourceError> {
    if let [alone] = headers {
        return Ok(((*alone).clone(), vec![[0, 0]]));
    }
    let offsets: Vec<[i64; 2]> = headers.iter().map(|header| offset(&headers[0].frame, &header.frame)).collect();
    let frames: Vec<_> = headers.iter().map(|header| &header.frame).collect();
    let extent = Extent::of(&frames, &offsets)?;
    let kind = common_kind(headers.iter().map(|header| header.kind));
    let (scale, shift) = (headers[0].scale, headers[0].shift.clone());
    let header = Header { frame: extent.frame(frames[0]), scale, kind, nodata: None, shift };
    Ok((header, offsets.into_iter().map(|offset| extent.shift(offset)).collect()))
}

impl Joint {
    /// The posts of a window, and how they stand where not all are heights.
    fn read(&self, windows: &Windows, window: PostRect) -> Result<(Raster, Vec<Standing>), SourceError> {
        if let [(file, _)] = self.members[..] {
            let raster = windows.read(file, window)?;
            let standing = |index| if raster.voids.contains(index) { Standing::Void } else { Standing::Height };
            let count = if raster.void_count() == 0 { 0 } else { window.post_count() };
            let standings = (0..count).map(standing).collect();
            return Ok((raster, standings));
        }
        let mut samples = Samples::zeroed(self.header.kind, window.post_count());
        let mut standings = vec![Standing::Gap; window.post_count()];
        let mut range_m = None;
        for &(file, shift) in &self.members {
            let Some(cut) = shifted(windows.files()[file].rect(), shift).intersection(&window) else { continue };
            let raster = windows.read(file, shifted(cut, shift.map(|posts| -posts)))?;
            range_m = [range_m, raster.range_m()].into_iter().flatten().reduce(union);
            for (from, post) in cut.posts().enumerate() {
                let standing = if raster.voids.contains(from) { Standing::Void } else { Standing::Height };
                let at = window.index(post);
                if standing < standings[at] {
                    standings[at] = standing;
                    // What marks a void is a number in this file only.
                    if standing == Standing::Height {
                        samples.set(at, raster.samples.get(from));
                    }
                }
            }
        }
        let missing = standings.iter().enumerate().filter(|&(_, &standing)| Standing::Void <= standing);
        let raster = Raster::joined(&self.header, window, samples, missing.map(|(index, _)| index), range_m);
        if raster.void_count() == 0 {
            standings.clear();
        }
        Ok((raster, standings))
    }
}

/// The blocks that touch a window.
fn blocks(window: PostRect) -> impl Iterator<Item = PostRect> {
    let range = |low: i32, high: i32| low.div_euclid(BLOCK_POSTS)..=high.div_euclid(BLOCK_POSTS);
    let (rows, cols) = (range(window.south, window.north), range(window.west, window.east));
    rows.flat_map(move |row| cols.clone().map(move |col| (row * BLOCK_POSTS, col * BLOCK_POSTS)))
        .map(|(south, west)| PostRect { south, west, north: south + BLOCK_POSTS - 1, east: west + BLOCK_POSTS - 1 })
}
