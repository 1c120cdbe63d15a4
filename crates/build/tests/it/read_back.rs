//! A finished database read back for pictures, explained, and compared with another.

use build::product::{NO_RESIDUAL, Product, ProductError, ProductGround, Wanted, WantedGround};
use fidelity::{EYE_M, Triangles, sees_on};
use inspect::{difference, explain};
use load_module_reader::{Area, Curvature, Keep, Sight};
use terrain::{Dem, ModuleId, ModuleRect, Post};

use crate::scene::{Scene, Words, sample_dem, spacing};

fn words() -> Words {
    Words { size: (6, 8), tiles: (2, 2), ..Words::raster() }
}

fn read(scene: &Scene, part: Option<ModuleRect>) -> Result<Product, ProductError> {
    Product::read(&scene.path("area"), &Wanted { part, ground: WantedGround::Recorded, workers: 2 })
}

#[test]
fn residuals_at_posts_add_up_to_what_the_build_measured() {
    let words = words();
    let scene = Scene::on(&words, &sample_dem(words.grid(), 1));
    let report = scene.build("area", 2).report;
    let product = read(&scene, None).unwrap();
    let ground = product.ground.as_ref().unwrap();
    assert_eq!(ground.dem, sample_dem(words.grid(), 1));
    let squares: u64 = ground.residuals.iter().map(|&residual| (i64::from(residual).pow(2)) as u64).sum();
    let totals = product.manifest.totals;
    assert_eq!((ground.residuals.len() as u64, squares), (totals.residual_posts, totals.residual_sum_squared));
    let found = product.limit_use();
    assert_eq!(found.windows.iter().max(), Some(&(report.per_4km.max as u32)));
    assert_eq!(found.modules.iter().map(|&count| u64::from(count)).sum::<u64>(), report.triangles);
}

#[test]
fn the_reader_sees_what_fidelity_measures() {
    let words = words();
    let scene = Scene::on(&words, &sample_dem(words.grid(), 1));
    drop(scene.build("area", 2));
    let product = read(&scene, None).unwrap();
    let triangles = Triangles::of_modules(&product.modules, product.grid, spacing());
    let area = Area::open(scene.path("area"), Keep::InMemory).unwrap();
    let ground = area.load(area.whole()).unwrap();
    let (origin_m, post_m) = (area.frame().origin_m, spacing().metres());
    let whole = product.grid.posts_of_rect(product.grid.all());
    let reach = [whole.cells_wide(), whole.cells_high()].map(|cells| cells as f64);
    let mut draw = fastrand::Rng::with_seed(9);
    let mut seen = 0;
    for _ in 0..40 {
        let mut place = || reach.map(|reach| reach * draw.f64());
        let from = place();
        let stands = |place: [f64; 2]| {
            let [east, north] = [0, 1].map(|axis| origin_m[axis] + post_m * place[axis]);
            [east, north, ground.height_m([east, north]).unwrap() + EYE_M]
        };
        let eye = ground.eye(stands(from), Curvature::NONE);
        let mut eyes = [eye.clone(), eye.looking_far(3000.0)];
        for to in (0..200).map(|_| place()) {
            let expected = sees_on(&triangles, [from, to]);
            assert_eq!(ground.sight(stands(from), stands(to)) == Sight::Free, expected, "{from:?} {to:?}");
            assert_eq!(eyes.each_mut().map(|eye| eye.sees(stands(to))), [expected; 2], "{from:?} {to:?}");
            seen += u32::from(expected);
        }
    }
    assert!((400..7600).contains(&seen), "{seen} of 8,000");
}

#[test]
fn a_part_is_the_same_as_that_part_of_the_whole() {
    let words = words();
    let scene = Scene::on(&words, &sample_dem(words.grid(), 2));
    drop(scene.build("area", 2));
    let whole = read(&scene, None).unwrap();
    // Over the corner where all four tiles meet.
    let rect = ModuleRect { south: 1, west: 2, north: 5, east: 7 };
    let part = read(&scene, Some(rect)).unwrap();
    let inside: Vec<_> = whole.modules.iter().filter(|module| rect.contains(module.id)).cloned().collect();
    assert_eq!(part.modules, inside);
    let (whole, part) = (whole.ground.unwrap(), part.ground.unwrap());
    assert_eq!(part.dem, whole.dem.window(part.dem.rect()));
    let at = |of: &ProductGround, post: Post| {
        let rect = of.dem.rect();
        of.residuals[rect.index(post)]
    };
    let own = part.dem.rect();
    for row in own.south..own.north {
        for col in own.west..own.east {
            assert_eq!(at(&part, Post::new(row, col)), at(&whole, Post::new(row, col)), "{row},{col}");
        }
    }
    // On the far sides a post has the triangles of its own load module in place of its neighbour's: within rounding.
    for row in own.south..own.north {
        let post = Post::new(row, own.east);
        assert!(at(&part, post).abs_diff(at(&whole, post)) <= 1, "{post}");
    }
    let outside = read(&scene, Some(ModuleRect { south: 0, west: 0, north: 7, east: 1 }));
    assert!(outside.unwrap_err().to_string().contains("rows from 0 to 5"));
}

#[test]
fn voids_have_no_residual_and_keep_the_height_they_were_filled_with() {
    let words = Words { dem: "sources = [\"dem.tif\"]\nvoids = \"hole\"".into(), ..words() };
    let sound = sample_dem(words.grid(), 1);
    let is_hole = |post: Post| (30..34).contains(&post.row) && (50..55).contains(&post.col);
    let holed = Dem::from_fn(sound.rect(), |post| (!is_hole(post)).then(|| sound.height(post)));
    let scene = Scene::on(&words, &holed);
    drop(scene.build("area", 2));
    let ground = read(&scene, None).unwrap().ground.unwrap();
    let rect = ground.dem.rect();
    let posts = (rect.south..=rect.north).flat_map(|row| (rect.west..=rect.east).map(move |col| Post::new(row, col)));
    for (post, &residual) in posts.zip(&ground.residuals) {
        assert_eq!((residual == NO_RESIDUAL, ground.dem.is_void(post)), (is_hole(post), is_hole(post)), "{post}");
    }
    assert_ne!(ground.dem.height(Post::new(31, 52)), 0);
}

#[test]
fn an_explanation_counts_what_the_load_module_holds() {
    let words = words();
    let scene = Scene::on(&words, &sample_dem(words.grid(), 1));
    drop(scene.build("area", 2));
    let whole = read(&scene, None).unwrap();
    let limit_use = whole.limit_use();
    let mut places = Vec::new();
    for module in &whole.modules {
        let found = explain(&scene.path("area"), module.id, WantedGround::Recorded, 1).unwrap();
        assert_eq!(found.count, (limit_use.modules[whole.grid.index(module.id)], 100));
        assert_eq!(found.classes.iter().map(|(_, count)| count).sum::<u32>(), found.triangles);
        let more = found.one_more.unwrap();
        assert!(more.rms_after_m < found.residual_m[0], "{}", module.id);
        let [west, south, east, north] = found.extent_m;
        assert!(west < more.place_m[0] && more.place_m[0] < east && south < more.place_m[1] && more.place_m[1] < north);
        places.push(found.place.0);
    }
    places.sort_unstable();
    assert_eq!(places, (1..=whole.modules.len()).collect::<Vec<_>>(), "each has its own place from the worst");
}

#[test]
fn databases_of_the_same_ground_differ_by_their_load_modules_and_settings() {
    let words = words();
    let dem = sample_dem(words.grid(), 1);
    let scene = Scene::on(&words, &dem);
    drop(scene.build("area", 2));
    drop(scene.build("again", 1));
    let same = difference(&scene.path("area"), &scene.path("again"), 2).unwrap();
    assert_eq!((same.modules, same.changed.len(), same.settings.len()), (48, 0, 0));

    // A hill under one load module.
    let hill = |post: Post| if (45..56).contains(&post.row) && (65..76).contains(&post.col) { 20 * 128 } else { 0 };
    scene.replace_dem(&Dem::from_fn(dem.rect(), |post| Some(dem.height(post) + hill(post))));
    drop(scene.build("again", 2));
    let found = difference(&scene.path("area"), &scene.path("again"), 2).unwrap();
    let most = found.changed.iter().max_by(|a, b| a.apart_m.total_cmp(&b.apart_m)).unwrap();
    assert_eq!(most.module, ModuleId { row: 2, col: 3 });
    assert!(15.0 < most.apart_m && most.apart_m < 30.0, "{most:?}");
}
