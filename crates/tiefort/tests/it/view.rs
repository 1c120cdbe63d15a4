//! `tiefort view`: the server of the viewer, or of the report's page where no viewer is built in.

#[cfg(not(feature = "viewer"))]
mod report_page {
    use crate::scene::Scene;
    use crate::server::Server;

    fn check(options: &[&str]) {
        let scene = Scene::with_job("small.toml", &[]);
        scene.run_to(0, &[&["build", "job.toml", "--quiet"], options].concat());
        let server = Server::start(scene, &["view", "small.tdb"]);
        let page = server.get("/");
        assert_eq!((page.status, page.header("content-type")), (200, "text/html; charset=utf-8"));
        let body = page.text().find("<body").unwrap();
        let words = ["built without the viewer", "scripts/build_viewer.sh", "--features viewer", "<svg"];
        let places = words.map(|word| page.text()[body..].find(word).unwrap_or_else(|| panic!("{word} is not there")));
        assert!(places.is_sorted(), "{places:?}");
        assert_eq!(server.post("/heights", r#"{"positions": [[505100, 3875100]]}"#).status, 200);
        assert_eq!(server.get("/small.tdb/modules").status, 200);
    }

    #[test]
    fn without_the_viewer_the_page_of_the_report_is_shown() {
        check(&[]);
    }

    #[test]
    fn a_page_that_no_build_wrote_is_drawn() {
        check(&["--no-html"]);
    }

    #[test]
    fn imagery_needs_the_viewer() {
        let scene = Scene::new();
        scene.refuses(&["view", "small.tdb", "--imagery", "x.tif"], &["--imagery", "no viewer"]);
        let hint = scene.run_to(2, &["view", "small.tdb", "--imagery", "x.tif"]).stderr;
        assert!(hint.contains("scripts/build_viewer.sh") && hint.contains("--features viewer"), "{hint}");
    }
}

#[cfg(feature = "viewer")]
mod page {
    use serde_json::Value;

    use crate::raster::Raster;
    use crate::scene::Scene;
    use crate::server::Server;

    fn served() -> Server {
        let scene = Scene::with_job("small.toml", &[]);
        scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html"]);
        served_in(scene, "small.tdb")
    }

    fn served_in(scene: Scene, folder: &str) -> Server {
        Server::start(scene, &["view", folder])
    }

    impl Server {
        /// Status and body of an answer to a request for `path` under the name `host`.
        fn asked_as(&self, host: &str, path: &str) -> (u16, Vec<u8>) {
            let answer = self.ask("GET", path, &[&format!("Host: {host}")], &[]);
            (answer.status, answer.body)
        }

        fn asked(&self, path: &str) -> (u16, Vec<u8>) {
            self.asked_as(&self.host, path)
        }
    }

    #[test]
    fn roads_without_triangles_of_their_own_are_given_load_module_by_load_module() {
        let scene = Scene::with_job("small.toml", &[]);
        let job = std::fs::read_to_string(scene.path("job.toml")).unwrap();
        std::fs::write(scene.path("job.toml"), format!("{job}\n[features]\nsources = [\"sample\"]\n")).unwrap();
        scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html"]);
        let server = served_in(scene, "small.tdb");
        let area: Value = serde_json::from_slice(&server.asked("/api/area").1).unwrap();
        assert_eq!(area["has_lines"], true);
        let (status, lines) = server.asked("/api/lines/0/0/8/8");
        assert!(status == 200 && !lines.is_empty() && lines.len() % 40 == 0);
        let of_area = server.asked("/api/lines").1;
        assert_eq!(of_area.len(), lines.len(), "so few are all seen from afar");
        let part = server.asked("/api/lines/2/0/3/8").1;
        assert!(part.len() < lines.len());
        for edge in lines.chunks(40) {
            let word = |at: usize| u32::from_le_bytes(edge[4 * at..4 * at + 4].try_into().unwrap());
            let metres = |at: usize| f64::from(f32::from_bits(word(at)));
            let module = |at: usize| ((metres(at) + metres(at + 3)) / 2.0 / 500.0) as u32;
            assert_eq!((word(0), word(1)), (module(5), module(4)), "row and column");
            assert!(word(2) < area["classes"].as_array().unwrap().len() as u32);
        }
        assert_eq!(part.chunks(40).count(), lines.chunks(40).filter(|edge| edge[0] == 2).count());
    }

    /// A river from west to east, a part of it drawn as water, 200 m wide.
    const RIVER: &str = r#"{"type": "FeatureCollection",
        "crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32611"}}, "features": [
        {"type": "Feature", "properties": {"waterway": "river"}, "geometry": {"type": "LineString",
            "coordinates": [[505200, 3877000], [508800, 3877000]]}},
        {"type": "Feature", "properties": {"natural": "water", "water": "river"}, "geometry": {"type": "Polygon",
            "coordinates": [[[506000, 3876900], [507500, 3876900], [507500, 3877100], [506000, 3877100],
            [506000, 3876900]]]}}]}"#;

    #[test]
    fn the_line_of_a_river_is_drawn_on_its_water_only_from_afar() {
        let scene = Scene::with_job("small.toml", &[]);
        let job = std::fs::read_to_string(scene.path("job.toml")).unwrap();
        std::fs::write(scene.path("river.geojson"), RIVER).unwrap();
        std::fs::write(scene.path("job.toml"), format!("{job}\n[features]\nsources = [\"river.geojson\"]\n")).unwrap();
        scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html"]);
        let server = served_in(scene, "small.tdb");
        // From afar its water is seen only at the corners of a coarse grid.
        for (path, is_far) in [("/api/lines/0/0/8/8", false), ("/api/lines", true)] {
            let lines = server.asked(path).1;
            let metres = |at: &[u8]| f64::from(f32::from_le_bytes(at.try_into().unwrap()));
            let middle = |edge: &[u8]| f64::midpoint(metres(&edge[16..20]), metres(&edge[28..32]));
            let on_water = |east: &f64| (1050.0..2450.0).contains(east);
            let (wet, dry): (Vec<f64>, Vec<f64>) = lines.chunks(40).map(middle).partition(on_water);
            assert!(wet.is_empty() != is_far && !dry.is_empty(), "{path}: {wet:?}");
        }
    }

    /// Two houses, the larger one with a courtyard, and one that hangs over the ground.
    const HOUSES: &str = r#"{"type": "FeatureCollection",
        "crs": {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32611"}}, "features": [
        {"type": "Feature", "properties": {"building": "yes", "height": "9"}, "geometry": {"type": "Polygon",
            "coordinates": [[[505600, 3875600], [505610, 3875600], [505610, 3875610], [505600, 3875610],
            [505600, 3875600]]]}},
        {"type": "Feature", "properties": {"building": "yes", "building:levels": "5"}, "geometry": {"type": "Polygon",
            "coordinates": [[[505700, 3875700], [505740, 3875700], [505740, 3875740], [505700, 3875740],
            [505700, 3875700]], [[505710, 3875710], [505720, 3875710], [505720, 3875720], [505710, 3875710]]]}},
        {"type": "Feature", "properties": {"building": "roof", "height": "12", "min_height": "8"}, "geometry":
            {"type": "Polygon", "coordinates": [[[506600, 3876600], [506620, 3876600], [506620, 3876620],
            [506600, 3876600]]]}}]}"#;

    #[test]
    fn buildings_stand_on_the_ground_and_the_largest_of_a_load_module_come_first() {
        let scene = Scene::with_job("small.toml", &[]);
        let job = std::fs::read_to_string(scene.path("job.toml")).unwrap();
        std::fs::write(scene.path("houses.geojson"), HOUSES).unwrap();
        std::fs::write(scene.path("job.toml"), format!("{job}\n[features]\nsources = [\"houses.geojson\"]\n")).unwrap();
        scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html"]);
        let server = served_in(scene, "small.tdb");
        let area: Value = serde_json::from_slice(&server.asked("/api/area").1).unwrap();
        assert_eq!(area["buildings"], 3);
        let (status, all) = server.asked("/api/buildings/0/0/8/8");
        let word = |at: usize| u32::from_le_bytes(all[4 * at..4 * at + 4].try_into().unwrap());
        let metres = |at: usize| f64::from(f32::from_bits(word(at)));
        assert_eq!((status, [0, 1, 2].map(word)), (200, [2, 4, 3]), "two rings, of four corners and of three");
        let height = |east: f64, north: f64| {
            let path = format!("/profile?from={east},{north}&to={},{north}&spacing_m=1", east + 1.0);
            serde_json::from_slice::<Value>(&server.asked(&path).1).unwrap()["height_m"][0].as_f64().unwrap()
        };
        let [floor, roof, size] = [3, 4, 5].map(metres);
        let corners = [(505_700.0, 3_875_700.0), (505_740.0, 3_875_700.0), (505_740.0, 3_875_740.0)];
        let ground = corners.map(|(east, north)| height(east, north));
        assert!(ground.iter().all(|height| floor < *height && *height + 2.0 < roof), "{floor} {roof} {ground:?}");
        assert!(roof - floor < 15.0 + 25.0 + 40.0 && size == 40.0);
        let second = 6 + 2 * 7;
        assert_eq!([second, second + 1].map(word), [1, 4], "the smaller one comes after it");
        assert_eq!(server.asked("/api/buildings/4/4/8/8").1.len(), 0);
        let hanging = server.asked("/api/buildings/3/3/4/4").1;
        let part = |at: usize| f64::from(f32::from_le_bytes(hanging[at..at + 4].try_into().unwrap()));
        assert!((part(12) - part(8) - 4.0).abs() < 0.01 || part(12) - part(8) < 4.0 + 20.0);
        assert!(height(506_600.0, 3_876_600.0) - 20.0 < part(8));
    }

    #[test]
    fn objects_come_with_their_load_modules_and_no_building_is_drawn_twice() {
        let scene = Scene::with_job("small.toml", &[]);
        let job = std::fs::read_to_string(scene.path("job.toml")).unwrap();
        std::fs::write(scene.path("houses.geojson"), HOUSES).unwrap();
        let sections = "[features]\nsources = [\"houses.geojson\"]\n[objects]\n";
        std::fs::write(scene.path("job.toml"), format!("{job}\n{sections}")).unwrap();
        scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html"]);
        let modules =
            load_module_reader::Area::open(scene.path("small.tdb"), load_module_reader::Keep::OnDisk).unwrap();
        let ground = modules.load(modules.whole()).unwrap();
        let server = served_in(scene, "small.tdb");
        let area: Value = serde_json::from_slice(&server.asked("/api/area").1).unwrap();
        assert_eq!((&area["objects"], &area["buildings"]), (&serde_json::json!({ "building": 3 }), &0.into()));
        assert!(server.asked("/api/buildings/0/0/8/8").1.is_empty());
        let all = server.asked("/api/modules/1/1/2/2").1;
        let word = |at: usize| u32::from_le_bytes(all[4 * at..4 * at + 4].try_into().unwrap()) as usize;
        let objects = &ground
            .modules()
            .iter()
            .map(|module| module.module())
            .find(|module| (module.row, module.col) == (1, 1))
            .unwrap()
            .objects;
        assert_eq!(objects.prisms.len(), 2);
        assert_eq!(all[all.len() - word(12)..], objects.to_part()[..], "the part of the file, as it is");
        assert_eq!(server.asked("/api/modules/0/0/1/1").1[48..52], [0; 4], "nothing stands there");
    }

    #[test]
    fn the_server_hands_out_the_page_the_area_and_its_load_modules() {
        let server = served();
        let (status, page) = server.asked("/");
        assert!(status == 200 && page.starts_with(b"<!doctype html>"));
        assert!(server.asked("/viewer.js").1.len() > 100_000);
        let area: Value = serde_json::from_slice(&server.asked("/api/area").1).unwrap();
        assert_eq!((&area["rows"], &area["cols"]), (&8.into(), &8.into()));
        let steps = area["coarse_steps"].as_u64().unwrap() as usize;
        let (_, overview) = server.asked("/api/overview");
        let places = (8 * steps + 1).pow(2);
        assert_eq!(overview.len(), 4 * places + 16 * 64 + places);
        // The class at each height, by which water is blue far away and on the map, too: all of it is mountains here.
        assert!(overview[overview.len() - places..].iter().all(|&class| class == 1));
        let triangles = |place: usize| {
            let at = overview.len() - places - 16 * (64 - place);
            u32::from_le_bytes(overview[at..at + 4].try_into().unwrap())
        };
        assert_eq!(u64::from((0..64).map(triangles).sum::<u32>()), area["triangles"].as_u64().unwrap());
        let (status, block) = server.asked("/api/modules/2/3/4/5");
        let word = |place: usize| u32::from_le_bytes(block[4 * place..4 * place + 4].try_into().unwrap());
        assert_eq!((status, word(0), word(1), word(3)), (200, 2, 3, triangles(2 * 8 + 3)));
        assert_eq!(server.asked("/api/dem"), (200, br#"{"why":null}"#.to_vec()));
        let (status, posts) = server.asked("/api/dem/2/3/4/5");
        assert_eq!((status, posts.len()), (200, 8 * 41 * 41));
    }

    #[test]
    fn places_are_told_in_other_coordinates() {
        let server = served();
        let value = |path: &str| {
            let (status, body) = server.asked(path);
            let text = String::from_utf8(body).unwrap();
            assert_eq!(status, 200, "{path}: {text}");
            serde_json::from_str::<Value>(&text).unwrap()
        };
        assert_eq!(value("/api/find/506000%203876000")["place_m"], serde_json::json!([506_000.0, 3_876_000.0]));
        let near = value("/api/find/11S%20506000%203876000");
        assert!((near["place_m"][1].as_f64().unwrap() - 3_876_000.0).abs() < 1e-3, "{near}");
        let globe = value("/api/where/506000,3876000");
        let [latitude, longitude] = ["latitude", "longitude"].map(|name| globe[name].as_f64().unwrap());
        let back = value(&format!("/api/find/{latitude},{longitude}"));
        assert!((back["place_m"][0].as_f64().unwrap() - 506_000.0).abs() < 0.01, "{back}");
        let both = value("/api/degrees/506000,3876000;507000,3876000");
        assert_eq!((both[0][0].as_f64(), both[0][1].as_f64()), (Some(longitude), Some(latitude)));
        assert!(both[0][0].as_f64() < both[1][0].as_f64() && both.as_array().unwrap().len() == 2);
        for wrong in ["/api/degrees/1", "/api/find/nowhere", "/api/find/11X%201%202"] {
            assert_eq!(server.asked(wrong).0, 409, "{wrong}");
        }
        let (status, relief) = server.asked("/api/relief");
        assert_eq!((status, relief.len()), (200, 20 + 3 * 161 * 161));
    }

    #[test]
    fn without_its_raster_a_database_is_served_and_says_that_there_is_no_dem() {
        let scene = Scene::with_job("raster.toml", &[]);
        Raster::sound().write(&scene.path("dem.tif"));
        scene.run_to(0, &["build", "job.toml", "--quiet", "--no-html", "--out", "a.tdb"]);
        std::fs::rename(scene.path("dem.tif"), scene.path("gone.tif")).unwrap();
        let server = served_in(scene, "a.tdb");
        assert_eq!(server.asked("/api/modules/0/0/1/1").0, 200);
        let ground: Value = serde_json::from_slice(&server.asked("/api/dem").1).unwrap();
        assert!(ground["why"].as_str().unwrap().contains("dem.tif"), "{ground}");
        let (status, why) = server.asked("/api/dem/0/0/1/1");
        assert!(status == 409 && String::from_utf8(why).unwrap().contains("dem.tif"));
    }

    #[test]
    fn beside_the_page_programs_are_answered_as_by_serve() {
        let server = served();
        assert_eq!(server.asked("/small.tdb/modules/r00c00.slm").0, 200);
        assert_eq!(server.asked("/databases.json").0, 200);
        assert_eq!(server.post("/heights", r#"{"positions": [[505010, 3875010]]}"#).status, 200);
    }

    #[test]
    fn what_cannot_be_answered_is_told_in_words() {
        let server = served();
        for wrong in ["/api/modules/2/3/2/5", "/api/modules/0/0/9/8", "/api/dem/0/0/8/9"] {
            let (status, why) = server.asked(wrong);
            assert!(status == 404 && String::from_utf8(why).unwrap().contains("of 8 x 8 load modules"), "{wrong}");
        }
        assert_eq!(server.asked("/api/modules/a/b/c/d").0, 400);
        assert_eq!(server.asked("/etc/passwd").0, 404);
        assert_eq!(server.asked_as("example.org", "/api/area").0, 403);
        let port = server.host.rsplit(':').next().unwrap();
        server.scene.refuses(&["view", "small.tdb", "--port", port], &[port, "cannot be served"]);
        server.scene.refuses(&["view", "none.tdb"], &["none.tdb"]);
    }
}
